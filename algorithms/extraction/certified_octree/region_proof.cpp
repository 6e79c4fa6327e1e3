#include "algorithms/extraction/certified_octree/region_proof.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <utility>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

/// Adds the cells of a cube to a mask of its block.
void add(BlockMask& mask, const Region& region) {
  for (int x = 0; x < region.side(); ++x)
    mask[(region.cell >> 6) + x] |= rows_of(region.cell, region.side(), 0, 0);
}

bool overlap(const BlockMask& mask, const Region& region) {
  for (int x = 0; x < region.side(); ++x)
    if (mask[(region.cell >> 6) + x] & rows_of(region.cell, region.side(), 0, 0)) return true;
  return false;
}

bool any_of(const std::array<BlockMask, 3>& edges) { return any(edges[0]) || any(edges[1]) || any(edges[2]); }

}  // namespace

RegionProof::RegionProof(CellRegions& regions, RegionLayers* layers, const RegionShell* shell,
                         UniformCells* uniform, RunContext& context)
    : regions_(regions),
      cells_(regions.cells()),
      layers_(layers),
      shell_(shell),
      uniform_(uniform),
      context_(context),
      unproven_(cells_.size()),
      any_unproven_(cells_.size()),
      changed_(filled(cells_.size(), kAllInside, context)),
      split_cells_(filled(cells_.size(), kAllInside, context)),
      dirty_(filled(cells_.size(), kAllInside, context)),
      open_(shell ? cells_.size() : 0),
      loose_(layers ? cells_.size() : 0) {
  if (!layers && !shell) return;
  for (std::size_t b = 0; b < cells_.size(); ++b) {
    const auto& lower = cells_.source(b).lower;
    turns_[((lower[0] >> 3) & 1) << 2 | ((lower[1] >> 3) & 1) << 1 | ((lower[2] >> 3) & 1)].push_back(
        static_cast<std::uint32_t>(b));
  }
}

std::size_t RegionProof::run() {
  Stage stage(context_, "prove regions");
  std::size_t splits = std::exchange(is_new_, false) ? 0 : split();
  // Each round splits at least one cube, until no polygon fails; at worst all cells are single and T is S.
  for (;;) {
    if (uniform_) place_lone_points();
    if (!layers_ && !shell_) return splits;
    if (layers_) begin_layers();
    // The polygons of a block have cubes in that block and those next to it, which no two blocks of one turn
    // share: so the cubes that are split do not depend on the thread schedule.
    for (const std::vector<std::uint32_t>& turn : turns_)
      parallel_blocks(turn.size(), context_, [&](std::size_t i) { look_at_polygons(turn[i]); });
    if (layers_) look_at_layers();
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
    // Elsewhere no cell has become single since the last call.
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

/// Begins the layers of new cubes. Those next to them keep theirs, which still include replaced polygons:
/// they are thicker than necessary, but less is recomputed.
void RegionProof::begin_layers() {
  layers_->make_room();
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    for_each_touched(b, [&](const Region& cube) {
      if (overlap(split_cells_[b], cube)) layers_->begin(cube);
    });
  });
}

/// Tests the polygons of a block: new ones, those not proved before, and loose ones that may touch new cubes.
void RegionProof::look_at_polygons(std::size_t b) {
  const auto block = static_cast<std::int32_t>(b);
  const bool is_dirty = any(dirty_[b]);
  const bool may_touch = layers_ && any_of(loose_[b]) &&
                         std::ranges::any_of(cells_.source(block).neighbours, [&](std::int32_t there) {
                           return there >= 0 && any(split_cells_[there]);
                         });
  const bool is_open = shell_ && any_of(open_[b]);
  if (!is_dirty && !may_touch && !is_open) return;
  const std::array<BlockMask, 3> edges = regions_.merged_edges(block);
  for (int a = 0; a < 3; ++a) {
    BlockMask looked_at;
    for (std::size_t word = 0; word < 8; ++word) {
      // With layers no polygon is open: the cubes are tested after all polygons were added.
      looked_at[word] = edges[a][word] & (dirty_[b][word] | (shell_ ? open_[b][a][word] : 0));
      if (layers_) loose_[b][a][word] &= edges[a][word] & ~looked_at[word];
    }
    // A loose polygon may extend into any cube nearby, so it is added again for new ones; this does not
    // change the layers of others.
    if (layers_)
      for_each_bit(loose_[b][a], [&](int sample) {
        const CellBlocks::Edge edge{block, sample, a};
        layers_->add(polygon_of(regions_, edge, ring_of(regions_, edge)));
      });
    if (shell_) open_[b][a] = {};
    for_each_bit(looked_at, [&](int sample) {
      const CellBlocks::Edge edge{block, sample, a};
      const RegionRing ring = ring_of(regions_, edge);
      // A polygon of a cube that is split anyway stays open, and disappears in the next round. Layers require
      // all polygons, in any order.
      if (shell_ && std::any_of(ring.regions.begin(), ring.regions.begin() + ring.corners,
                                [&](const Region& region) { return region.merged() && is_unproven(region); }))
        return set_bit(open_[b][a], sample);
      const RegionPolygon polygon = polygon_of(regions_, edge, ring);
      if (layers_) {
        layers_->add(polygon);
        if (polygon.loose) set_bit(loose_[b][a], sample);
      }
      // With layers, a polygon in its envelope is proved by those of its cubes.
      if (shell_ ? shell_->holds(polygon) : !polygon.loose || layers_->holds(polygon)) return;
      call_unproven(ring.largest());
      if (shell_) set_bit(open_[b][a], sample);
    });
  }
}

/// Tests each cube whose polygons may have changed, after all of these have been added.
void RegionProof::look_at_layers() {
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    for_each_touched(b, [&](const Region& cube) {
      if (!layers_->holds(cube)) call_unproven(cube);
    });
  });
}

void RegionProof::call_unproven(const CellBlocks::Edge& edge) {
  call_unproven(ring_of(regions_, edge).largest());
}

void RegionProof::call_unproven(const Region& cube) {
  // Concurrently, bits are only set; split() reads them afterwards.
  std::atomic_ref(any_unproven_[cube.block]).store(1, std::memory_order_relaxed);
  std::atomic_ref(unproven_[cube.block][cube.level - 1u])
      .fetch_or(std::uint64_t{1} << cube_of(cube.cell, cube.level), std::memory_order_relaxed);
}

bool RegionProof::is_unproven(const Region& cube) {
  const auto bits = std::atomic_ref(unproven_[cube.block][cube.level - 1u]).load(std::memory_order_relaxed);
  return (bits >> cube_of(cube.cell, cube.level)) & 1;
}

/// Splits the unproven cubes, proposes smaller ones instead, and marks the changed cells. Returns the number
/// of cubes split.
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
  const std::size_t all = std::reduce(splits.begin(), splits.end(), std::size_t{0});
  if (all == 0) return 0;
  regions_.propose_parts(context_);
  parallel_blocks(cells_.size(), context_, [&](std::size_t b) {
    const auto& neighbours = cells_.source(b).neighbours;
    dirty_[b] = {};
    if (std::ranges::none_of(neighbours, [&](std::int32_t there) { return there >= 0 && splits[there] > 0; }))
      return;
    // A changed polygon has a changed region around its edge, which starts in a split cube or next to it.
    dirty_[b] = widened<1>([&](int x, int y, int z) -> const BlockMask* {
      const std::int32_t there = neighbours[neighbour_slot(x, y, z)];
      return there < 0 ? nullptr : &split_cells_[there];
    });
    for (std::size_t word = 0; word < 8; ++word) changed_[b][word] |= dirty_[b][word];
  });
  return all;
}

}  // namespace hermesh
