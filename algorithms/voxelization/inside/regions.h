// Connected regions of voxels that no triangle separates: two neighbours are connected when no triangle
// crosses the grid edge between them, and all space without blocks is connected through. Needs no normals and
// no closed mesh; the result does not depend on an order. (Aldén 2011, §5.3, floods the same way, along the
// surface's shell.)
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/lattice/block_mask.h"
#include "algorithms/lattice/block_table.h"
#include "algorithms/voxelization/distance/kernels/kernels.h"

namespace hermesh {

class RunContext;

/// Voxels of one block that are connected within it.
struct BlockComponent {
  BlockMask voxels;
  std::uint32_t region;
};

/// The components of all blocks, and which of them belong together.
struct Regions {
  /// Number of the region that reaches infinity.
  static constexpr std::uint32_t kOutside = 0;
  /// Components of block i: components[first[i]] … components[first[i + 1] − 1].
  std::vector<std::uint32_t> first;
  std::vector<BlockComponent> components;
  std::uint32_t count = 0;  ///< of regions; numbered in the order of their first component
};

/// Bits of the voxels in a word whose upper neighbour in y, or in z, is in the same word, as a block has
/// them.
inline constexpr std::uint64_t kBelowTopY = ~kLastY, kBelowTopZ = ~kLastZ;

/// The bits of the 64 voxels on one side of a block, 0 lower and 1 upper, in the order of the two other axes.
std::uint64_t face(const BlockMask& bits, int axis, int side);

/// Bits of the voxels whose upper neighbour along the axis (in `upper`, beyond the block) differs from them.
BlockMask differs_from_upper(const BlockMask& bits, const BlockMask& upper, int axis);

/// Finds the regions of voxels. `table` numbers the blocks, `crossed` has an entry for each.
/// @throws Cancelled.
Regions find_regions(const BlockTable& table, const std::vector<kernels::EdgeBits>& crossed,
                     const RunContext& context);

}  // namespace hermesh
