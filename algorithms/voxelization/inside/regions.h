// Connected regions of voxels: two neighbours are connected if no triangle intersects the grid edge between
// them, and all space outside of the blocks is connected. Needs neither normals nor a closed mesh. (Aldén
// 2011, §5.3, floods similarly, along the shell of the surface.)
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/lattice/block_mask.h"
#include "algorithms/lattice/block_table.h"
#include "algorithms/voxelization/distance/kernels/kernels.h"

namespace hermesh {

class RunContext;

// ---- Bits of the voxels of one block.

/// Coordinates of a voxel, or of the cell whose lowest corner it is.
using Voxel = std::array<std::int32_t, 3>;

/// Returns the coordinates of a block's voxel from its index in the block.
inline Voxel voxel_in(const BlockAt& block, int index) {
  return {block[0] * 8 + (index >> 6), block[1] * 8 + (index >> 3 & 7), block[2] * 8 + (index & 7)};
}

inline BlockMask operator&(BlockMask a, const BlockMask& b) {
  for (std::size_t x = 0; x < 8; ++x) a[x] &= b[x];
  return a;
}
inline BlockMask operator~(BlockMask a) {
  for (std::uint64_t& word : a) word = ~word;
  return a;
}
inline BlockMask& operator|=(BlockMask& a, const BlockMask& b) {
  for (std::size_t x = 0; x < 8; ++x) a[x] |= b[x];
  return a;
}
inline void set_bit(BlockMask& bits, unsigned voxel) { bits[voxel >> 6] |= std::uint64_t(1) << (voxel & 63); }

/// Returns the bits of a block's voxels in the box between two voxels, both included.
BlockMask box_bits(const BlockAt& block, const Voxel& from, const Voxel& to);

/// Calls f(block) for the blocks that overlap the box between two voxels.
template <class F>
void for_each_block_in(const Voxel& from, const Voxel& to, F&& f) {
  const BlockAt low = tile_of(from), high = tile_of(to);
  for (std::int32_t x = low[0]; x <= high[0]; ++x)
    for (std::int32_t y = low[1]; y <= high[1]; ++y)
      for (std::int32_t z = low[2]; z <= high[2]; ++z) f(BlockAt{x, y, z});
}

/// Returns for each voxel the bit of its upper neighbour along the axis; `upper` has the bits of the next
/// block.
BlockMask upper_neighbours(const BlockMask& bits, const BlockMask& upper, int axis);

/// Returns the bits of the 64 voxels on one side of a block, 0 lower and 1 upper, in the order of the two
/// other axes.
std::uint64_t face(const BlockMask& bits, int axis, int side);

// ---- Regions.

/// Voxels of one block that are connected within it.
struct BlockComponent {
  BlockMask voxels;
  std::uint32_t region;
};

/// The components of all blocks, and the regions that they belong to.
struct Regions {
  /// Number of the region that reaches infinity.
  static constexpr std::uint32_t kOutside = 0;
  /// Components of block i: components[first[i]] … components[first[i + 1] − 1].
  std::vector<std::uint32_t> first;
  std::vector<BlockComponent> components;
  std::uint32_t count = 0;  ///< of regions; numbered in the order of their first component
};

/// Returns the voxels of each block that are in a region for which is_in(region) returns true.
template <class F>
std::vector<BlockMask> voxels_of(const Regions& regions, F&& is_in) {
  std::vector<BlockMask> result(regions.first.empty() ? 0 : regions.first.size() - 1, kAllOutside);
  for (std::size_t i = 0; i < result.size(); ++i)
    for (std::uint32_t c = regions.first[i]; c < regions.first[i + 1]; ++c)
      if (is_in(regions.components[c].region)) result[i] |= regions.components[c].voxels;
  return result;
}

/// Finds the regions of voxels. `table` numbers the blocks, `crossed` has an entry for each: the edges that
/// triangles intersect. The result is independent of the thread schedule. @throws Cancelled.
Regions find_regions(const BlockTable& table, const std::vector<kernels::EdgeBits>& crossed,
                     const RunContext& context);

}  // namespace hermesh
