// The quantised normal of the thesis with its two defects mended: it rounds to the nearest step, and the
// third component is what is left of 126.
#pragma once

#include "algorithms/hermite/normal_codes/octant_slots.h"

namespace hermesh {

/// Layout and decoder are Baptista's. A component that is quantised to zero is positive, so that different
/// codes are different normals.
struct RoundedNormalCode {
  static constexpr const char* name = "rounded";

  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    using namespace octant_slots;
    const Projection at = project(normal, kLevels * kStep);
    int a = nearest_step(at.a), b = nearest_step(at.b);
    // Both were rounded up where they add up to 127; the one that gained more goes back.
    const int excess = sign_mask(kLevels - a - b);
    const int from_a = excess & sign_mask(below(at.a, a) - below(at.b, b));
    a += from_a;
    b += excess ^ from_a;
    return std::uint16_t((at.negative & signs_of_nonzero(a, b)) | fold(std::uint32_t(a), std::uint32_t(b)));
  }

  static std::array<float, 3> unpack(std::uint16_t code) { return octant_slots::unpack<126>(code); }

  static std::uint16_t negate(std::uint16_t code) {
    const octant_slots::Components at = octant_slots::unfold(code);
    return std::uint16_t(code ^ signs_of_nonzero(int(at.a), int(at.b)));
  }

 private:
  [[gnu::always_inline]] static std::uint32_t signs_of_nonzero(int a, int b) {
    const int c = octant_slots::kLevels - a - b;
    return std::uint32_t((-a & 1 << 20) >> 5 | (-b & 1 << 20) >> 6 | (-c & 1 << 20) >> 7);
  }
};

}  // namespace hermesh
