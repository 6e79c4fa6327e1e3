// The samples of a block of 8³ as bits, so that crossing edges and active cells take a few dozen operations
// on 64-bit words.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>

namespace hermesh {

/// One bit a sample: word x holds sample (x,y,z) at bit 8y+z, the order of OpenVDB's leaves.
using BlockMask = std::array<std::uint64_t, 8>;

/// The samples of one word (one x) that are first or last along y or z.
inline constexpr std::uint64_t kFirstY = 0xff, kLastY = kFirstY << 56, kFirstZ = 0x0101010101010101u,
                               kLastZ = kFirstZ << 7;
/// Returns the samples of one word that are first along each of the selected axes; all if none is selected.
constexpr std::uint64_t first_layers(bool y, bool z) {
  return (y ? kFirstY : ~std::uint64_t{0}) & (z ? kFirstZ : ~std::uint64_t{0});
}
/// Returns the samples of one word that are last along each of the selected axes; all if none is selected.
constexpr std::uint64_t last_layers(bool y, bool z) {
  return (y ? kLastY : ~std::uint64_t{0}) & (z ? kLastZ : ~std::uint64_t{0});
}
inline constexpr BlockMask kAllOutside{}, kAllInside{~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull};

/// The eight words of a mask, a BlockMask or the plain array of a struct for vector code.
using MaskWords = std::span<const std::uint64_t, 8>;

constexpr int sample_index(int x, int y, int z) { return 64 * x + 8 * y + z; }
constexpr bool test(MaskWords mask, int sample) { return (mask[sample >> 6] >> (sample & 63)) & 1; }
constexpr int count(MaskWords mask) {
  int sum = 0;
  for (const std::uint64_t word : mask) sum += std::popcount(word);
  return sum;
}
/// Returns the number of set bits before `sample`.
constexpr std::uint32_t rank_in(MaskWords mask, int sample) {
  int before = std::popcount(mask[sample >> 6] & ((std::uint64_t{1} << (sample & 63)) - 1));
  for (int word = 0; word < sample >> 6; ++word) before += std::popcount(mask[word]);
  return static_cast<std::uint32_t>(before);
}
constexpr bool any(MaskWords mask) {
  std::uint64_t all = 0;
  for (const std::uint64_t word : mask) all |= word;
  return all != 0;
}
/// Calls f(sample) for every set bit, in ascending order.
template <class F>
void for_each_bit(MaskWords mask, F&& f) {
  for (int x = 0; x < 8; ++x)
    for (std::uint64_t word = mask[x]; word != 0; word &= word - 1) f(64 * x + std::countr_zero(word));
}

/// Returns the index of a neighbour in a list of 27, each offset −1, 0 or 1.
constexpr int neighbour_slot(int dx, int dy, int dz) { return 9 * (dx + 1) + 3 * (dy + 1) + (dz + 1); }

/// A sample of a lattice of numbered blocks, or the cell whose first corner it is.
struct LatticePlace {
  std::int32_t block;  ///< negative if there is no block
  int sample;
};
/// Returns the sample at coordinates from −8 to 15 relative to a block's first sample; `neighbours` are the
/// numbers of the blocks around that one, by neighbour_slot(), its own in the middle.
constexpr LatticePlace locate(const std::array<std::int32_t, 27>& neighbours, int x, int y, int z) {
  // Arithmetic shifts give the offset of the block, −1, 0 or 1.
  return {neighbours[neighbour_slot(x >> 3, y >> 3, z >> 3)], sample_index(x & 7, y & 7, z & 7)};
}

/// Values for a block's index where there is no block: all samples there are outside, or all inside.
inline constexpr std::int32_t kUniformOutside = -1, kUniformInside = -2;

/// Returns the mask of the samples (dx,dy,dz) further on, each 0 or 1; `upper(ax,ay,az)` is the mask of the
/// block at that offset.
template <class Upper>
BlockMask shifted_mask(int dx, int dy, int dz, Upper&& upper) {
  BlockMask result;
  for (int x = 0; x < 8; ++x) {
    const int ax = (x + dx) >> 3, word = (x + dx) & 7;
    const auto row_shifted = [&](int az) {
      const std::uint64_t own = upper(ax, 0, az)[word];
      return dy == 0 ? own : (own >> 8) | (upper(ax, 1, az)[word] << 56);
    };
    const std::uint64_t own = row_shifted(0);
    result[x] = dz == 0 ? own : ((own >> 1) & ~kLastZ) | ((row_shifted(1) << 7) & kLastZ);
  }
  return result;
}

}  // namespace hermesh
