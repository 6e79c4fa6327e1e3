#include "algorithms/extraction/certified_octree/cell_regions.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <bit>
#include <utility>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// A mask with each bit one cell on along an axis; what comes in is of the block below there.
BlockMask moved_up(const BlockMask& mask, const BlockMask& below, int axis) {
  BlockMask result;
  for (std::size_t x = 0; x < 8; ++x) {
    result[x] = axis == 0   ? (x == 0 ? below[7] : mask[x - 1])
                : axis == 1 ? (mask[x] << 8 | below[x] >> 56)
                            : ((mask[x] & ~kLastZ) << 1 | (below[x] & kLastZ) >> 7);
  }
  return result;
}

}  // namespace

CellRegions::CellRegions(const CellBlocks& cells, const UniformPoints& points, const RegionOptions& options,
                         const FilePoints& file, RunContext& context)
    : cells_(cells), points_(points), options_(options), file_(file), blocks_(cells.size()) {
  Stage stage(context, "propose regions");
  // The largest cubes are asked for in every block that the surface passes through; what is no such cube is
  // tried in parts. (The thesis, §6.4, begins with the smallest regions and merges upwards.)
  const int level = std::countr_zero(static_cast<unsigned>(options.largest_cube));
  const std::uint64_t all = ~std::uint64_t{0} >> (64 - (512 >> (3 * level)));
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    blocks_[b] = {};
    if (any(cells[static_cast<std::int32_t>(b)].active))
      blocks_[b].asked[static_cast<std::size_t>(level - 1)] = all;
  });
  propose_parts(context);
}

void CellRegions::propose_parts(RunContext& context) {
  tbb::enumerable_thread_specific<RegionProposals> proposals(
      [&] { return RegionProposals(cells_, options_, file_); });
  // Count, scan, fill: blocks propose by themselves, and numbers are given in the order of blocks.
  std::vector<std::size_t> asked;
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    if (std::ranges::any_of(blocks_[b].asked, [](std::uint64_t cubes) { return cubes != 0; }))
      asked.push_back(b);
  std::vector<std::vector<ProposedCube>> found(asked.size());
  std::vector<std::array<std::uint64_t, kLevels>> before(asked.size());  // proposed
  parallel_blocks(asked.size(), context, [&](std::size_t i) {
    before[i] = blocks_[asked[i]].proposed;
    propose(proposals.local(), static_cast<std::int32_t>(asked[i]), blocks_[asked[i]], found[i]);
  });
  const auto added_to = [&](std::size_t i) {
    std::array<std::uint64_t, kLevels> added;
    for (std::size_t at = 0; at < added.size(); ++at)
      added[at] = blocks_[asked[i]].proposed[at] & ~before[i][at];
    return added;
  };
  // Numbers are for good: others keep them as names of corners. All 4³ and 8³ cubes that a block ever has of
  // one level are proposed together, and so are the 2³ of one 4³; so a first number and a count of bits give
  // each cube's (number()).
  std::size_t cubes = cubes_.size();
  for (std::size_t i = 0; i < asked.size(); ++i) {
    BlockRegions& block = blocks_[asked[i]];
    const std::array<std::uint64_t, kLevels> added = added_to(i);
    auto next = static_cast<std::uint32_t>(cubes);
    const auto number_from = [&](std::uint32_t& first, std::uint64_t some) {
      // A first number that was given earlier must stay: cubes are counted from it.
      if (some == 0) return;
      first = next;
      next += static_cast<std::uint32_t>(std::popcount(some));
    };
    for (std::size_t at = 1; at < added.size(); ++at) number_from(block.first_cube[at - 1], added[at]);
    for (int larger = 0; larger < 8; ++larger)
      number_from(block.first_part[static_cast<std::size_t>(larger)], added[0] & parts_of(larger, 2));
    cubes += found[i].size();
  }
  check_indices(cubes, "regions");
  cubes_.resize(cubes);
  parallel_blocks(asked.size(), context, [&](std::size_t i) {
    const std::array<std::uint64_t, kLevels> added = added_to(i);
    const std::vector<ProposedCube> own = std::move(found[i]);  // freed here, in parallel
    // In the order in which propose() has found them.
    const ProposedCube* cube = own.data();
    for (int level = kLevels; level > 0; --level)
      for (std::uint64_t left = added[static_cast<std::size_t>(level - 1)]; left != 0; left &= left - 1)
        cubes_[number(region_of(static_cast<std::int32_t>(asked[i]), std::countr_zero(left), level))] =
            *cube++;
  });
}

// Larger cubes first: what is asked for and does not pass is asked for in parts, at the next finer level, in
// the same call.
void CellRegions::propose(RegionProposals& proposals, std::int32_t number, BlockRegions& block,
                          std::vector<ProposedCube>& found) {
  for (int level = kLevels; level > 0; --level) {
    const auto at = static_cast<std::size_t>(level - 1);
    std::uint64_t asked = std::exchange(block.asked[at], 0);
    if (asked == 0) continue;
    // What passes is alive until it is split; what does not is asked for in eight parts.
    const std::uint64_t proposed = proposals.propose(number, level, asked, found);
    block.proposed[at] |= proposed;
    block.alive[at] |= proposed;
    asked &= ~proposed;
    if (level > 1)
      for (; asked != 0; asked &= asked - 1) block.asked[at - 1] |= parts_of(std::countr_zero(asked), level);
  }
  find_merged(block);
}

void CellRegions::find_merged(BlockRegions& block) {
  // From scratch, a few dozen operations on words.
  block.merged = {};
  for (int level = 1; level <= kLevels; ++level) {
    const BlockMask cells = cells_of(block.alive[static_cast<std::size_t>(level - 1)], level);
    for (std::size_t x = 0; x < 8; ++x) block.merged[x] |= cells[x];
  }
}

void CellRegions::split(const Region& region) {
  BlockRegions& block = blocks_[static_cast<std::size_t>(region.block)];
  const int cube = cube_of(region.cell, region.level);
  // `proposed` keeps the bit, for numbers of the others are counted by it.
  block.alive[region.level - 1u] &= ~(std::uint64_t{1} << cube);
  if (region.level > 1) block.asked[region.level - 2u] |= parts_of(cube, region.level);
  find_merged(block);
}

/// The cells whose lower face along each axis is within a cube, as masks by axis.
std::array<BlockMask, 3> CellRegions::inner_faces(std::int32_t block) const {
  const BlockRegions& own = blocks_[static_cast<std::size_t>(block)];
  std::array<BlockMask, 3> result{};
  // A block that is one cube has no others.
  for (int level = own.alive[kLevels - 1] ? kLevels : 1; level <= kLevels; ++level) {
    const BlockMask cells = cells_of(own.alive[static_cast<std::size_t>(level - 1)], level);
    const std::size_t side = std::size_t{1} << level;
    for (std::size_t x = 0; x < 8; ++x) {
      if (x % side != 0) result[0][x] |= cells[x];
      result[1][x] |= cells[x] & ~first_rows(level);
      result[2][x] |= cells[x] & ~first_columns(level);
    }
  }
  return result;
}

std::array<BlockMask, 3> CellRegions::merged_edges(std::int32_t block,
                                                   const std::array<BlockMask, 3>& lone) const {
  const auto& neighbours = cells_.source(block).neighbours;
  const std::array<BlockMask, 3> inner = inner_faces(block);
  // Four cells are around an edge: its own, the one below along u, the one below along v, and the one below
  // along both. If both pairs across u are within cubes, or both across v, there are at most two regions.
  std::array<std::array<BlockMask, 3>, 3> before;  // by axis of the step, of inner faces
  for (int axis = 0; axis < 3; ++axis) {
    const int step[3] = {-(axis == 0), -(axis == 1), -(axis == 2)};
    const std::int32_t there =
        neighbours[static_cast<std::size_t>(neighbour_slot(step[0], step[1], step[2]))];
    const auto beyond = there < 0 ? std::array<BlockMask, 3>{} : inner_faces(there);
    for (std::size_t a = 0; a < 3; ++a)
      before[static_cast<std::size_t>(axis)][a] = moved_up(inner[a], beyond[a], axis);
  }
  std::array<BlockMask, 3> result;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (std::size_t word = 0; word < 8; ++word) {
      const std::uint64_t one_across_u = inner[u][word] & before[v][u][word],
                          one_across_v = inner[v][word] & before[u][v][word];
      result[axis][word] =
          cells_.source(block).crossing[axis][word] & ~lone[axis][word] & ~one_across_u & ~one_across_v;
    }
  }
  return result;
}

std::array<BlockMask, 3> CellRegions::lone_edges(std::int32_t block) const {
  const auto& neighbours = cells_.source(block).neighbours;
  constexpr BlockMask kNone{};
  // An edge is lone if none of the four cells around it is part of a cube. Blocks that are not there have no
  // cells.
  std::array<const BlockMask*, 8> at;  // in blocks below along the axes whose bits are set
  for (int below = 0; below < 8; ++below) {
    const std::int32_t there = neighbours[static_cast<std::size_t>(
        neighbour_slot(-(below & 1), -((below >> 1) & 1), -(below >> 2)))];
    at[static_cast<std::size_t>(below)] = there < 0 ? &kNone : &merged(there);
  }
  std::array<BlockMask, 3> result = cells_.source(block).crossing;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const BlockMask below_v = moved_up(*at[0], *at[1u << v], v), below_u = moved_up(*at[0], *at[1u << u], u),
                    beyond = moved_up(*at[1u << u], *at[1u << u | 1u << v], v),
                    below_both = moved_up(below_v, beyond, u);
    for (std::size_t word = 0; word < 8; ++word)
      result[static_cast<std::size_t>(axis)][word] &=
          ~((*at[0])[word] | below_u[word] | below_v[word] | below_both[word]);
  }
  return result;
}

Vector3d CellRegions::normal(const Region& region) const {
  if (region.merged()) return cubes_[number(region)].normal.cast<double>();
  Vector3d sum = Vector3d::Zero();
  const int signs =
      cells_.corner_code(cells_.cell_number(region.block, region.cell));  // Hermite data have no joints
  for (unsigned edges = kCrossedEdges[static_cast<std::size_t>(signs)]; edges != 0; edges &= edges - 1) {
    const CellBlocks::Edge at = cells_.edge_of_cell(region.block, region.cell, std::countr_zero(edges));
    const auto n = cells_.grid().crossing(at.block, at.sample, at.axis).normal;
    // Of unit length, or zero in data without normals, which add nothing.
    sum += Vector3d(n[0], n[1], n[2]);
  }
  return sum.normalized();
}

}  // namespace hermesh
