#include "algorithms/thesis/voxels/voxels.h"

#include <gtest/gtest.h>

#include <random>

#include "algorithms/hermite/normal_codes.h"

namespace hermesh {
namespace voxels_test {

// Tables 2.2 and §4.2: twelve floats and the flags; three floats; ten bytes, for which OpenVDB makes arrays
// without gaps (trap T3).
static_assert(sizeof(FloatVoxel) == 12 * 4 + 4 && sizeof(DirectedVoxel) == 3 * 4);
static_assert(sizeof(ThesisVoxel[2]) == 20 && sizeof(FixedVoxel[2]) == 20);
static_assert(alignof(ThesisVoxel) == 2 && alignof(FixedVoxel) == 2);

template <class Voxel>
void set(Voxel& voxel, int axis, const EdgeCrossing& crossing) {
  if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    voxel.template set<OctahedralNormalCode>(axis, crossing);
  else
    voxel.set(axis, crossing);
}
template <class Voxel>
EdgeCrossing get(const Voxel& voxel, int axis) {
  if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    return voxel.template get<OctahedralNormalCode>(axis);
  else
    return voxel.get(axis);
}

template <class Voxel>
class Voxels : public testing::Test {};
using AllVoxels = testing::Types<FloatVoxel, DirectedVoxel, ThesisVoxel, FixedVoxel>;
TYPED_TEST_SUITE(Voxels, AllVoxels);

TYPED_TEST(Voxels, ANewOneIsOutsideWithoutCrossings) {
  const TypeParam voxel;
  EXPECT_FALSE(voxel.inside());
  for (int axis = 0; axis < 3; ++axis) EXPECT_FALSE(voxel.crosses(axis));
}

TYPED_TEST(Voxels, SignAndEdgesDoNotTouchEachOther) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> offset(0.0f, 1.0f);
  TypeParam voxel;
  std::array<bool, 3> crossed{};
  std::array<EdgeCrossing, 3> expected{};
  bool inside = false;
  for (int step = 0; step < 2000; ++step) {
    const int axis = static_cast<int>(random() % 3);
    if (random() % 4 == 0) {
      voxel.set_inside(inside = random() % 2);
    } else if ((crossed[axis] = random() % 2)) {
      set(voxel, axis, {offset(random), {-0.6f, 0.0f, 0.8f}});
      expected[axis] = get(voxel, axis);
    } else {
      voxel.clear(axis);
    }
    ASSERT_EQ(voxel.inside(), inside);
    for (int a = 0; a < 3; ++a) {
      ASSERT_EQ(voxel.crosses(a), crossed[a]);
      if (!crossed[a]) continue;
      ASSERT_EQ(get(voxel, a).offset, expected[a].offset);
      // A directed distance knows no normal but the edge's direction, which turns with the sign.
      if constexpr (!std::is_same_v<TypeParam, DirectedVoxel>) {
        ASSERT_EQ(get(voxel, a).normal, expected[a].normal);
      }
    }
  }
}

TYPED_TEST(Voxels, ClearingAndTheSignLeaveNothingBehind) {
  TypeParam voxel;
  for (int axis = 0; axis < 3; ++axis) set(voxel, axis, {0.75f, {0.6f, 0.0f, -0.8f}});
  voxel.set_inside(true);
  EXPECT_FALSE(voxel == TypeParam{});
  for (int axis = 0; axis < 3; ++axis) voxel.clear(axis);
  EXPECT_TRUE(voxel == -TypeParam{});
  voxel.set_inside(false);
  EXPECT_TRUE(voxel == TypeParam{});
}

TYPED_TEST(Voxels, InsideIsLessThanOutsideAndItsNegative) {
  const TypeParam outside, inside = -outside;
  EXPECT_TRUE(inside < outside && outside > inside);
  EXPECT_FALSE(outside < inside || inside < inside || outside < outside);
  EXPECT_TRUE(-inside == outside);
  EXPECT_TRUE(inside + outside == inside && inside - outside == inside);
}

TEST(FloatVoxel, KeepsEveryBit) {
  const EdgeCrossing crossing{0.123456789f, {0.36f, -0.48f, 0.8f}};
  FloatVoxel voxel;
  voxel.set(1, crossing);
  EXPECT_EQ(voxel.get(1), crossing);
  EXPECT_FALSE(voxel.crosses(0) || voxel.crosses(2));
}

TEST(DirectedVoxel, IsThreeSignedDistances) {
  DirectedVoxel voxel;
  EXPECT_EQ(voxel.distances(), (std::array{2.0f, 2.0f, 2.0f}));
  voxel.set(0, {0.0f, {1, 0, 0}});
  voxel.set(2, {1.0f, {0, 0, 1}});
  voxel.set_inside(true);
  EXPECT_EQ(voxel.distances(), (std::array{-0.0f, -2.0f, -1.0f}));
  // At a distance of zero only the sign bit marks the voxel as inside, and it differs from the one outside.
  EXPECT_TRUE(voxel.inside() && voxel.crosses(0) && !voxel.crosses(1) && voxel.crosses(2));
  EXPECT_FALSE(voxel == -voxel);
  EXPECT_EQ(voxel.get(2).normal, (std::array{0.0f, 0.0f, 1.0f}));
  EXPECT_EQ((-voxel).get(2).normal, (std::array{0.0f, 0.0f, -1.0f}));
}

TEST(DirectedVoxel, HoldsOffsetsWithinTheEdge) {
  DirectedVoxel voxel;
  voxel.set(0, {-0.5f, {}});
  voxel.set(1, {1.5f, {}});
  voxel.set(2, {std::nanf(""), {}});
  EXPECT_EQ(voxel.distances(), (std::array{0.0f, 1.0f, 0.0f}));
}

// Figure 4.2: sign, validity of z, and ten bits each for x, y and z; after the three normals.
TEST(ThesisVoxel, HasThePrintedLayout) {
  ThesisVoxel voxel;
  voxel.set_inside(true);
  voxel.set(0, {0.5f, {1, 0, 0}});
  voxel.set(1, {0.25f, {0, 1, 0}});
  voxel.set(2, {0.125f, {0, 0, 1}});
  const auto words = std::bit_cast<std::array<std::uint16_t, 5>>(voxel);
  EXPECT_EQ(words[0], ThesisNormalCode::pack({1, 0, 0}));
  EXPECT_EQ(words[1], ThesisNormalCode::pack({0, 1, 0}));
  EXPECT_EQ(words[2], 0);  // the code of +z
  // ⌊1023/2⌋, ⌊1023/4⌋ and ⌊1023/8⌋
  EXPECT_EQ(words[3] | (std::uint32_t{words[4]} << 16), (3u << 30) | (511u << 20) | (255u << 10) | 127u);
  EXPECT_TRUE(voxel.crosses(2));
}

// Trap T2: the code of a normal within about 0.45° of +z is 0, which on the edges along x and y means no
// data.
TEST(ThesisVoxel, LosesCrossingsWithNormalsAlongZ) {
  const float angle = 0.3f * 3.14159265f / 180.0f;
  const EdgeCrossing nearly_z{0.5f, {std::sin(angle), 0.0f, std::cos(angle)}};
  ThesisVoxel thesis;
  FixedVoxel fixed;
  for (int axis = 0; axis < 3; ++axis) {
    thesis.set(axis, nearly_z);
    EXPECT_EQ(thesis.crosses(axis), axis == 2) << axis;
    fixed.set<ThesisNormalCode>(axis, nearly_z);  // even in the same code
    EXPECT_TRUE(fixed.crosses(axis));
  }
}

// Trap T4.
TEST(ThesisVoxel, OffsetsAreRoundedDownToBelowOne) {
  EXPECT_EQ(ThesisVoxel::quantize(0.0f), 0);
  EXPECT_EQ(ThesisVoxel::quantize(static_cast<float>(1 - 1e-9)), 1022);  // is 1 in single precision
  EXPECT_EQ(ThesisVoxel::quantize(1.0f), 1022);
  EXPECT_EQ(ThesisVoxel::quantize(std::nextafter(1.0f, 0.0f)), 1022);
  EXPECT_EQ(ThesisVoxel::quantize(std::nanf("")), 0);
  EXPECT_EQ(ThesisVoxel::quantize(-1.0f), 0);
}

// §4.2 counts one multiplication and shifts for packing a distance.
TEST(ThesisVoxel, ADistanceIsPackedByOneProductAndAShift) {
  for (int i = 0; i < 4096; ++i) {
    const float offset = static_cast<float>(i) / 4096;
    const auto code = static_cast<std::uint32_t>(offset * 1023.0f);
    ThesisVoxel voxel;
    for (int axis = 0; axis < 3; ++axis) voxel.set(axis, {offset, {1, 0, 0}});
    const auto words = std::bit_cast<std::array<std::uint16_t, 5>>(voxel);
    const std::uint32_t word = words[3] | (std::uint32_t{words[4]} << 16);
    EXPECT_EQ(word & ((1u << 30) - 1), code << 20 | code << 10 | code) << offset;
    EXPECT_EQ(voxel.get(1).offset, static_cast<float>(code) / 1023.0f) << offset;
  }
}

/// Mean and greatest error of offsets, in steps of the code, over a million of them at equal distances.
template <class Voxel>
std::array<double, 3> offset_errors(double step) {
  constexpr int kCount = 1000003;  // a prime, so that no step is favoured
  double sum = 0, least = 0, greatest = 0;
  Voxel voxel;
  for (int i = 0; i < kCount; ++i) {
    const float offset = static_cast<float>((i + 0.5) / kCount);
    set(voxel, 0, {offset, {1, 0, 0}});
    const double error = (double{get(voxel, 0).offset} - double{offset}) / step;
    sum += error, least = std::min(least, error), greatest = std::max(greatest, error);
  }
  return {sum / kCount, least, greatest};
}

TEST(ThesisVoxel, OffsetsAreHalfAStepTooSmall) {
  const auto [mean, least, greatest] = offset_errors<ThesisVoxel>(1.0 / 1023);
  EXPECT_NEAR(mean, -0.5, 1e-3);
  EXPECT_NEAR(least, -1.0, 1e-3);
  EXPECT_NEAR(greatest, 0.0, 1e-3);
}

TEST(FixedVoxel, OffsetsHaveNoBias) {
  const auto [mean, least, greatest] = offset_errors<FixedVoxel>(1.0 / 1022);
  EXPECT_NEAR(mean, 0.0, 1e-4);
  EXPECT_NEAR(least, -0.5, 1e-3);
  EXPECT_NEAR(greatest, 0.5, 1e-3);
}

TEST(FixedVoxel, BothEndsOfTheEdgeAreExact) {
  FixedVoxel voxel;
  for (const float offset : {0.0f, 1.0f}) {
    voxel.set<NearestNormalCode>(1, {offset, {0, 1, 0}});
    EXPECT_TRUE(voxel.crosses(1));
    EXPECT_EQ(voxel.get<NearestNormalCode>(1).offset, offset);
  }
  voxel.set<NearestNormalCode>(1, {static_cast<float>(1 - 1e-9), {0, 1, 0}});
  EXPECT_EQ(voxel.get<NearestNormalCode>(1).offset, 1.0f);
}

TEST(FixedVoxel, KeepsEveryCode) {
  for (const std::uint16_t offset : {0, 1, 511, 1022})
    for (int normal = 0; normal < 65536; ++normal) {
      FixedVoxel voxel;
      for (int axis = 0; axis < 3; ++axis) {
        const auto code = static_cast<std::uint16_t>(normal * (axis + 1));
        voxel.set_raw(axis, code, static_cast<std::uint16_t>(offset >> axis));
      }
      for (int axis = 0; axis < 3; ++axis) {
        ASSERT_TRUE(voxel.crosses(axis));
        ASSERT_EQ(voxel.normal(axis), static_cast<std::uint16_t>(normal * (axis + 1)));
        ASSERT_EQ(voxel.offset(axis), offset >> axis);
      }
      ASSERT_FALSE(voxel.inside());
    }
}

}  // namespace voxels_test
}  // namespace hermesh
