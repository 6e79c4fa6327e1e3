// The active cells of a block and their numbering: shared by dual contouring, its vector code, the uniform
// mesh and look-ups of points.
#pragma once

#include <cstdint>

namespace hermesh {

/// The active cells of a block of 8³ cells, and the numbers of their points, which ascend with the cells. The
/// arrays are plain, since vector code must not use the standard library, and uninitialized, so that many are
/// not written twice.
struct ActiveCells {
  std::uint64_t active[8];    ///< cells with a crossing edge, by their first corner: the words of a BlockMask
  std::uint16_t before[8];    ///< active cells before each word
  std::uint32_t first_point;  ///< number of the first active cell's point
};

// Both functions are always inlined, and without the standard library, because kernels of several SIMD levels
// call them.

/// Sets `before` and returns the number of active cells.
[[gnu::always_inline]] inline std::uint32_t count_before(ActiveCells& cells) {
  std::uint32_t before = 0;
  for (int word = 0; word < 8; ++word) {
    cells.before[word] = static_cast<std::uint16_t>(before);
    before += static_cast<std::uint32_t>(__builtin_popcountll(cells.active[word]));
  }
  return before;
}

/// Returns the number of active cells before an active cell.
[[gnu::always_inline]] inline std::uint32_t rank_of(const ActiveCells& cells, int cell) {
  const std::uint64_t below = cells.active[cell >> 6] & ((std::uint64_t{1} << (cell & 63)) - 1);
  return cells.before[cell >> 6] + static_cast<std::uint32_t>(__builtin_popcountll(below));
}

}  // namespace hermesh
