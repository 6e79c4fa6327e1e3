// Bits of a mask of cells, and those near them.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/lattice/block_mask.h"

namespace hermesh {

/// The cells of a block at most kSteps, up to 8, along each axis from a cell of a mask. `mask_at(ax, ay,
/// az)`, each −1 to 1, gives a pointer to the mask of the block there, or null.
template <int kSteps, class MaskAt>
BlockMask widened(MaskAt&& mask_at) {
  constexpr int kSide = 8 + 2 * kSteps;
  std::array<std::array<std::uint32_t, kSide>, kSide> rows;  // by x and y: bits along z, from −kSteps on
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y) {
      const int at_x = x - kSteps, at_y = y - kSteps;
      std::uint32_t row = 0;
      for (int az = -1; az <= 1; ++az) {
        const BlockMask* mask = mask_at(at_x >> 3, at_y >> 3, az);
        if (!mask) continue;
        const auto bits = static_cast<std::uint32_t>(((*mask)[at_x & 7] >> (8 * (at_y & 7))) & 0xff);
        row |= az < 0 ? bits >> (8 - kSteps) : bits << (kSteps + 8 * az);
      }
      rows[x][y] = row;
    }
  BlockMask result{};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      std::uint32_t row = 0;
      for (int i = 0; i <= 2 * kSteps; ++i)
        for (int j = 0; j <= 2 * kSteps; ++j) row |= rows[x + i][y + j];
      std::uint32_t wide = 0;
      for (int k = 0; k <= 2 * kSteps; ++k) wide |= row >> k;
      result[x] |= std::uint64_t{wide & 0xff} << (8 * y);
    }
  return result;
}

}  // namespace hermesh
