// Signs of samples as bits, many at a time: sequentially they would take longer than their memory access.
#pragma once

#include <cstddef>
#include <cstdint>

#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh {

/// The rule that defines the inside of a volume. In a level set, samples less than the isovalue are inside.
/// In any other volume the background is outside, and samples on the other side of the isovalue are inside,
/// so that dense fog is. A sample exactly at the isovalue is outside.
struct InsideRule {
  float isovalue = 0.0f;
  float scale = 1.0f;  ///< −1 where greater values are inside

  /// Returns the value less the isovalue, negative inside; in units of the grid's values.
  float signed_value(float value) const { return scale * (value - isovalue); }
  bool operator()(float value) const { return signed_value(value) < 0.0f; }
};

/// Readers of signs, compiled for each SIMD level (simd_level.h); all levels give the same bits.
struct SignReader {
  SimdLevel level;
  /// Writes the signs of a leaf's 512 samples as a BlockMask; returns false if one of them is not finite.
  bool (*leaf)(const float* values, const InsideRule& rule, std::uint64_t* inside);
  /// Returns the signs of eight rows of eight samples that start `stride` samples apart: a row is a byte.
  std::uint64_t (*rows)(const float* values, std::size_t stride, const InsideRule& rule);
  static const SignReader sse2, avx2, avx512;
};

}  // namespace hermesh
