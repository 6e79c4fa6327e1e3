// The quantised normal of the thesis (Aldén 2011, equations 4.1 to 4.14) as it is printed.
#pragma once

#include "algorithms/hermite/normal_codes/octant_slots.h"

namespace hermesh {

/// The code as printed: it rounds down in steps of 1/126 but reconstructs the third component as 127 - a - b
/// (equation 4.9), which is 1 to 3 too much: a normal in a coordinate plane x = 0 or y = 0 comes out in it,
/// one in z = 0 does not. Every normal of the positive octant within about 0.45° of +z has the code 0.
struct ThesisNormalCode {
  static constexpr const char* name = "thesis";
  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    return octant_slots::pack_rounding_down(normal);
  }
  static std::array<float, 3> unpack(std::uint16_t code) { return octant_slots::unpack<127>(code); }
  /// The signs are those of the normal before it is quantised, so that a zero component comes with either.
  static std::uint16_t negate(std::uint16_t code) { return code ^ octant_slots::kSigns; }
};

}  // namespace hermesh
