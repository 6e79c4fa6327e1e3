// The two topology tests of Aldén 2011, §6.3, for a cubical region that is to be meshed as one cell.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include "algorithms/lattice/block_mask.h"

namespace hermesh {

namespace region_topology {

/// Returns the corners of a cube that `from` reaches along edges whose ends are both in `set`. Corner (x, y,
/// z) is bit 4x + 2y + z.
constexpr unsigned reached(unsigned set, unsigned from) {
  for (;;) {
    unsigned next = from;
    for (unsigned corner = 0; corner < 8; ++corner)
      if ((from >> corner) & 1)
        for (unsigned axis = 1; axis < 8; axis <<= 1) next |= (1u << (corner ^ axis)) & set;
    if (next == from) return from;
    from = next;
  }
}

/// Computes the first test for all 256 patterns of corners inside (Gerstner & Pajarola 2000): edges whose
/// ends have one sign are collapsed; the contour is one disc if a single edge is left, that is, if the
/// corners inside are connected, those outside are, and there are some of both.
constexpr std::array<bool, 256> collapse_table() {
  std::array<bool, 256> table{};
  for (unsigned inside = 1; inside < 255; ++inside) {
    const unsigned outside = 255u & ~inside;
    table[inside] = reached(inside, inside & (0u - inside)) == inside &&
                    reached(outside, outside & (0u - outside)) == outside;
  }
  return table;
}

/// The table of the first test, made by the compiler: filled at start-up it could be read too early (trap
/// T13).
inline constexpr std::array<bool, 256> kCollapsesToOneEdge = collapse_table();

/// The signs of 3×3×3 samples, half a region's side apart: bit 9x + 3y + z.
using Signs27 = std::uint32_t;

/// Returns the eight corners among the 27 samples, at the bits of the table.
constexpr unsigned corners(Signs27 signs) {
  unsigned result = 0;
  for (unsigned corner = 0; corner < 8; ++corner)
    result |= ((signs >> (18 * (corner >> 2) + 6 * ((corner >> 1) & 1) + 2 * (corner & 1))) & 1) << corner;
  return result;
}

/// The second test (Ju et al. 2002): the sign in the middle of an edge is that of one of its ends, in the
/// middle of a face that of one of its corners, and in the middle of the cube that of one of its corners.
constexpr bool middles_agree(Signs27 s) {
  constexpr unsigned kStep[3] = {9, 3, 1};
  for (int axis = 0; axis < 3; ++axis) {
    const unsigned along = kStep[axis], u = kStep[(axis + 1) % 3], v = kStep[(axis + 2) % 3];
    // First samples of the four edges along the axis, and of the two faces across it.
    const Signs27 edges = 1u | 1u << 2 * u | 1u << 2 * v | 1u << (2 * u + 2 * v);
    const Signs27 faces = 1u | 1u << 2 * along;
    if (~(s ^ s >> 2 * along) & (s ^ s >> along) & edges) return false;
    const Signs27 unlike = (s ^ s >> 2 * u) | (s ^ s >> 2 * v) | (s ^ s >> (2 * u + 2 * v));
    if (~unlike & (s ^ s >> (u + v)) & faces) return false;
  }
  const unsigned all = corners(s);
  return (all != 0 && all != 255) || (all & 1) == ((s >> 13) & 1);
}

/// Returns true if a region passes both tests.
constexpr bool passes(Signs27 signs) { return kCollapsesToOneEdge[corners(signs)] && middles_agree(signs); }

}  // namespace region_topology

/// The signs of the 9³ samples at the corners of a block's cells.
class SignLattice {
 public:
  /// The signs of a block, or null if all are `uniform`. The block itself and its upper neighbours are parts
  /// 4x + 2y + z.
  struct Part {
    const BlockMask* inside = nullptr;
    bool uniform = false;
  };
  SignLattice() = default;
  /// Takes the block's samples, and the first layers of its neighbours'.
  explicit SignLattice(const std::array<Part, 8>& parts) {
    for (int x = 0; x < 9; ++x)
      for (int y = 0; y < 9; ++y) {
        const unsigned column = 4u * (x >> 3) + 2u * (y >> 3);
        const std::uint32_t low = row(parts[column], x & 7, y & 7),
                            high = row(parts[column + 1], x & 7, y & 7);
        rows_[x][y] = static_cast<std::uint16_t>(low | (high & 1) << 8);
      }
  }

  /// Returns the signs at the 27 samples of the region of `side` 2, 4 or 8 cells whose first sample is (x, y,
  /// z).
  region_topology::Signs27 around(int x, int y, int z, int side) const {
    const int half = side / 2;
    region_topology::Signs27 signs = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const std::uint32_t row = std::uint32_t{rows_[x + i * half][y + j * half]} >> z;
        const std::uint32_t three = (row & 1) | (row >> half & 1) << 1 | (row >> side & 1) << 2;
        signs |= three << (9 * i + 3 * j);
      }
    return signs;
  }

 private:
  static std::uint32_t row(const Part& part, int x, int y) {
    if (!part.inside) return part.uniform ? 0xff : 0;
    return static_cast<std::uint32_t>((*part.inside)[x] >> 8 * y) & 0xff;
  }
  std::array<std::array<std::uint16_t, 9>, 9> rows_;
};

}  // namespace hermesh
