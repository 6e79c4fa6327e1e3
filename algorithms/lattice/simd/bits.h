// Bits of words of 64, and lists of the set bits of a leaf's eight words; only for kernels, as vectors.h.
#pragma once

#include "algorithms/lattice/simd/vectors.h"

namespace hermesh::simd {
namespace {

inline int popcount(std::uint64_t word) { return __builtin_popcountll(word); }
inline int first_bit(std::uint64_t word) { return __builtin_ctzll(word); }

constexpr std::uint64_t kFirstZ = 0x0101010101010101u, kLastZ = kFirstZ << 7;
constexpr std::uint64_t kFirstY = 0xff, kLastY = kFirstY << 56;

typedef std::uint8_t EightBytes __attribute__((vector_size(8)));
typedef std::uint16_t EightShorts __attribute__((vector_size(16)));

/// The positions of the set bits of a byte.
struct BitsOfByte {
  std::uint8_t place[256][8], count[256];
};
constexpr BitsOfByte make_bits_of_byte() {
  BitsOfByte table{};
  for (int byte = 0; byte < 256; ++byte)
    for (int bit = 0; bit < 8; ++bit)
      if (byte >> bit & 1) table.place[byte][table.count[byte]++] = static_cast<std::uint8_t>(bit);
  return table;
}
alignas(64) constexpr BitsOfByte kBitsOfByte = make_bits_of_byte();

/// Room of a list after its last number, undefined.
constexpr int kListRoom = 32;

/// Returns which bytes of eight words are not zero: bit 8x + y for byte y of word x.
inline std::uint64_t bytes_with_bits(const std::uint64_t* words) {
  std::uint64_t result = 0;
  for (int i = 0; i < 4; ++i) {
    const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + 2 * i));
    const int empty = _mm_movemask_epi8(_mm_cmpeq_epi8(bytes, _mm_setzero_si128()));
    result |= std::uint64_t{static_cast<unsigned>(empty) ^ 0xffffu} << (16 * i);
  }
  return result;
}

/// Returns the bits of the last layer along y of eight words, as bits 8x + z.
inline std::uint64_t last_along_y(const std::uint64_t* words) {
  std::uint64_t plane = 0;
  for (int x = 0; x < 8; ++x) plane |= words[x] >> 56 << (8 * x);
  return plane;
}
/// Returns the bits of the last layer along z of eight words, as bits 8x + y.
inline std::uint64_t last_along_z(const std::uint64_t* words) {
  std::uint64_t plane = 0;
  for (int i = 0; i < 4; ++i) {
    const __m128i bytes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + 2 * i));
    plane |= std::uint64_t{static_cast<unsigned>(_mm_movemask_epi8(bytes))} << (16 * i);
  }
  return plane;
}
/// Repeats the last number of a list for a vector after it, so that whole vectors can be read.
inline void pad_list(std::uint16_t* list, int count) {
  for (int i = 0; i < kLanes; ++i) list[count + i] = count > 0 ? list[count - 1] : std::uint16_t{0};
}

}  // namespace
}  // namespace hermesh::simd
