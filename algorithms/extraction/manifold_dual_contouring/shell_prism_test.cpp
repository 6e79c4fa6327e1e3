#include "algorithms/extraction/manifold_dual_contouring/shell_prism.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <random>
#include <vector>

#include "algorithms/core/simd_level.h"
#include "algorithms/extraction/manifold_dual_contouring/kernels/shell_kernels.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

const Vector3d kUp = Vector3d::UnitZ();
const Corners kTriangle = {Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0)};

ShellPrism upright(double height) { return ShellPrism(kTriangle, {kUp, kUp, kUp}, height); }
Corners raised(Corners corners, double by) {
  for (Vector3d& corner : corners) corner.z() += by;
  return corners;
}

TEST(ShellPrism, StandsWherePillarsRiseAndKeepApart) {
  EXPECT_TRUE(upright(2).stands());
  EXPECT_FALSE(ShellPrism(kTriangle, {-kUp, -kUp, -kUp}, 2).stands()) << "they point down";
  EXPECT_FALSE(ShellPrism({kTriangle[0], kTriangle[1], 0.5 * kTriangle[1]}, {kUp, kUp, kUp}, 2).stands())
      << "no area";
  // Pillars that lean towards one another by 45 degrees meet 2 above the middle of the side of 4.
  const std::array<Vector3d, 3> leaning = {Vector3d(1, 0, 1).normalized(), Vector3d(-1, 0, 1).normalized(),
                                           kUp};
  EXPECT_TRUE(ShellPrism(kTriangle, leaning, 1).stands());
  EXPECT_FALSE(ShellPrism(kTriangle, leaning, 3).stands());
}

TEST(ShellPrism, MeetsWhatPassesThroughIt) {
  const ShellPrism prism = upright(1);
  const Corners wide = {Vector3d(-5, -5, 0), Vector3d(20, -5, 0), Vector3d(-5, 20, 0)};
  EXPECT_EQ(meet(prism, raised(wide, 0.5), 1), Meeting::good);
  EXPECT_EQ(meet(prism, raised(wide, -0.9), 1), Meeting::good);
  EXPECT_EQ(meet(prism, raised(wide, 0.5), 0.4), Meeting::bad) << "farther than its own tolerance";
  EXPECT_EQ(meet(prism, raised({wide[0], wide[2], wide[1]}, 0.5), 1), Meeting::bad) << "it faces down";
  EXPECT_EQ(meet(prism, raised(wide, 1.1), 1), Meeting::none) << "above the lid";
  EXPECT_EQ(meet(prism, {Vector3d(-1, 1, 0), Vector3d(-1, 1, 5), Vector3d(-2, 3, 0)}, 1), Meeting::none)
      << "beyond a wall";
  // Through the lid over the prism's inside, and through it beyond the walls alone.
  EXPECT_EQ(meet(prism, {Vector3d(1, 1, 0), Vector3d(2, 1, 0), Vector3d(1, 2, 3)}, 1), Meeting::bad);
  EXPECT_EQ(meet(prism, {Vector3d(1, 1, 0), Vector3d(1, 2, 0), Vector3d(-6, 1, 5)}, 1), Meeting::good);
}

TEST(ShellPrism, IsReachedIntoByWhatIsWithinEitherPillarsWall) {
  const ShellPrism prism = upright(1);
  EXPECT_TRUE(reaches_into(prism, {Vector3d(1, 1, 0), Vector3d(1.1, 1, 0), Vector3d(1, 1.1, 0)}));
  EXPECT_TRUE(reaches_into(prism, {Vector3d(-5, 1, 0.5), Vector3d(9, 1, 0.5), Vector3d(-5, 2, 0.5)}));
  EXPECT_FALSE(reaches_into(prism, {Vector3d(-2, 1, 0), Vector3d(-1, 1, 0), Vector3d(-1, 2, 0)}));
}

/// The lid lies lower than the height where pillars lean: what is between the two is not in the prism, and no
/// witness that S is.
TEST(ShellPrism, IsNotMetAboveALowLid) {
  const Vector3d leaning(0.6, 0, 0.8);
  const ShellPrism prism(kTriangle, {leaning, leaning, leaning}, 0.5);  // the lid is at 0.4
  ASSERT_TRUE(prism.stands());
  EXPECT_EQ(meet(prism, raised(kTriangle, 0.45), 1), Meeting::none);
  EXPECT_EQ(meet(prism, raised(kTriangle, 0.35), 1), Meeting::good);
  EXPECT_TRUE(reaches_into(prism, raised(kTriangle, 0.35)));
  // Above the lid and across it beyond the first wall.
  EXPECT_EQ(meet(prism, {Vector3d(1.2, -2, 0.3), Vector3d(1.9, 0.02, 0.46), Vector3d(1, 0.02, 0.46)}, 1),
            Meeting::none);
}

/// The planes of an upright prism over kTriangle: the third wall is x + y = 4.
shell_kernels::Planes planes(float height) {
  shell_kernels::Planes result{};
  const float s = std::sqrt(0.5f);
  const float normals[3][3] = {{0, -1, 0}, {s, s, 0}, {-1, 0, 0}};
  for (int wall = 0; wall < 3; ++wall)
    for (int end = 0; end < 2; ++end) {
      std::copy_n(normals[wall], 3, result.normals[2 * wall + end]);
      result.offsets[2 * wall + end] = wall == 1 ? 4 * s : 0;
    }
  result.normals[shell_kernels::Planes::kLid][2] = 1;
  result.normals[shell_kernels::Planes::kBottom][2] = -1;
  result.offsets[shell_kernels::Planes::kLid] = result.offsets[shell_kernels::Planes::kBottom] = height;
  result.rounding = 1e-3f;
  return result;
}

TEST(ShellKernels, TellWhereAPointIsAtEveryLevel) {
  using namespace shell_kernels;
  std::vector<float> x = {1, 1, 1, -1, 1, 5, -1, 1}, y = {1, 1, 1, 1, -1, 5, -1, 1},
                     z = {0, 2, -2, 0, 0, 2, 0, 1.0005f};
  const std::vector<int> expected = {kBetweenLids | kWithinWalls,
                                     kAboveLid | kWithinWalls,
                                     kBelowBottom | kWithinWalls,
                                     kBetweenLids | 4 * kBeyondWall,
                                     kBetweenLids | kBeyondWall,
                                     kAboveLid | 2 * kBeyondWall,
                                     kBetweenLids | kBeyondWall | 4 * kBeyondWall,
                                     kWithinWalls};
  // Random ones as far as 64, which the levels must agree about.
  std::mt19937 random(7);
  std::uniform_real_distribution<float> any(-3, 6);
  while (x.size() < kMost) x.push_back(any(random)), y.push_back(any(random)), z.push_back(any(random) / 3);
  for (auto* axis : {&x, &y, &z}) axis->resize(kMost + kLargestVector);
  std::vector<std::vector<std::uint8_t>> found;
  for (const SimdLevel level : available_simd_levels()) {
    setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
    std::vector<std::uint8_t>& out = found.emplace_back(kMost + kLargestVector);
    const Found all = chosen()({x.data(), y.data(), z.data(), kMost}, planes(1), out.data());
    out.resize(kMost);
    for (std::size_t i = 0; i < expected.size(); ++i)
      EXPECT_EQ(out[i], expected[i]) << i << " at " << name(level);
    for (std::size_t i = 0; i < kMost; ++i) {
      EXPECT_EQ((all.inside >> i) & 1,
                (out[i] & (kWithinWalls | kBetweenLids)) == (kWithinWalls | kBetweenLids))
          << i;
      EXPECT_EQ((all.beyond >> i) & 1, (out[i] & kWithinWalls) && (out[i] & (kAboveLid | kBelowBottom))) << i;
    }
    EXPECT_EQ(out, found.front()) << name(level);
    const Found three = chosen()({x.data(), y.data(), z.data(), 3}, planes(1),
                                 std::vector<std::uint8_t>(kMost + kLargestVector).data());
    EXPECT_EQ(three.inside, 1u);
    EXPECT_EQ(three.beyond, 6u);
  }
  unsetenv("HERMESH_SIMD");
}

}  // namespace
}  // namespace hermesh
