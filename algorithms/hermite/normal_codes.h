// The normal codes of normal_code.h themselves, and the choice of one by name. Few files include it.
//
// Those of chapter 4 of the thesis (Aldén 2011, equations 4.1 to 4.14 and figure 4.1) consist of three sign
// bits, and of two components of the normal's projection into the first octant in the other 13 bits.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "algorithms/hermite/normal_code.h"

namespace hermesh {

/// The projection into the first octant and its two slots.
namespace octant_slots {

/// Bits 15, 14, 13 are set where x, y, z are negative.
inline constexpr std::uint16_t kSigns = 0xE000, kSlots = 0x1FFF;
/// The components are quantised in the range 0 to 126 (equations 4.5 and 4.6).
inline constexpr int kSlotLevels = 126;
/// A vector whose components' magnitudes have no greater sum, or none that is finite, has no direction. Above
/// it, the quotients below are finite.
inline constexpr float kShortest = 1e-30f;

struct Components {
  std::uint32_t a, b;
};

/// A normal's projection into the first octant's plane (equations 4.3 and 4.4), times a number of levels: the
/// three add up to it, except for rounding.
struct Projection {
  float a, b, c;
  std::uint32_t negative;  ///< bits 15, 14, 13, as in a code
};

/// Computes steps 1 and 2 of §4.1, by one division. A vector without direction is taken for +z. Negative zero
/// counts as positive. Masks instead of branches let compilers vectorise loops over normals.
[[gnu::always_inline]] inline Projection project(const std::array<float, 3>& normal, int levels) {
  const float x = std::fabs(normal[0]), y = std::fabs(normal[1]), z = std::fabs(normal[2]);
  const float sum = x + y + z;
  // Floats that are not negative compare like their bits, and the bits of NaN are above those of infinity.
  const auto bits = std::bit_cast<std::int32_t>(sum);
  const bool long_enough = bits > std::bit_cast<std::int32_t>(kShortest);
  const bool finite = bits < std::bit_cast<std::int32_t>(std::numeric_limits<float>::infinity());
  const bool directed = long_enough & finite;
  const std::uint32_t mask = 0u - std::uint32_t(directed);
  const auto kept = [mask](float value, float otherwise) __attribute__((always_inline)) {
    return std::bit_cast<float>((std::bit_cast<std::uint32_t>(value) & mask) |
                                (std::bit_cast<std::uint32_t>(otherwise) & ~mask));
  };
  const float scale = float(levels) / kept(sum, 1.0f);
  const std::uint32_t negative = std::uint32_t(normal[0] < 0.0f) << 15 |
                                 std::uint32_t(normal[1] < 0.0f) << 14 |
                                 std::uint32_t(normal[2] < 0.0f) << 13;
  return {kept(x, 0.0f) * scale, kept(y, 0.0f) * scale, kept(z, 1.0f) * scale, negative & mask};
}

/// Folds components (equation 4.7): a component b of 64 or more does not fit into its six bits, and the
/// complements of both components are stored instead. The condition is that on b before either is replaced.
[[gnu::always_inline]] inline std::uint16_t fold(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t complement = (b >> 6) * 127u;  // of seven bits: 127 - a is a ^ 127
  return std::uint16_t((a ^ complement) << 6 | (b ^ complement));
}

/// Undoes fold() (equation 4.8). Complements add up to 254 - a - b, that is to 127 and more, and components
/// to 126 and less.
constexpr Components unfold(std::uint16_t code) {
  const std::uint32_t a = (code >> 6) & 127u, b = code & 63u;
  const std::uint32_t complement = ((a + b + 1) >> 7) * 127u;  // the sum is at most 190
  return {a ^ complement, b ^ complement};
}

/// Computes a square root by Newton's iteration from above, which decreases until it has converged; std::sqrt
/// is not constexpr.
constexpr double square_root(double value) {
  double root = value > 1.0 ? value : 1.0;
  for (double next = 0.5 * (root + value / root); next < root; next = 0.5 * (root + value / root))
    root = next;
  return root;
}

/// Equation 4.10 for every content of the slots, 32 KiB. The third component is kSum - a - b: the thesis
/// takes 127 (equation 4.9), the article that it cites 126. Made at compile time, since a table that is
/// filled at start-up can be read too early.
template <int kSum>
inline constexpr std::array<float, kSlots + 1> kWeights = [] {
  std::array<float, kSlots + 1> weights{};
  for (std::size_t slots = 0; slots < weights.size(); ++slots) {
    const Components at = unfold(std::uint16_t(slots));
    const int a = int(at.a), b = int(at.b), c = kSum - a - b;
    weights[slots] = float(1.0 / square_root(double(a * a + b * b + c * c)));
  }
  return weights;
}();

// The following functions take the projection in units of 1/65,536 of a step, as integers, and use all bits
// of a negative number's sign as a mask: both let loops become vector code on every processor.

inline constexpr int kStep = 1 << 16;

[[gnu::always_inline]] constexpr int nearest_step(float value) { return (int(value) + kStep / 2) >> 16; }
/// Returns by how much `value` exceeds its step, −kStep / 2 to kStep / 2.
[[gnu::always_inline]] constexpr int below(float value, int step) { return int(value) - step * kStep; }
[[gnu::always_inline]] constexpr int sign_mask(int value) { return value >> 31; }
[[gnu::always_inline]] constexpr int negated_if(int mask, int value) { return (value ^ mask) - mask; }

inline float with_sign(float magnitude, std::uint32_t sign_bit) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(magnitude) ^ sign_bit);
}

/// Returns the normal of a code: equations 4.8 to 4.13, and the signs.
template <int kSum>
std::array<float, 3> unpack(std::uint16_t code) {
  const Components at = unfold(code);
  const float weight = kWeights<kSum>[code & kSlots];
  const std::uint32_t bits = code;
  return {with_sign(float(int(at.a)) * weight, (bits & 0x8000u) << 16),
          with_sign(float(int(at.b)) * weight, (bits & 0x4000u) << 17),
          with_sign(float(kSum - int(at.a) - int(at.b)) * weight, (bits & 0x2000u) << 18)};
}

/// Step 3 as printed (equations 4.5 and 4.6), which rounds down.
template <int kSum>
struct FlooredNormalCode {
  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    const Projection at = project(normal, kSlotLevels);
    return std::uint16_t(at.negative | fold(std::uint32_t(int(at.a)), std::uint32_t(int(at.b))));
  }
  static std::array<float, 3> unpack(std::uint16_t code) { return octant_slots::unpack<kSum>(code); }
  /// The signs are those of the normal before it is quantised, so that a zero component comes with either.
  static std::uint16_t negate(std::uint16_t code) { return code ^ kSigns; }
};

}  // namespace octant_slots

/// The code as printed: it rounds down in steps of 1/126 but reconstructs the third component as 127 - a - b
/// (equation 4.9), which is 1 to 3 too much: a normal in a coordinate plane x = 0 or y = 0 comes out in it,
/// one in z = 0 does not. Every normal of the positive octant within about 0.45° of +z has the code 0.
struct ThesisNormalCode : octant_slots::FlooredNormalCode<127> {
  static constexpr const char* name = "thesis";
};

/// The code of the article that the thesis cites (R. Baptista, Higher Accuracy Quantized Normals, GameDev.net
/// 2000). The third component is 126 - a - b, so the three add up to the sum that they were scaled to; it is
/// still 0 to 2 too large. 64 contents of the slots, none of which is ever packed, have a third component of
/// -1.
struct BaptistaNormalCode : octant_slots::FlooredNormalCode<126> {
  static constexpr const char* name = "baptista";
};

/// The code of the thesis with its two defects repaired: it rounds to the nearest step, and the decoder is
/// Baptista's. A component that is quantised to zero is positive, so that different codes are different
/// normals.
struct RoundedNormalCode {
  static constexpr const char* name = "rounded";

  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    using namespace octant_slots;
    const Projection at = project(normal, kSlotLevels * kStep);
    int a = nearest_step(at.a), b = nearest_step(at.b);
    // Both were rounded up where they add up to 127; the one that gained more goes back.
    const int excess = sign_mask(kSlotLevels - a - b);
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
    const int c = octant_slots::kSlotLevels - a - b;
    return std::uint32_t((-a & 1 << 20) >> 5 | (-b & 1 << 20) >> 6 | (-c & 1 << 20) >> 7);
  }
};

/// The octahedral map with eight bits for each of its two coordinates (Meyer et al., On Floating-Point Normal
/// Vectors, 2010; Cigolle et al., A Survey of Efficient Representations for Independent Unit Vectors, JCGT
/// 2014). The octahedron |x| + |y| + |z| = 127 is seen along z: (x, y) is the code of the upper half, and the
/// lower half is folded outwards over the diagonals to fill the square from -127 to 127. Along the square's
/// border the fold joins points in pairs, and all four corners; they have the code with the positive
/// coordinates.
struct OctahedralNormalCode {
  static constexpr const char* name = "octahedral";
  static constexpr int kExtent = 127;

  /// Rounds both coordinates to the nearest step.
  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    const octant_slots::Projection at = octant_slots::project(normal, kExtent * octant_slots::kStep);
    return of_lattice(octant_slots::nearest_step(at.a), octant_slots::nearest_step(at.b), at.negative);
  }

  /// Decodes without a table. A table of weights, as the other codes have, is no faster; one of all 65,536
  /// normals is, by four times in a loop that does nothing else, but its 768 KiB evict everything else from
  /// the caches for a gain of 3 ns, where the equations that are solved with each normal take more than a
  /// hundred.
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
  /// A point with integer coordinates on the octahedron.
  struct Lattice {
    int x, y, z;
  };

  [[gnu::always_inline]] static int sign_mask(int value) { return octant_slots::sign_mask(value); }
  [[gnu::always_inline]] static int negated_if(int mask, int value) {
    return octant_slots::negated_if(mask, value);
  }
  static int magnitude(int value) { return negated_if(sign_mask(value), value); }

  /// Returns the code of a point by the magnitudes of x and y and all three signs. Magnitudes that add up to
  /// 128, both rounded up, lie beyond the equator, which is where the square has them, too.
  [[gnu::always_inline]] static std::uint16_t of_lattice(int x, int y, std::uint32_t negative) {
    const int signs = int(negative);
    const int folded = (kExtent - x - y) & -(signs >> 13 & 1);
    const int u = x + folded, v = y + folded;
    // Negative where the sign bit is set, but not on the border's other half.
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

/// The octahedral code with the rounding that suits its lattice. On a face of the octahedron the points with
/// integer coordinates form a lattice of equilateral triangles. Rounding two of the three coordinates takes a
/// point of a parallelogram about it; the nearest point of the lattice needs all three (Conway and Sloane,
/// Fast Quantizing and Decoding, 1982, algorithm for A2): round each, and where they no longer add up, move
/// the one that was rounded furthest. The same 16 bits, and a third off the largest error.
struct NearestNormalCode : OctahedralNormalCode {
  static constexpr const char* name = "nearest";

  [[gnu::always_inline]] static std::uint16_t pack(const std::array<float, 3>& normal) {
    using namespace octant_slots;
    const Projection at = project(normal, kExtent * kStep);
    const int a = nearest_step(at.a), b = nearest_step(at.b), c = nearest_step(at.c);
    const int missing = kExtent - a - b - c;  // -1, 0 or 1
    // How far each was moved the wrong way: down where one is missing, up where there is one too many.
    const int way = sign_mask(missing);
    const int of_a = negated_if(way, below(at.a, a));
    const int of_b = negated_if(way, below(at.b, b));
    const int of_c = negated_if(way, below(at.c, c));
    const int a_most = ~sign_mask(of_a - of_b) & ~sign_mask(of_a - of_c);
    const int b_most = ~sign_mask(of_b - of_c) & ~a_most;
    return of_lattice(a + (a_most & missing), b + (b_most & missing), at.negative);
  }
};

static_assert(NormalCode<ThesisNormalCode> && NormalCode<BaptistaNormalCode> &&
              NormalCode<RoundedNormalCode> && NormalCode<OctahedralNormalCode> &&
              NormalCode<NearestNormalCode>);

/// Calls f(code) with an empty object of the code's type: with_normal_code(id, [](auto code) { using Code =
/// decltype(code); … }).
template <class Function>
decltype(auto) with_normal_code(NormalCodeId id, Function&& f) {
  switch (id) {
    case NormalCodeId::thesis:
      return f(ThesisNormalCode{});
    case NormalCodeId::baptista:
      return f(BaptistaNormalCode{});
    case NormalCodeId::rounded:
      return f(RoundedNormalCode{});
    case NormalCodeId::octahedral:
      return f(OctahedralNormalCode{});
    case NormalCodeId::nearest:
      break;
  }
  return f(NearestNormalCode{});
}

}  // namespace hermesh
