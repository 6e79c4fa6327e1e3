// Signs of samples as bits, many at a time: one after the other they would take longer than it takes to read
// them.
#pragma once

#include <cstddef>
#include <cstdint>

#include "algorithms/lattice/blocks.h"

namespace hermesh {

/// Which samples of a volume are inside. In a level set those less than the isovalue. In any other volume the
/// background is outside: samples on the other side of the isovalue are inside, so that dense fog is. A
/// sample exactly at the isovalue is outside.
struct InsideRule {
  float isovalue = 0.0f;
  float scale = 1.0f;  ///< −1 where greater values are inside

  /// Negative inside, in units of the grid's values.
  float signed_value(float value) const { return scale * (value - isovalue); }
  bool operator()(float value) const { return signed_value(value) < 0.0f; }
};

/// For the chosen level of vector code, see simd_level.h; all give the same bits.
struct SignReader {
  /// Signs of a leaf's 512 samples; returns false if one of them is not finite.
  bool (*leaf)(const float* values, const InsideRule& rule, BlockMask& inside);
  /// Signs of eight rows of eight samples that start `stride` samples apart: a row is a byte.
  std::uint64_t (*rows)(const float* values, std::size_t stride, const InsideRule& rule);
};
const SignReader& chosen_sign_reader();

}  // namespace hermesh
