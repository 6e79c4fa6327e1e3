// The signs of 8³ samples and of the layers just beyond: all that is needed to tell which edges are crossed.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/lattice/block_mask.h"

namespace hermesh {

/// Signs of a leaf, in 104 bytes. An edge belongs to the sample that it starts from, so the leaf owns the
/// edges that lead from its last layers into its three upper neighbors; the signs of their first layers are
/// kept here, so that no neighbor is looked up.
struct SignLeaf {
  std::array<std::int32_t, 3> lower;  ///< index coordinates of the first sample, multiples of 8
  std::uint32_t first;                ///< number of the leaf's first crossing
  BlockMask inside;
  /// Signs one step beyond the last layer along x, y and z: bits 8y+z, 8x+z and 8x+y.
  std::array<std::uint64_t, 3> beyond;

  bool operator==(const SignLeaf&) const = default;
};
static_assert(sizeof(SignLeaf) == 104);

/// Signs of the samples one step further along `axis`, at the bits of the samples themselves.
inline BlockMask successors(const SignLeaf& leaf, int axis) {
  BlockMask result;
  for (int x = 0; x < 8; ++x) {
    if (axis == 0)
      result[x] = x < 7 ? leaf.inside[x + 1] : leaf.beyond[0];
    else if (axis == 1)
      result[x] = (leaf.inside[x] >> 8) | (((leaf.beyond[1] >> (8 * x)) & 0xff) << 56);
    else {
      // Eight bits of a row are spread to the last bit of each byte: bit y goes to bit 8y+7.
      const std::uint64_t row = (leaf.beyond[2] >> (8 * x)) & 0xff;
      const std::uint64_t spread = ((row * 0x8040201008040201u) & kLastZ) >> 7;
      result[x] = ((leaf.inside[x] >> 1) & ~kLastZ) | (__builtin_bswap64(spread) << 7);
    }
  }
  return result;
}

/// For each axis the samples whose up-wind edge is crossed.
inline std::array<BlockMask, 3> crossing_edges(const SignLeaf& leaf) {
  std::array<BlockMask, 3> result;
  for (int axis = 0; axis < 3; ++axis) {
    const BlockMask next = successors(leaf, axis);
    for (int x = 0; x < 8; ++x) result[axis][x] = leaf.inside[x] ^ next[x];
  }
  return result;
}

/// The signs of the leaf's first layer along `axis`, packed as a lower neighbour's `beyond` has them.
inline std::uint64_t first_layer(const BlockMask& inside, int axis) {
  if (axis == 0) return inside[0];
  std::uint64_t result = 0;
  for (int x = 0; x < 8; ++x) {
    const std::uint64_t word = inside[x];
    // Along z the first bit of every byte is gathered: bit 8y goes to bit y.
    const std::uint64_t row = axis == 1 ? word & kFirstY : ((word & kFirstZ) * 0x0102040810204080u) >> 56;
    result |= row << (8 * x);
  }
  return result;
}

}  // namespace hermesh
