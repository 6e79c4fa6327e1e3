// The crossing edges of a block and their numbering: for the crossings of Hermite data and the points of
// marching cubes.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "algorithms/lattice/block_mask.h"

namespace hermesh {

/// The crossing edges that a block owns, numbered by axis and then by first sample. (Without initializers, so
/// that many are not written twice.)
struct CrossingEdges {
  std::array<BlockMask, 3> crossing;                   ///< samples whose up-wind edge is crossed, by axis
  std::array<std::array<std::uint16_t, 8>, 3> before;  ///< number of crossing edges before each axis and word

  /// Returns the rank of a crossing edge among those of the block.
  std::uint32_t rank(int axis, int sample) const {
    const int word = sample >> 6;
    return before[axis][word] + static_cast<std::uint32_t>(std::popcount(
                                    crossing[axis][word] & ((std::uint64_t{1} << (sample & 63)) - 1)));
  }
  /// Calls f(axis, sample) for each crossing edge, in the order of rank().
  template <class F>
  void for_each(F&& f) const {
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(crossing[static_cast<std::size_t>(axis)], [&](int sample) { f(axis, sample); });
  }
  int crossing_count() const { return before[2][7] + std::popcount(crossing[2][7]); }
  /// Sets `before` from `crossing`.
  void count_before() {
    int sum = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int word = 0; word < 8; ++word) {
        before[axis][word] = static_cast<std::uint16_t>(sum);
        sum += std::popcount(crossing[axis][word]);
      }
  }
};

}  // namespace hermesh
