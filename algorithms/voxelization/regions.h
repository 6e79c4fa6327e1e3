// Connected regions of voxels that no triangle separates: two neighbours are connected when no triangle crosses the
// grid edge between them, and all space without blocks is connected through. Needs no normals and no closed mesh; the
// result does not depend on an order. (Aldén 2011, §5.3, floods the same way, along the surface's shell.)
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/core/block_table.h"
#include "algorithms/voxelization/kernels/kernels.h"

namespace hermesh {

class RunContext;

/// 512 voxels of a block: bit (y, z) of word x.
using VoxelBits = std::array<std::uint64_t, 8>;

/// Voxels of one block that are connected within it.
struct BlockComponent {
  VoxelBits voxels;
  std::uint32_t region;
};

struct Regions {
  /// The region that reaches infinity.
  static constexpr std::uint32_t kOutside = 0;
  /// Components of block i: components[first[i]] … components[first[i + 1] − 1].
  std::vector<std::uint32_t> first;
  std::vector<BlockComponent> components;
  std::uint32_t count = 0;  ///< of regions; numbered in the order of their first component
};

/// `table` numbers the blocks, `crossed` has an entry for each. @throws Cancelled.
Regions find_regions(const BlockTable& table, const std::vector<kernels::EdgeBits>& crossed,
                     const RunContext& context);

}  // namespace hermesh
