#include "algorithms/extraction/certified_octree/region_proof.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_octree/region_cubes.h"
#include "algorithms/extraction/certified_octree/widened_mask.h"

namespace hermesh {
namespace {

constexpr BlockMask kAllCells = [] {
  BlockMask mask;
  mask.fill(~std::uint64_t{0});
  return mask;
}();

/// Adds a cube's cells to a mask of its block.
void add(BlockMask& mask, const Region& region) {
  for (int x = 0; x < region.side(); ++x)
    mask[static_cast<std::size_t>((region.cell >> 6) + x)] |= rows_of(region.cell, region.side(), 0, 0);
}

bool overlap(const BlockMask& mask, const Region& region) {
  for (int x = 0; x < region.side(); ++x)
    if (mask[static_cast<std::size_t>((region.cell >> 6) + x)] & rows_of(region.cell, region.side(), 0, 0))
      return true;
  return false;
}

}  // namespace

RegionProof::RegionProof(CellRegions& regions, UniformCells& uniform, RunContext& context)
    : RegionProof(regions, nullptr, nullptr, &uniform, context) {}

RegionProof::RegionProof(CellRegions& regions, RegionSlabs& slabs, UniformCells& uniform, RunContext& context)
    : RegionProof(regions, &slabs, nullptr, &uniform, context) {}

RegionProof::RegionProof(CellRegions& regions, const RegionShell& shell, RunContext& context)
    : RegionProof(regions, nullptr, &shell, nullptr, context) {}

RegionProof::RegionProof(CellRegions& regions, RegionSlabs* slabs, const RegionShell* shell,
                         UniformCells* uniform, RunContext& context)
    : regions_(regions),
      cells_(regions.cells()),
      slabs_(slabs),
      shell_(shell),
      uniform_(uniform),
      context_(context),
      unproven_(cells_.size()),
      any_unproven_(cells_.size()),
      changed_(filled(cells_.size(), kAllCells, context)),
      split_cells_(filled(cells_.size(), kAllCells, context)),
      dirty_(filled(cells_.size(), kAllCells, context)),
      open_(shell ? cells_.size() : 0),
      loose_(slabs ? cells_.size() : 0) {
  // Nothing is looked at then, so no turns are needed.
  if (!slabs && !shell) return;
  for (std::size_t b = 0; b < cells_.size(); ++b) {
    const auto& lower = cells_.source(static_cast<std::int32_t>(b)).lower;
    turns_[static_cast<std::size_t>(((lower[0] >> 3) & 1) << 2 | ((lower[1] >> 3) & 1) << 1 |
                                    ((lower[2] >> 3) & 1))]
        .push_back(static_cast<std::uint32_t>(b));
  }
}

std::size_t RegionProof::run() {
  Stage stage(context_, "prove regions");
  std::size_t splits = std::exchange(is_new_, false) ? 0 : split();  // what was called unproven meanwhile
  // Each round splits a cube at least, until no polygon fails; at worst all cells are alone and T is S.
  for (;;) {
    // Cells that are alone have points in polygons of T; they are made as cubes fall apart.
    if (uniform_) place_lone_points();
    if (!slabs_ && !shell_) return splits;
    if (slabs_) begin_slabs();
    look_at_polygons();
    if (slabs_) look_at_slabs();
    const std::size_t now = split();
    if (now == 0) return splits;
    splits += now;
  }
}

LargeArray<BlockMask> RegionProof::take_changed() {
  return std::exchange(changed_, filled(cells_.size(), BlockMask{}, context_));
}

void RegionProof::place_lone_points() {
  LargeArray<BlockMask> alone(cells_.size());
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    // Elsewhere no cell has become alone since the last time.
    alone[b] = any(split_cells_[b]) ? regions_.alone(static_cast<std::int32_t>(b)) : BlockMask{};
  });
  uniform_->place(alone, context_);
}

/// Calls f(cube) for the cubes of a block that may have new polygons.
template <class F>
void RegionProof::for_each_touched(std::size_t b, F&& f) const {
  if (!any(dirty_[b])) return;
  regions_.for_each_cube(static_cast<std::int32_t>(b), [&](const Region& cube) {
    if (overlap(dirty_[b], cube)) f(cube);
  });
}

/// Begins the slabs of new cubes. The cubes beside them keep theirs, which still tell of polygons that are
/// gone: they are wider than need be, but less is done anew.
void RegionProof::begin_slabs() {
  slabs_->make_room();
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    for_each_touched(b, [&](const Region& cube) {
      if (overlap(split_cells_[b], cube)) slabs_->begin(cube);
    });
  });
}

void RegionProof::look_at_polygons() {
  // A cube has polygons in its own block and those next to it, and of these no two in one turn: what is
  // split does not depend on threads.
  for (const std::vector<std::uint32_t>& turn : turns_)
    parallel_blocks(turn.size(), context_, [&](std::size_t i) { look_at_polygons(turn[i]); });
}

/// Looks at the polygons of a block: new ones, those not shown before, and loose ones that may touch new
/// cubes.
void RegionProof::look_at_polygons(std::size_t b) {
  const auto block = static_cast<std::int32_t>(b);
  const bool is_dirty = any(dirty_[b]);
  const bool may_touch = slabs_ && (any(loose_[b][0]) || any(loose_[b][1]) || any(loose_[b][2])) &&
                         std::ranges::any_of(cells_.source(block).neighbours, [&](std::int32_t there) {
                           return there >= 0 && any(split_cells_[static_cast<std::size_t>(there)]);
                         });
  const bool is_open = shell_ && (any(open_[b][0]) || any(open_[b][1]) || any(open_[b][2]));
  if (!is_dirty && !may_touch && !is_open) return;
  const std::array<BlockMask, 3> edges = regions_.merged_edges(block);
  for (int axis = 0; axis < 3; ++axis) {
    const auto a = static_cast<std::size_t>(axis);
    BlockMask looked_at;
    for (std::size_t word = 0; word < 8; ++word) {
      // With slabs a polygon is never open: it is the cubes that are asked, once all polygons are in.
      looked_at[word] = edges[a][word] & (dirty_[b][word] | (shell_ ? open_[b][a][word] : 0));
      if (slabs_) loose_[b][a][word] &= edges[a][word] & ~looked_at[word];
    }
    // A loose polygon may reach into any cube near it, so it is added again where new ones have been begun;
    // to widen the slabs of others once more changes nothing.
    if (slabs_)
      for_each_bit(loose_[b][a], [&](int sample) {
        const CellBlocks::Edge edge{block, sample, axis};
        slabs_->add(polygon_of(regions_, edge, ring_of(regions_, edge)));
      });
    if (shell_) open_[b][a] = {};
    for_each_bit(looked_at, [&](int sample) {
      const CellBlocks::Edge edge{block, sample, axis};
      const auto set = [&](BlockMask& mask) {
        mask[static_cast<std::size_t>(sample >> 6)] |= std::uint64_t{1} << (sample & 63);
      };
      const RegionRing ring = ring_of(regions_, edge);
      // A polygon of a cube that is split anyway is gone in the next round, and stays open. Slabs want all
      // polygons, and in any order.
      if (shell_ && std::any_of(ring.regions.begin(), ring.regions.begin() + ring.corners,
                                [&](const Region& region) { return region.merged() && is_unproven(region); }))
        return set(open_[b][a]);
      const RegionPolygon polygon = polygon_of(regions_, edge, ring);
      if (slabs_) {
        slabs_->add(polygon);
        if (polygon.loose) set(loose_[b][a]);
      }
      // Kept to its envelope, a polygon needs nothing with slabs but that its cubes' slabs hold.
      if (shell_ ? shell_->holds(polygon) : !polygon.loose || slabs_->holds(polygon)) return;
      call_unproven(ring.largest());
      if (shell_) set(open_[b][a]);
    });
  }
}

/// Asks each cube whose polygons may have changed, once all of these have been added.
void RegionProof::look_at_slabs() {
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    for_each_touched(b, [&](const Region& cube) {
      if (!slabs_->holds(cube)) call_unproven(cube);
    });
  });
}

void RegionProof::call_unproven(const CellBlocks::Edge& edge) {
  call_unproven(ring_of(regions_, edge).largest());
}

void RegionProof::call_unproven(const Region& cube) {
  // Bits that are only ever set while others look; split() reads them when all are done.
  std::atomic_ref(any_unproven_[static_cast<std::size_t>(cube.block)]).store(1, std::memory_order_relaxed);
  std::atomic_ref(unproven_[static_cast<std::size_t>(cube.block)][cube.level - 1u])
      .fetch_or(std::uint64_t{1} << cube_of(cube.cell, cube.level), std::memory_order_relaxed);
}

bool RegionProof::is_unproven(const Region& cube) {
  const auto bits = std::atomic_ref(unproven_[static_cast<std::size_t>(cube.block)][cube.level - 1u])
                        .load(std::memory_order_relaxed);
  return (bits >> cube_of(cube.cell, cube.level)) & 1;
}

/// Splits the cubes that were called unproven, proposes smaller ones in their place, and marks what has
/// changed. Returns how many cubes were split.
std::size_t RegionProof::split() {
  std::vector<std::uint32_t> splits(cells_.size());
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    split_cells_[b] = {};
    if (!std::exchange(any_unproven_[b], 0)) return;
    const auto block = static_cast<std::int32_t>(b);
    std::vector<Region>& here = split_.local();
    here.clear();
    regions_.for_each_cube(block, [&](const Region& cube) {
      if (is_unproven(cube)) here.push_back(cube);
    });
    unproven_[b] = {};
    for (const Region& cube : here) {
      regions_.split(cube);
      add(split_cells_[b], cube);
    }
    splits[b] = static_cast<std::uint32_t>(here.size());
  });
  // Smaller cubes are proposed for all blocks at once, when no block is splitting any more.
  const std::size_t all = std::reduce(splits.begin(), splits.end(), std::size_t{0});
  if (all == 0) return 0;
  regions_.propose_parts(context_);
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    const auto& neighbours = cells_.source(static_cast<std::int32_t>(b)).neighbours;
    dirty_[b] = {};
    if (std::ranges::none_of(neighbours, [&](std::int32_t there) {
          return there >= 0 && splits[static_cast<std::size_t>(there)] > 0;
        }))
      return;
    // A polygon has changed if a region around its edge has: its edge starts in one of the split cubes or
    // next to it.
    dirty_[b] = widened<1>([&](int x, int y, int z) -> const BlockMask* {
      const std::int32_t there = neighbours[static_cast<std::size_t>(neighbour_slot(x, y, z))];
      return there < 0 ? nullptr : &split_cells_[static_cast<std::size_t>(there)];
    });
    for (std::size_t word = 0; word < 8; ++word) changed_[b][word] |= dirty_[b][word];
  });
  return all;
}

}  // namespace hermesh
