// The octahedral map with eight bits for each of its two coordinates (Meyer et al., On Floating-Point Normal
// Vectors, 2010; Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, JCGT
// 2014).
#pragma once

#include "algorithms/hermite/normal_codes/octant_slots.h"

namespace hermesh {

/// The octahedron |x| + |y| + |z| = 127 seen along z: (x, y) is the code of the upper half, and the lower
/// half is folded outwards over the diagonals to fill the square from -127 to 127. Along the square's border
/// the fold joins points in pairs, and all four corners; the code with the positive coordinates stands for
/// them.
struct OctahedralNormalCode {
  static constexpr const char* name = "octahedral";
  static constexpr int kExtent = 127;

  /// Code of a normal, with both coordinates rounded to the nearest step.
  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    const octant_slots::Projection at = octant_slots::project(normal, kExtent * octant_slots::kStep);
    return of_lattice(octant_slots::nearest_step(at.a), octant_slots::nearest_step(at.b), at.negative);
  }

  /// The normal of a code, without a table. A table of weights, as the other codes have, is no faster; one of
  /// all 65,536 normals is, by four times in a loop that does nothing else, but its 768 KiB drive everything
  /// else out of the caches for a gain of 3 ns, where the equations that are solved with each normal take
  /// more than a hundred.
  static std::array<float, 3> unpack(std::uint16_t code) {
    const Lattice at = decode(code);
    const float weight = 1.0f / std::sqrt(float(at.x * at.x + at.y * at.y + at.z * at.z));
    return {float(at.x) * weight, float(at.y) * weight, float(at.z) * weight};
  }

  static std::uint16_t negate(std::uint16_t code) {
    const Lattice at = decode(code);
    const std::uint32_t negative = (-at.x >> 16 & 0x8000) | (-at.y >> 17 & 0x4000) | (-at.z >> 18 & 0x2000);
    return of_lattice(magnitude(at.x), magnitude(at.y), negative);
  }

 protected:
  /// A point with whole coordinates on the octahedron.
  struct Lattice {
    int x, y, z;
  };

  [[gnu::always_inline]] static int sign_mask(int value) { return octant_slots::sign_mask(value); }
  [[gnu::always_inline]] static int negated_if(int mask, int value) {
    return octant_slots::negated_if(mask, value);
  }
  static int magnitude(int value) { return negated_if(sign_mask(value), value); }

  /// The code of a point by the magnitudes of x and y and all three signs. Magnitudes that add up to 128,
  /// both rounded up, lie beyond the equator, which is where the square has them, too.
  [[gnu::always_inline]] static std::uint16_t of_lattice(int x, int y, std::uint32_t negative) {
    const int signs = int(negative);
    const int folded = (kExtent - x - y) & -(signs >> 13 & 1);
    const int u = x + folded, v = y + folded;
    // Minus where the sign says so, but not on the border's other half.
    const int minus_u = -(signs >> 15 & 1) & sign_mask(v - kExtent);
    const int minus_v = -(signs >> 14 & 1) & sign_mask(u - kExtent);
    return std::uint16_t((negated_if(minus_u, u) & 255) << 8 | (negated_if(minus_v, v) & 255));
  }

  static Lattice decode(std::uint16_t code) {
    const int u = std::int8_t(code >> 8), v = std::int8_t(code & 255);
    const int mu = magnitude(u), mv = magnitude(v), z = kExtent - mu - mv;
    const int folded = z & sign_mask(z);  // in the lower half 127 - mv is mu + z, and 127 - mu is mv + z
    return {negated_if(sign_mask(u), mu + folded), negated_if(sign_mask(v), mv + folded), z};
  }
};

}  // namespace hermesh
