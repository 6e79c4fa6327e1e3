// Hermite data with one record a crossing edge: the representation that everything else is made from.
//
// The thesis's voxel has room for three crossings, whether there are any or not (§4.2), and most voxels of a
// band have none. Here a leaf keeps its signs, 512 bits and a layer beyond, and the crossings of its edges
// follow one another in an array; which edge a crossing belongs to is its rank among the set bits of the
// crossing masks.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/crossing.h"
#include "algorithms/hermite/sign_leaf.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// Hermite data, leaf by leaf. `Crossing` is EdgeCrossing (16 bytes) or PackedCrossing (4).
///
/// Only leaves that own a crossing edge are there, in ascending order of (x, y, z), so that two grids with
/// the same signs and crossings are equal member by member, however they were made. A sample without a leaf
/// has the sign that the leaf before it in its column along z leaves behind (`beyond[2]`, which is then
/// uniform), or, if there is none before it, `outermost_inside`. This holds because between two missing
/// leaves no edge is crossed.
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
  /// The leaf whose first sample is `lower`, or null.
  const SignLeaf* find(const std::array<std::int32_t, 3>& lower) const {
    const auto at = lower_bound(lower);
    return at != leaves.end() && at->lower == lower ? &*at : nullptr;
  }
  /// Sign of all samples of the block at `lower`, where there is no leaf.
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

/// The data with offsets of 10 bits and normals in `code`, with tags of 0. @throws Cancelled.
PackedHermite pack(const FloatHermite& hermite, NormalCodeId code, RunContext& context);
/// What the codes stand for, without the tags. @throws Cancelled.
FloatHermite unpack(const PackedHermite& hermite, RunContext& context);

/// True if both place the same index coordinates at the same point of the world, up to rounding.
bool same_lattice(const IndexToWorld& a, const IndexToWorld& b);

/// @throws Error that says what is wrong if the leaves are out of order, the ranks do not add up, two leaves
/// disagree about a sample, a crossing is not a number, or the sign of a missing leaf is ambiguous. For data
/// from outside.
template <class Crossing>
void check_consistent(const SparseHermite<Crossing>& hermite);

}  // namespace hermesh
