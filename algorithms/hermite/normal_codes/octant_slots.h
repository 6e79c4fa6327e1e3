// What the normal codes of chapter 4 of the thesis (Aldén 2011) share: three sign bits, and two components of
// the normal's projection into the first octant in the other 13 bits (figure 4.1).
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace hermesh::octant_slots {

/// Bits 15, 14, 13 are set where x, y, z are negative.
inline constexpr std::uint16_t kSigns = 0xE000, kSlots = 0x1FFF;
/// The components are quantised in the range 0 to 126 (equations 4.5 and 4.6).
inline constexpr int kLevels = 126;
/// A vector whose components' magnitudes add up to no more, or to no number, has no direction. Above it, the
/// quotients below are finite.
inline constexpr float kShortest = 1e-30f;

struct Components {
  std::uint32_t a, b;
};

/// A normal's projection into the first octant's plane (equations 4.3 and 4.4), times a number of levels: the
/// three add up to it, but for rounding.
struct Projection {
  float a, b, c;
  std::uint32_t negative;  ///< bits 15, 14, 13, as in a code
};

/// Steps 1 and 2 of §4.1, by one division. What has no direction is taken for +z. Negative zero counts as
/// positive. Masks stand in for branches, with which compilers would not turn loops over normals into vector
/// code.
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

/// Equation 4.7: a component b of 64 or more does not fit into its six bits, and the complements of both
/// components are stored instead. The condition is that on b before either is replaced.
[[gnu::always_inline]] inline std::uint16_t fold(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t complement = (b >> 6) * 127u;  // of seven bits: 127 - a is a ^ 127
  return std::uint16_t((a ^ complement) << 6 | (b ^ complement));
}

/// Equation 4.8. Complements add up to 254 - a - b, that is to 127 and more, and components to 126 and less.
constexpr Components unfold(std::uint16_t code) {
  const std::uint32_t a = (code >> 6) & 127u, b = code & 63u;
  const std::uint32_t complement = ((a + b + 1) >> 7) * 127u;  // the sum is at most 190
  return {a ^ complement, b ^ complement};
}

/// Newton's iteration from above, which decreases until it has arrived; std::sqrt is not constexpr.
constexpr double square_root(double value) {
  double root = value > 1.0 ? value : 1.0;
  for (double next = 0.5 * (root + value / root); next < root; next = 0.5 * (root + value / root))
    root = next;
  return root;
}

/// Equation 4.10 for every content of the slots, 32 KiB. The third component is kSum - a - b: the thesis
/// takes 127 (equation 4.9), the article that it cites 126. Made at compile time, since a table that is
/// filled at start-up can be read before it is full.
template <int kSum>
constexpr std::array<float, kSlots + 1> make_weights() {
  std::array<float, kSlots + 1> weights{};
  for (std::size_t slots = 0; slots < weights.size(); ++slots) {
    const Components at = unfold(std::uint16_t(slots));
    const int a = int(at.a), b = int(at.b), c = kSum - a - b;
    weights[slots] = float(1.0 / square_root(double(a * a + b * b + c * c)));
  }
  return weights;
}
template <int kSum>
inline constexpr std::array<float, kSlots + 1> kWeights = make_weights<kSum>();

// What follows works on the projection in units of 1/65,536 of a step, as whole numbers, and takes all bits
// of a negative number's sign for a mask: both so that loops become vector code on every processor.

inline constexpr int kStep = 1 << 16;

[[gnu::always_inline]] constexpr int nearest_step(float value) { return (int(value) + kStep / 2) >> 16; }
/// How far below `value` its step lies, −kStep / 2 to kStep / 2.
[[gnu::always_inline]] constexpr int below(float value, int step) { return int(value) - step * kStep; }
[[gnu::always_inline]] constexpr int sign_mask(int value) { return value >> 31; }
[[gnu::always_inline]] constexpr int negated_if(int mask, int value) { return (value ^ mask) - mask; }

inline float with_sign(float magnitude, std::uint32_t sign_bit) {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(magnitude) ^ sign_bit);
}

/// The normal of a code: equations 4.8 to 4.13, and the signs.
template <int kSum>
std::array<float, 3> unpack(std::uint16_t code) {
  const Components at = unfold(code);
  const float weight = kWeights<kSum>[code & kSlots];
  const std::uint32_t bits = code;
  return {with_sign(float(int(at.a)) * weight, (bits & 0x8000u) << 16),
          with_sign(float(int(at.b)) * weight, (bits & 0x4000u) << 17),
          with_sign(float(kSum - int(at.a) - int(at.b)) * weight, (bits & 0x2000u) << 18)};
}

/// Code of a normal by step 3 as printed (equations 4.5 and 4.6), which rounds down.
[[gnu::always_inline]] inline std::uint16_t pack_rounding_down(const std::array<float, 3>& normal) {
  const Projection at = project(normal, kLevels);
  return std::uint16_t(at.negative | fold(std::uint32_t(int(at.a)), std::uint32_t(int(at.b))));
}

}  // namespace hermesh::octant_slots
