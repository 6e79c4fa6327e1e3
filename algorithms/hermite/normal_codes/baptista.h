// The quantised normal of the article that the thesis cites: R. Baptista, Higher Accuracy Quantized Normals,
// GameDev.net 2000.
#pragma once

#include "algorithms/hermite/normal_codes/octant_slots.h"

namespace hermesh {

/// Code like ThesisNormalCode, but the third component is 126 - a - b, so that the three add up to what they
/// were divided into; it is still 0 to 2 too much. 64 contents of the slots, of which none is ever packed,
/// have a third component of -1.
struct BaptistaNormalCode {
  static constexpr const char* name = "baptista";
  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    return octant_slots::pack_rounding_down(normal);
  }
  static std::array<float, 3> unpack(std::uint16_t code) { return octant_slots::unpack<126>(code); }
  static std::uint16_t negate(std::uint16_t code) { return code ^ octant_slots::kSigns; }
};

}  // namespace hermesh
