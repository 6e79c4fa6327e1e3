// Boxes of voxels, as the bits of one block.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "algorithms/voxelization/inside/regions.h"

namespace hermesh {

using Voxel = std::array<std::int32_t, 3>;

/// The bits of a block's voxels in the box from one voxel to another, both included; none where the box is
/// beside the block.
inline BlockMask box_bits(const BlockAt& block, const Voxel& from, const Voxel& to) {
  std::int32_t first[3], last[3];
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = std::max(from[a] - 8 * block[a], 0);
    last[a] = std::min(to[a] - 8 * block[a], 7);
    if (first[a] > last[a]) return {};
  }
  const std::uint64_t row = (std::uint64_t(2) << last[2]) - (std::uint64_t(1) << first[2]);
  std::uint64_t layer = 0;
  for (std::int32_t y = first[1]; y <= last[1]; ++y) layer |= row << (8 * y);
  BlockMask bits{};
  for (std::int32_t x = first[0]; x <= last[0]; ++x) bits[std::size_t(x)] = layer;
  return bits;
}

}  // namespace hermesh
