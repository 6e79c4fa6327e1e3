#include "algorithms/extraction/manifold_dual_contouring/region_proof.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <numeric>
#include <optional>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/region_polygon.h"
#include "algorithms/extraction/manifold_dual_contouring/widened_mask.h"

namespace hermesh {
namespace {

/// Bits of a cube in each of its words of a mask.
std::uint64_t rows_of(const Region& cube) {
  std::uint64_t rows = 0;
  for (int y = 0; y < cube.side(); ++y)
    rows |= ((std::uint64_t{1} << cube.side()) - 1) << ((cube.cell & 63) + 8 * y);
  return rows;
}

}  // namespace

RegionProof::RegionProof(Regions& regions, const EdgePolygons& polygons,
                         const std::vector<Eigen::Vector3d>& points, std::span<const float> tolerance,
                         RunContext& context)
    : regions_(regions),
      cells_(regions.cells()),
      shell_(regions, polygons, points, tolerance, context),
      context_(context),
      bold_(regions.cube_count()),
      open_(cells_.size()),
      any_bold_(cells_.size()) {
  parallel_blocks(cells_.size(), context_,
                  [&](std::size_t b) { open_[b] = regions_.outer_edges(static_cast<std::int32_t>(b)); });
  for (std::size_t b = 0; b < cells_.size(); ++b) {
    const auto& lower = cells_.source(static_cast<std::int32_t>(b)).lower;
    turns_[static_cast<std::size_t>(((lower[0] >> 3) & 1) << 2 | ((lower[1] >> 3) & 1) << 1 |
                                    ((lower[2] >> 3) & 1))]
        .push_back(static_cast<std::uint32_t>(b));
  }
}

std::size_t RegionProof::run() {
  std::size_t splits = split();  // what was called bold meanwhile
  for (;;) {
    look_at_polygons();
    const std::size_t now = split();
    if (now == 0) return splits;
    splits += now;
  }
}

void RegionProof::call_bold(const CellBlocks::Edge& edge) { call_bold(ring_of(regions_, edge).largest()); }

void RegionProof::call_bold(const Region& region) {
  std::atomic_ref(any_bold_[static_cast<std::size_t>(region.block)]).store(1, std::memory_order_relaxed);
  std::atomic_ref(bold_[regions_.number(region)]).store(1, std::memory_order_relaxed);
}

void RegionProof::look_at_polygons() {
  // A cube has polygons in its own block and those next to it, and of these no two in one turn: what is
  // split does not depend on threads.
  for (const std::vector<std::uint32_t>& turn : turns_)
    parallel_blocks(turn.size(), context_, [&](std::size_t i) {
      const std::size_t b = turn[i];
      for (int axis = 0; axis < 3; ++axis)
        for (int word = 0; word < 8; ++word) {
          std::uint64_t& open = open_[b][axis][word];
          for (std::uint64_t bits = open; bits != 0; bits &= bits - 1)
            if (holds({static_cast<std::int32_t>(b), 64 * word + std::countr_zero(bits), axis}))
              open &= ~(bits & -bits);
        }
    });
}

/// A polygon of a cube that is split anyway is not looked at.
bool RegionProof::holds(const CellBlocks::Edge& edge) {
  const RegionRing ring = ring_of(regions_, edge);
  if (!ring.has_polygon() || !ring.any_merged) return true;
  for (int i = 0; i < ring.corners; ++i)
    if (const Region& region = ring.regions[static_cast<std::size_t>(i)];
        region.merged() && bold_[regions_.number(region)])
      return false;
  const std::optional<RegionPolygon> polygon = polygon_of(regions_, edge, ring);
  if (polygon && is_manifold(*polygon) && shell_.holds(*polygon)) return true;
  call_bold(ring.largest());
  return false;
}

/// Whether the edge that its envelope is made of is crossed once: else several polygons would share that.
bool RegionProof::is_crossed_once(const RegionPolygon& polygon) const {
  constexpr int kShift[3] = {6, 3, 0};
  const int length = static_cast<int>(polygon.length), shift = kShift[polygon.axis()];
  CellBlocks::Edge first = polygon.crossing;
  first.sample &= ~((length - 1) << shift);
  return crossings_on(first, length, cells_) == 1;
}

/// Whether each two of its regions have one polygon more in common, and no other. A face of a single cell
/// is not ambiguous.
bool RegionProof::is_manifold(const RegionPolygon& polygon) const {
  if (!is_crossed_once(polygon)) return false;
  for (int i = 0; i < polygon.corners; ++i)
    if (polygon.regions[i].merged() && polygon.regions[polygon.next(i)].merged() &&
        crossings_around_face(regions_, polygon, i) != 2)
      return false;
  return true;
}

/// How many cubes were split. What is known of polygons next to them is forgotten.
std::size_t RegionProof::split() {
  std::vector<std::uint32_t> splits(cells_.size());
  std::vector<BlockMask> fresh(cells_.size());
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    if (!std::exchange(any_bold_[b], 0)) return;
    const auto block = static_cast<std::int32_t>(b);
    std::vector<Region>& here = split_.local();
    here.clear();
    regions_.for_each(
        block,
        [&](const Region& cube) {
          if (std::exchange(bold_[regions_.number(cube)], 0)) here.push_back(cube);
        },
        [](int) {});
    for (const Region& cube : here) {
      regions_.split(cube);
      for (int x = 0; x < cube.side(); ++x)
        fresh[b][static_cast<std::size_t>((cube.cell >> 6) + x)] |= rows_of(cube);
    }
    splits[b] = static_cast<std::uint32_t>(here.size());
  });
  const std::size_t all = std::reduce(splits.begin(), splits.end(), std::size_t{0});
  if (all == 0) return 0;
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    const auto& neighbours = cells_.source(static_cast<std::int32_t>(b)).neighbours;
    if (std::ranges::none_of(neighbours, [&](std::int32_t there) {
          return there >= 0 && splits[static_cast<std::size_t>(there)] > 0;
        }))
      return;
    const BlockMask stirred = widened<1>([&](int ax, int ay, int az) -> const BlockMask* {
      const std::int32_t there = neighbours[static_cast<std::size_t>(neighbour_slot(ax, ay, az))];
      return there < 0 ? nullptr : &fresh[static_cast<std::size_t>(there)];
    });
    const std::array<BlockMask, 3> edges = regions_.outer_edges(static_cast<std::int32_t>(b));
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t word = 0; word < 8; ++word) open_[b][axis][word] |= edges[axis][word] & stirred[word];
  });
  return all;
}

}  // namespace hermesh
