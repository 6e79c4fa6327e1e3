#include "algorithms/hermite/normal_code.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/hermite/normal_codes.h"

namespace hermesh {
namespace normal_code_test {

using Normal = std::array<float, 3>;

constexpr int kCodes = 65'536;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

Normal opposite(const Normal& n) { return {-n[0], -n[1], -n[2]}; }

double length(const Normal& n) { return std::hypot(double(n[0]), double(n[1]), double(n[2])); }

/// Angle between two vectors in degrees, by the arc tangent, because the arc cosine loses half of the digits
/// of a small angle.
double degrees_between(const Normal& p, const Normal& q) {
  const double x = double(p[1]) * q[2] - double(p[2]) * q[1], y = double(p[2]) * q[0] - double(p[0]) * q[2],
               z = double(p[0]) * q[1] - double(p[1]) * q[0];
  const double dot = double(p[0]) * q[0] + double(p[1]) * q[1] + double(p[2]) * q[2];
  return std::atan2(std::hypot(x, y, z), dot) * 180.0 / std::numbers::pi;
}

/// A million points that cover the sphere evenly: the spherical Fibonacci lattice.
const std::vector<Normal>& sphere() {
  static const std::vector<Normal> points = [] {
    constexpr int kPoints = 1'000'000;
    const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
    std::vector<Normal> made;
    for (int i = 0; i < kPoints; ++i) {
      const double z = 1.0 - (2.0 * i + 1.0) / kPoints, r = std::sqrt(1.0 - z * z);
      made.push_back(
          {float(r * std::cos(golden_angle * i)), float(r * std::sin(golden_angle * i)), float(z)});
    }
    return made;
  }();
  return points;
}

/// Normals in coordinate planes, on axes and diagonals, with both zeros: where codes fold and signs vanish.
std::vector<Normal> special_normals() {
  std::vector<Normal> normals;
  const std::array<float, 7> values = {0.0f, -0.0f, 1.0f, -1.0f, 63.0f, -64.0f, 1e-9f};
  for (const float x : values)
    for (const float y : values)
      for (const float z : values)
        if (x != 0.0f || y != 0.0f || z != 0.0f) normals.push_back({x, y, z});
  return normals;
}

/// The codes that pack() returns for the sphere and the special normals.
template <class Code>
const std::set<std::uint16_t>& packed_codes() {
  static const std::set<std::uint16_t> codes = [] {
    std::vector<bool> used(kCodes);
    for (const Normal& n : sphere()) used[Code::pack(n)] = true;
    for (const Normal& n : special_normals()) used[Code::pack(n)] = true;
    std::set<std::uint16_t> found;
    for (int code = 0; code < kCodes; ++code)
      if (used[std::size_t(code)]) found.insert(std::uint16_t(code));
    return found;
  }();
  return codes;
}

template <class Code>
class NormalCodes : public testing::Test {};
using AllCodes = testing::Types<ThesisNormalCode, BaptistaNormalCode, RoundedNormalCode, OctahedralNormalCode,
                                NearestNormalCode>;
TYPED_TEST_SUITE(NormalCodes, AllCodes);

/// Properties of codes that round to the nearest step, and not of those that floor.
template <class Code>
class RoundingNormalCodes : public testing::Test {};
using RoundingCodes = testing::Types<RoundedNormalCode, OctahedralNormalCode, NearestNormalCode>;
TYPED_TEST_SUITE(RoundingNormalCodes, RoundingCodes);

template <class Code>
constexpr bool kFloors = std::is_same_v<Code, ThesisNormalCode> || std::is_same_v<Code, BaptistaNormalCode>;

TYPED_TEST(NormalCodes, UnpackToUnitLengthWhateverTheCode) {
  for (int code = 0; code < kCodes; ++code)
    ASSERT_NEAR(length(TypeParam::unpack(std::uint16_t(code))), 1.0, 1e-6) << code;
}

TYPED_TEST(NormalCodes, HaveANegationWithoutFixedPoints) {
  for (const std::uint16_t code : packed_codes<TypeParam>()) {
    const std::uint16_t negated = TypeParam::negate(code);
    ASSERT_NE(negated, code);
    ASSERT_EQ(TypeParam::negate(negated), code);
    ASSERT_EQ(TypeParam::unpack(negated), opposite(TypeParam::unpack(code))) << code;
  }
}

/// For the codes that floor, the code of -n is determined by n only where no component is zero (below), and a
/// sweep does not reach all of their codes. For the others the sweep finds every existing code.
TYPED_TEST(RoundingNormalCodes, NegateToCodesThatArePacked) {
  for (const std::uint16_t code : packed_codes<TypeParam>())
    ASSERT_TRUE(packed_codes<TypeParam>().contains(TypeParam::negate(code))) << code;
}

/// The codes that floor reconstruct a component that was zero as one that is not, so its lost sign matters;
/// and the octahedral map rounds some normals of the plane z = 0 into the lower half, and their opposites,
/// too.
template <class Code>
bool keeps_signs(const Normal& n) {
  if (kFloors<Code>) return n[0] != 0.0f && n[1] != 0.0f && n[2] != 0.0f;
  return !std::is_same_v<Code, OctahedralNormalCode> || n[2] != 0.0f;
}

TYPED_TEST(NormalCodes, CommuteWithNegation) {
  const auto commutes = [](const Normal& n) {
    return !keeps_signs<TypeParam>(n) ||
           TypeParam::pack(opposite(n)) == TypeParam::negate(TypeParam::pack(n));
  };
  for (const Normal& n : special_normals()) ASSERT_TRUE(commutes(n)) << n[0] << ' ' << n[1] << ' ' << n[2];
  for (const Normal& n : sphere()) ASSERT_TRUE(commutes(n)) << n[0] << ' ' << n[1] << ' ' << n[2];
}

TYPED_TEST(NormalCodes, TakeBothZerosForTheSame) {
  for (const Normal& n : special_normals()) {
    const Normal positive_zeros = {n[0] + 0.0f, n[1] + 0.0f, n[2] + 0.0f};
    ASSERT_EQ(TypeParam::pack(n), TypeParam::pack(positive_zeros));
  }
}

/// The thesis reconstructs a steeper third component than it packed, and Baptista's normals lie on the edge
/// of those that have their code, where a rounding error decides: only the codes that round come back.
TYPED_TEST(RoundingNormalCodes, ComeBackFromTheirNormals) {
  std::set<Normal> normals;
  for (const std::uint16_t code : packed_codes<TypeParam>()) {
    ASSERT_EQ(TypeParam::pack(TypeParam::unpack(code)), code);
    normals.insert(TypeParam::unpack(code));
  }
  EXPECT_EQ(normals.size(), packed_codes<TypeParam>().size()) << "two codes are the same normal";
}

/// Normals a step further into their cells than Baptista's rounding error could take them.
TEST(BaptistaNormalCode, ComesBackFromANormalJustInsideOfItsCell) {
  for (const std::uint16_t code : packed_codes<BaptistaNormalCode>()) {
    Normal n = BaptistaNormalCode::unpack(code);
    const octant_slots::Components at = octant_slots::unfold(code);
    if (at.a + at.b >= 126) continue;  // no third component to take from
    for (std::size_t i = 0; i < 3; ++i) {
      const float quantised = float(i == 0 ? at.a : i == 1 ? at.b : 126 - at.a - at.b);
      n[i] = std::copysign(quantised + (i < 2 ? 0.01f : -0.02f), n[i]);
    }
    ASSERT_EQ(BaptistaNormalCode::pack(n), code);
  }
}

TYPED_TEST(NormalCodes, IgnoreLength) {
  for (const Normal& n : special_normals())
    for (const float factor : {0x1p-60f, 0x1p60f})
      ASSERT_EQ(TypeParam::pack({n[0] * factor, n[1] * factor, n[2] * factor}), TypeParam::pack(n));
}

TYPED_TEST(NormalCodes, GiveTheCodeOfZToWhatHasNoDirection) {
  EXPECT_EQ(TypeParam::pack({0.0f, 0.0f, 1.0f}), 0);
  EXPECT_EQ(TypeParam::unpack(0), (Normal{0.0f, 0.0f, 1.0f}));
  for (const float bad : {kNan, -kNan, kInfinity, -kInfinity})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Normal n = {-1.0f, -1.0f, -1.0f};
      n[axis] = bad;
      EXPECT_EQ(TypeParam::pack(n), 0);
    }
  EXPECT_EQ(TypeParam::pack({0.0f, -0.0f, -0.0f}), 0);
  EXPECT_EQ(TypeParam::pack({-1e-38f, 1e-44f, -0.0f}), 0);
  EXPECT_EQ(TypeParam::pack({-3e38f, 3e38f, 3e38f}), 0) << "the sum is infinite";
}

TYPED_TEST(NormalCodes, OrderIsReversedByNegation) {
  const auto& codes = packed_codes<TypeParam>();
  std::set<int> orders;
  for (const std::uint16_t code : codes) {
    ASSERT_EQ(order<TypeParam>(TypeParam::negate(code)), -1 - order<TypeParam>(code));
    orders.insert(order<TypeParam>(code));
  }
  EXPECT_EQ(orders.size(), codes.size()) << "two codes tie";
}

struct Figures {
  double mean, max;  ///< degrees
  std::size_t codes;
};
Figures figures(ThesisNormalCode) { return {1.32, 2.56, 64'008}; }
Figures figures(BaptistaNormalCode) { return {0.81, 1.92, 64'008}; }
Figures figures(RoundedNormalCode) { return {0.34, 0.96, 4 * 126 * 126 + 2}; }
Figures figures(OctahedralNormalCode) { return {0.34, 0.95, 4 * 127 * 127 + 2}; }
Figures figures(NearestNormalCode) { return {0.315, 0.636, 4 * 127 * 127 + 2}; }

/// An octahedron whose faces have n steps along an edge has 4 n² + 2 points. Flooring leaves 8 octants of 127
/// · 126 / 2 cells.
TYPED_TEST(NormalCodes, HaveTheErrorsThatAreKnown) {
  double sum = 0.0, largest = 0.0;
  std::vector<bool> used(kCodes);
  for (const Normal& n : sphere()) {
    const std::uint16_t code = TypeParam::pack(n);
    const double error = degrees_between(n, TypeParam::unpack(code));
    sum += error;
    largest = std::max(largest, error);
    used[code] = true;
  }
  const Figures expected = figures(TypeParam{});
  EXPECT_NEAR(sum / double(sphere().size()), expected.mean, 0.02 * expected.mean);
  EXPECT_NEAR(largest, expected.max, 0.02 * expected.max);
  EXPECT_EQ(std::size_t(std::count(used.begin(), used.end(), true)), expected.codes);
}

TEST(ThesisNormalCode, ByHand) {
  // (1, 2, 3) / 6 · 126 = (21, 42, 63), and the third becomes 127 - 63 = 64. A little more of x and y keeps
  // the quotients off the edge of a step.
  const std::uint16_t code = ThesisNormalCode::pack({1.001f, -2.001f, 3.0f});
  EXPECT_EQ(code, 0x4000 | 21 << 6 | 42);
  const float weight = float(1.0 / std::sqrt(21.0 * 21 + 42.0 * 42 + 64.0 * 64));
  EXPECT_EQ(ThesisNormalCode::unpack(code), (Normal{21 * weight, -42 * weight, 64 * weight}));
  // b = 94 does not fit into six bits: a = 127 - 31 and b = 127 - 94 are stored (equation 4.7).
  const std::uint16_t folded = ThesisNormalCode::pack({1.001f, 3.005f, 0.0f});
  EXPECT_EQ(folded, (127 - 31) << 6 | (127 - 94));
  EXPECT_EQ(octant_slots::unfold(folded).a, 31u);
  EXPECT_EQ(octant_slots::unfold(folded).b, 94u);
}

/// §4.1: 2^13 = 8192 weights of four bytes, 32 kilobytes; each makes a unit vector of its slot's components.
TEST(ThesisNormalCode, TheTableHasAWeightForEachSlot) {
  const auto& weights = octant_slots::kWeights<127>;
  EXPECT_EQ(weights.size(), 8192u);
  EXPECT_EQ(sizeof weights, 32u * 1024u);
  for (std::uint32_t a = 0; a <= 126; ++a) {
    for (std::uint32_t b = 0; a + b <= 126; ++b) {
      const double c = 127.0 - a - b;
      EXPECT_NEAR(weights[octant_slots::fold(a, b)] * std::sqrt(double(a) * a + double(b) * b + c * c), 1.0,
                  1e-6)
          << a << ' ' << b;
    }
  }
}

/// Trap: the thesis takes the code 0 on x- and y-edges for "no crossing" (§4.2). x + y must stay below 1/126
/// of the sum, so the cone's half angle is between atan(1/125)/√2 and atan(1/125) = 0.458°.
TEST(ThesisNormalCode, IsZeroForNormalsOfThePositiveOctantNearZ) {
  const auto towards_x = [](double degrees) {
    const double angle = degrees * std::numbers::pi / 180.0;
    return Normal{float(std::sin(angle)), 0.0f, float(std::cos(angle))};
  };
  EXPECT_EQ(ThesisNormalCode::pack(towards_x(0.3)), 0);
  EXPECT_EQ(ThesisNormalCode::pack(towards_x(0.45)), 0);
  EXPECT_NE(ThesisNormalCode::pack(towards_x(0.46)), 0);
  EXPECT_NE(ThesisNormalCode::pack(towards_x(-0.3)), 0) << "its sign bit is set";
  int lost = 0;
  for (const Normal& n : sphere()) lost += ThesisNormalCode::pack(n) == 0;
  // Of the sphere's million, by the solid angle of a square of side 1/125: 1 / (125² · 4π).
  EXPECT_NEAR(lost, 1e6 / (125.0 * 125.0 * 4.0 * std::numbers::pi), 1.0);
}

TEST(RoundedNormalCode, KeepsTheSumWhereTwoComponentsRoundUp) {
  // (63.5, 62.5 + 0.1, -0.1): both round up, to 64 + 63 = 127; 64 gained more.
  EXPECT_EQ(RoundedNormalCode::pack({63.5f, 62.6f, 0.0f}), 63 << 6 | 63);
  for (const Normal& n : sphere()) {
    const octant_slots::Components at = octant_slots::unfold(RoundedNormalCode::pack(n));
    ASSERT_LE(at.a + at.b, 126u);
  }
}

TEST(OctahedralNormalCode, ByHand) {
  // The upper half is (x, y) itself; the lower one is folded out: u = 127 - |y|, v = 127 - |x|.
  EXPECT_EQ(OctahedralNormalCode::pack({20.0f, 30.0f, 77.0f}), 20 << 8 | 30);
  EXPECT_EQ(OctahedralNormalCode::pack({20.0f, 30.0f, -77.0f}), 97 << 8 | 107);
  EXPECT_EQ(OctahedralNormalCode::pack({-20.0f, 30.0f, -77.0f}), (256 - 97) << 8 | 107);
  // -z is all four corners of the square, and (0, -20, -107) both (107, -127) and (-107, -127).
  EXPECT_EQ(OctahedralNormalCode::pack({-0.0f, 0.0f, -1.0f}), 127 << 8 | 127);
  EXPECT_EQ(OctahedralNormalCode::pack({-1e-9f, -20.0f, -107.0f}), 107 << 8 | (256 - 127));
}

/// The code of `nearest` is the nearest point of the lattice on the face, verified by testing all points
/// nearby.
TEST(NearestNormalCode, IsNearestOnTheFace) {
  std::mt19937 generator(7);
  std::uniform_real_distribution<double> coordinate(0.0, 127.0);
  for (int trial = 0; trial < 20'000; ++trial) {
    const double a = coordinate(generator), b = coordinate(generator), c = 127.0 - a - b;
    if (c < 0.0) continue;
    const auto squared = [&](double x, double y) {
      return (x - a) * (x - a) + (y - b) * (y - b) + (127.0 - x - y - c) * (127.0 - x - y - c);
    };
    double best = 1e9;
    for (int x = int(a) - 1; x <= int(a) + 2; ++x)
      for (int y = int(b) - 1; y <= int(b) + 2; ++y)
        if (x >= 0 && y >= 0 && x + y <= 127) best = std::min(best, squared(x, y));
    const std::uint16_t code = NearestNormalCode::pack({float(a), float(b), float(c)});
    ASSERT_NEAR(squared(code >> 8, code & 255), best, 1e-3) << a << ' ' << b;
  }
}

TEST(NormalCodeNames, AreParsedBack) {
  for (const NormalCodeId id : kNormalCodes) EXPECT_EQ(parse_normal_code(name(id)), id);
  EXPECT_EQ(name(NormalCodeId::octahedral), "octahedral");
  try {
    parse_normal_code("spherical");
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "there is no normal code \"spherical\"; there are thesis, baptista, rounded, octahedral, "
                 "nearest");
  }
}

}  // namespace normal_code_test
}  // namespace hermesh
