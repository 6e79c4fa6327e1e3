// Hermite data with one record per crossing edge: the representation that all others are made from.
//
// The thesis's voxel has room for three crossings (§4.2), and most voxels of a band have none. Here a leaf
// stores its signs, 512 bits and a layer beyond, and the crossings of its edges are consecutive in an array;
// the edge of a crossing is given by its rank among the set bits of the crossing masks.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/crossing.h"
#include "algorithms/lattice/block_mask.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// Signs of the 8³ samples of a leaf and of the layers just beyond, in 104 bytes: they determine the crossing
/// edges. An edge belongs to its first sample, so the leaf owns the edges from its last layers into its three
/// upper neighbors, whose first layers are stored here, too, so that no neighbor is looked up.
struct SignLeaf {
  std::array<std::int32_t, 3> lower;  ///< index coordinates of the first sample, multiples of 8
  std::uint32_t first;                ///< number of the leaf's first crossing
  BlockMask inside;
  /// Signs one step beyond the last layer along x, y and z: bits 8y+z, 8x+z and 8x+y.
  std::array<std::uint64_t, 3> beyond;

  bool operator==(const SignLeaf&) const = default;
};
static_assert(sizeof(SignLeaf) == 104);

/// Returns the signs of the samples one step further along `axis`, at the bits of the samples themselves.
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

/// Returns for each axis the samples whose up-wind edge is crossed.
inline std::array<BlockMask, 3> crossing_edges(const SignLeaf& leaf) {
  std::array<BlockMask, 3> result;
  for (int axis = 0; axis < 3; ++axis) {
    const BlockMask next = successors(leaf, axis);
    for (int x = 0; x < 8; ++x) result[axis][x] = leaf.inside[x] ^ next[x];
  }
  return result;
}

/// Returns the signs of the leaf's first layer along `axis`, packed as in the lower neighbour's `beyond`.
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

/// Hermite data, leaf by leaf. `Crossing` is EdgeCrossing (16 bytes) or PackedCrossing (4).
///
/// Contains only leaves that own a crossing edge, in ascending order of (x, y, z), so that two grids with the
/// same signs and crossings are equal member by member. A sample without a leaf has the sign beyond the
/// previous leaf in its column along z (`beyond[2]`, which is then uniform), or `outermost_inside` if there
/// is no such leaf. This holds because between two missing leaves no edge is crossed.
template <class Crossing>
struct SparseHermite {
  IndexToWorld placement;
  bool outermost_inside = false;  ///< sign at infinity; true after a complement
  NormalCodeId normal_code =
      NormalCodeId::octahedral;  ///< code of PackedCrossing's normals; else without meaning
  LargeArray<SignLeaf> leaves;
  LargeArray<Crossing> crossings;  ///< ordered by leaf, in it by axis, in that by sample

  std::size_t memory_bytes() const {
    return leaves.capacity() * sizeof(SignLeaf) + crossings.capacity() * sizeof(Crossing);
  }
  std::span<const Crossing> crossings_of(std::size_t leaf) const {
    const std::size_t end = leaf + 1 < leaves.size() ? leaves[leaf + 1].first : crossings.size();
    return std::span(crossings).subspan(leaves[leaf].first, end - leaves[leaf].first);
  }
  /// Returns the leaf whose first sample is `lower`, or null.
  const SignLeaf* find(const std::array<std::int32_t, 3>& lower) const {
    const auto at = lower_bound(lower);
    return at != leaves.end() && at->lower == lower ? &*at : nullptr;
  }
  /// Returns the sign of all samples of the block at `lower` if it has no leaf.
  bool sign_without_leaf(const std::array<std::int32_t, 3>& lower) const {
    const auto at = lower_bound(lower);
    if (at == leaves.begin()) return outermost_inside;
    const SignLeaf& before = *(at - 1);
    const bool same_column = before.lower[0] == lower[0] && before.lower[1] == lower[1];
    return same_column ? (before.beyond[2] & 1) != 0 : outermost_inside;
  }

 private:
  auto lower_bound(const std::array<std::int32_t, 3>& lower) const {
    return std::lower_bound(leaves.begin(), leaves.end(), lower,
                            [](const SignLeaf& leaf, const auto& wanted) { return leaf.lower < wanted; });
  }
};

using FloatHermite = SparseHermite<EdgeCrossing>;
using PackedHermite = SparseHermite<PackedCrossing>;

/// Calls f(axis, sample, crossing) for every crossing of the leaf.
template <class Crossing, class F>
void for_each_crossing(const SparseHermite<Crossing>& hermite, std::size_t leaf, F&& f) {
  const std::span<const Crossing> crossings = hermite.crossings_of(leaf);
  const std::array<BlockMask, 3> masks = crossing_edges(hermite.leaves[leaf]);
  std::size_t next = 0;
  for (int axis = 0; axis < 3; ++axis)
    for_each_bit(masks[axis], [&](int sample) { f(axis, sample, crossings[next++]); });
}

/// Converts to offsets of 10 bits and normals in `code`, with tags of 0. @throws Cancelled.
PackedHermite pack(const FloatHermite& hermite, NormalCodeId code, RunContext& context);
/// Decodes the data, without the tags. @throws Cancelled.
FloatHermite unpack(const PackedHermite& hermite, RunContext& context);

/// Returns true if both map index coordinates to the same point of the world, up to rounding.
bool same_lattice(const IndexToWorld& a, const IndexToWorld& b);

/// Checks data from outside. @throws Error if the leaves are out of order, the ranks do not add up, two
/// leaves disagree about a sample, a crossing is not a number, or the sign of a missing leaf is ambiguous.
template <class Crossing>
void check_consistent(const SparseHermite<Crossing>& hermite);

}  // namespace hermesh
