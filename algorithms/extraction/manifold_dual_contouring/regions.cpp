#include "algorithms/extraction/manifold_dual_contouring/regions.h"

#include <tbb/enumerable_thread_specific.h>

#include <bit>
#include <utility>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Each bit one cell on along an axis; what comes in is of the block below there.
BlockMask moved_up(const BlockMask& mask, const BlockMask& below, int axis) {
  BlockMask result;
  for (std::size_t x = 0; x < 8; ++x) {
    constexpr std::uint64_t kLast = 0x8080808080808080u;
    result[x] = axis == 0   ? (x == 0 ? below[7] : mask[x - 1])
                : axis == 1 ? (mask[x] << 8 | below[x] >> 56)
                            : ((mask[x] & ~kLast) << 1 | (below[x] & kLast) >> 7);
  }
  return result;
}

}  // namespace

Regions::Regions(const CellBlocks& cells, const std::vector<Vector3d>& points, const RegionOptions& options,
                 const FilePoints& file, RunContext& context)
    : cells_(cells), points_(points), options_(options), file_(file), blocks_(cells.size()) {
  Stage stage(context, "propose regions");
  tbb::enumerable_thread_specific<RegionProposals> proposals(
      [&] { return RegionProposals(cells, options, file); });
  std::vector<ProposedCube> whole(cells.size());
  parallel_blocks(cells.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    if (!any(cells[block].active)) return;
    if (proposals.local().propose_whole(block, whole[b]))
      blocks_[b].proposed[kLevels - 1] = blocks_[b].alive[kLevels - 1] = 1;
    else
      blocks_[b].wants_parts = true;
    find_merged(blocks_[b]);
  });
  for (std::size_t b = 0; b < cells.size(); ++b) {
    if (blocks_[b].alive[kLevels - 1] == 0) continue;
    blocks_[b].first_cube[kLevels - 1] = static_cast<std::uint32_t>(cubes_.size());
    cubes_.push_back(whole[b]);
  }
  propose_parts(context);
}

void Regions::propose_parts(RunContext& context) {
  tbb::enumerable_thread_specific<RegionProposals> proposals(
      [&] { return RegionProposals(cells_, options_, file_); });
  std::vector<std::size_t> asked;
  for (std::size_t b = 0; b < blocks_.size(); ++b)
    if (std::exchange(blocks_[b].wants_parts, false)) asked.push_back(b);
  std::vector<std::vector<ProposedCube>> cubes(asked.size());
  parallel_blocks(asked.size(), context, [&](std::size_t i) {
    BlockRegions& block = blocks_[asked[i]];
    std::array<std::uint64_t, 2> parts{};
    proposals.local().propose_parts(static_cast<std::int32_t>(asked[i]), parts, cubes[i]);
    for (std::size_t level = 0; level < parts.size(); ++level)
      block.proposed[level] = block.alive[level] = parts[level];
    find_merged(block);
  });
  for (std::size_t i = 0; i < asked.size(); ++i) {
    BlockRegions& block = blocks_[asked[i]];
    block.first_cube[0] = static_cast<std::uint32_t>(cubes_.size());
    block.first_cube[1] = block.first_cube[0] + static_cast<std::uint32_t>(bits_in(block.proposed[0]));
    cubes_.insert(cubes_.end(), cubes[i].begin(), cubes[i].end());
  }
  check_indices(cubes_.size(), "regions");
}

void Regions::find_merged(BlockRegions& block) {
  block.merged = {};
  for (int level = 1; level <= kLevels; ++level) {
    const BlockMask cells = cells_of(block.alive[static_cast<std::size_t>(level - 1)], level);
    for (std::size_t x = 0; x < 8; ++x) block.merged[x] |= cells[x];
  }
}

void Regions::split(const Region& region) {
  BlockRegions& block = blocks_[static_cast<std::size_t>(region.block)];
  block.alive[region.level - 1u] &= ~(std::uint64_t{1} << cube_of(region.cell, region.level));
  if (region.level == kLevels) block.wants_parts = true;
  find_merged(block);
}

/// By axis the cells whose lower face there is within a cube.
std::array<BlockMask, 3> Regions::inner_faces(std::int32_t block) const {
  const BlockRegions& own = blocks_[static_cast<std::size_t>(block)];
  std::array<BlockMask, 3> result{};
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

std::array<BlockMask, 3> Regions::merged_edges(std::int32_t block) const {
  const auto& neighbours = cells_.source(block).neighbours;
  const std::array<BlockMask, 3> inner = inner_faces(block);
  std::array<std::array<BlockMask, 3>, 3> before;  // by axis of the step, of inner faces
  for (int axis = 0; axis < 3; ++axis) {
    const int step[3] = {-(axis == 0), -(axis == 1), -(axis == 2)};
    const std::int32_t there =
        neighbours[static_cast<std::size_t>(neighbour_slot(step[0], step[1], step[2]))];
    const auto beyond = there < 0 ? std::array<BlockMask, 3>{} : inner_faces(there);
    for (std::size_t a = 0; a < 3; ++a)
      before[static_cast<std::size_t>(axis)][a] = moved_up(inner[a], beyond[a], axis);
  }
  std::array<BlockMask, 3> result = lone_edges(block);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (std::size_t word = 0; word < 8; ++word) {
      const std::uint64_t one_across_u = inner[u][word] & before[v][u][word],
                          one_across_v = inner[v][word] & before[u][v][word];
      result[axis][word] =
          cells_.source(block).crossing[axis][word] & ~result[axis][word] & ~one_across_u & ~one_across_v;
    }
  }
  return result;
}

std::array<BlockMask, 3> Regions::lone_edges(std::int32_t block) const {
  const auto& neighbours = cells_.source(block).neighbours;
  constexpr BlockMask kNone{};
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

Vector3d Regions::normal(const Region& region) const {
  if (region.merged()) return cubes_[number(region)].normal.cast<double>();
  Vector3d sum = Vector3d::Zero();
  const int signs = cells_.corner_signs(cells_.cell_number(region.block, region.cell));  // Hermite data have no joints
  for (unsigned edges = kCrossedEdges[static_cast<std::size_t>(signs)]; edges != 0; edges &= edges - 1) {
    const CellBlocks::Edge at = cells_.edge_of_cell(region.block, region.cell, std::countr_zero(edges));
    const auto n = cells_.grid().crossing(at.block, at.sample, at.axis).normal;
    sum += Vector3d(n[0], n[1], n[2]);
  }
  return sum.normalized();
}

}  // namespace hermesh
