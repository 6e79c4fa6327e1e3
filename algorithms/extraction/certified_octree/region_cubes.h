// Cubes of 2³, 4³ and 8³ cells of a block, as bits: those of a level by number, their cells as masks.
#pragma once

#include <cstdint>

#include "algorithms/lattice/block_mask.h"

namespace hermesh {

inline constexpr int kCubeLevels = 3;  ///< a cube of a level is 2^level cells wide

/// The cube of a level, from 1 on, that a cell is in; numbered along z, y and x.
constexpr int cube_of(int cell, int level) {
  const int bits = kCubeLevels - level;
  return ((((cell >> 6) >> level) << bits | ((cell >> 3) & 7) >> level) << bits) | (cell & 7) >> level;
}
/// The first cell of a cube: the one with the least coordinates.
constexpr int first_cell(int cube, int level) {
  const int bits = kCubeLevels - level, mask = (1 << bits) - 1;
  return sample_index((cube >> (2 * bits)) << level, ((cube >> bits) & mask) << level,
                      (cube & mask) << level);
}

/// The cubes of the next finer level that a cube of 4³ or 8³ cells is made of, a bit each.
constexpr std::uint64_t parts_of(int cube, int level) {
  const int bits = kCubeLevels - level, mask = (1 << bits) - 1;
  const int x = 2 * (cube >> (2 * bits)), y = 2 * ((cube >> bits) & mask), z = 2 * (cube & mask);
  std::uint64_t parts = 0;
  for (int i = 0; i < 8; ++i)
    parts |= std::uint64_t{1} << (((((x + (i >> 2)) << (bits + 1)) | (y + ((i >> 1) & 1))) << (bits + 1)) |
                                  (z + (i & 1)));
  return parts;
}

/// The bits that a cube has in each of its words of a mask, less its first rows along y and columns along z.
constexpr std::uint64_t rows_of(int first, int side, int skip_y, int skip_z) {
  const std::uint64_t row = (((std::uint64_t{1} << side) - 1) >> skip_z << skip_z) << (first & 7);
  std::uint64_t rows = 0;
  for (int y = skip_y; y < side; ++y) rows |= row << (8 * (((first >> 3) & 7) + y));
  return rows;
}

/// The bits of a row of a level's cubes, as far apart as the cubes are wide.
constexpr std::uint64_t spread(std::uint64_t row, int level) {
  if (level == 2) return (row & 1) | (row & 2) << 3;
  if (level > 2) return row;
  row = (row | row << 2) & 0x33;
  return (row | row << 1) & 0x55;
}

/// The cells of a level's cubes, a bit each.
constexpr BlockMask cells_of(std::uint64_t cubes, int level) {
  BlockMask result{};
  if (cubes == 0) return result;
  const int bits = kCubeLevels - level, across = 1 << bits, side = 1 << level;
  for (int x = 0; x < across; ++x) {
    std::uint64_t rows = 0;  // those of the cubes' first cells
    for (int y = 0; y < across; ++y) {
      const std::uint64_t row = (cubes >> ((x << bits | y) << bits)) & ((1u << across) - 1);
      rows |= spread(row, level) << (8 * side * y);
    }
    for (int step = 1; step < side; step *= 2) rows |= rows << step | rows << (8 * step) | rows << (9 * step);
    for (int k = 0; k < side; ++k) result[static_cast<std::size_t>(x * side + k)] = rows;
  }
  return result;
}

/// The first rows, along y, of all cubes of a level; and their first columns, along z.
constexpr std::uint64_t first_rows(int level) {
  std::uint64_t rows = 0;
  for (int y = 0; y < 8; y += 1 << level) rows |= std::uint64_t{0xff} << (8 * y);
  return rows;
}
constexpr std::uint64_t first_columns(int level) {
  std::uint64_t columns = 0;
  for (int z = 0; z < 8; z += 1 << level) columns |= std::uint64_t{0x0101010101010101} << z;
  return columns;
}

}  // namespace hermesh
