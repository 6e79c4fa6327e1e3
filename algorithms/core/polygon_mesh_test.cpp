#include "algorithms/core/polygon_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hermesh {
namespace polygon_mesh_test {

Bounds box_of(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
  Bounds box;
  box.add(lower);
  box.add(upper);
  return box;
}

TEST(PolygonMesh, QuadsAreSplitAlongTheirFirstDiagonal) {
  PolygonMesh mesh;
  mesh.points.resize(7, Eigen::Vector3f::Zero());
  mesh.triangles = {{4, 5, 6}};
  mesh.quads = {{0, 1, 2, 3}};
  EXPECT_EQ(triangulated(mesh), (std::vector<Triangle>{{4, 5, 6}, {0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(mesh.triangle_count(), 3u);
}

TEST(PolygonMesh, BoundsLeaveOutStrayPoints) {
  PolygonMesh mesh;
  mesh.origin = {100, 0, 0};
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 500}};
  EXPECT_TRUE(bounds(mesh).empty());
  EXPECT_EQ(bounds(mesh).size(), Eigen::Vector3d::Zero());
  mesh.triangles = {{0, 1, 2}};
  EXPECT_EQ(bounds(mesh).lower, Eigen::Vector3d(100, 0, 0));
  EXPECT_EQ(bounds(mesh).upper, Eigen::Vector3d(101, 2, 0));
}

TEST(ChooseOrigin, KeepsZeroUpToFourSidesAway) {
  EXPECT_EQ(choose_origin(Bounds()), Eigen::Vector3d::Zero());
  EXPECT_EQ(choose_origin(box_of({4, -5, 0}, {5, -4, 1})), Eigen::Vector3d::Zero());
  EXPECT_EQ(choose_origin(box_of({-1e308, 0, 0}, {1e308, 1, 1})), Eigen::Vector3d::Zero());
}

TEST(ChooseOrigin, WorksOnEachAxisByItselfAndRoundsToTheBox) {
  // The longest side is 3, so the origin is a multiple of 4; y and z are near enough to stay.
  EXPECT_EQ(choose_origin(box_of({1000.3, 0, -10}, {1003.3, 1, -9})), Eigen::Vector3d(1000, 0, 0));
  EXPECT_EQ(choose_origin(box_of({-1e6, 0, 0}, {1 - 1e6, 1, 1})), Eigen::Vector3d(-1e6, 0, 0));
}

TEST(ChooseOrigin, OfASinglePointIsThePoint) {
  EXPECT_EQ(choose_origin(box_of({0.1, 0, -7}, {0.1, 0, -7})), Eigen::Vector3d(0.1, 0, -7));
}

TEST(ChooseOrigin, KeepsSinglePrecisionPointsExactly) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 2000; ++trial) {
    std::uniform_real_distribution<double> exponent(-20, 20), unit(-1, 1);
    const double away = std::exp2(exponent(random)), side = std::exp2(exponent(random));
    std::vector<Eigen::Vector3f> points(5);
    Bounds box;
    for (Eigen::Vector3f& point : points) {
      for (float& x : point) x = static_cast<float>(away + side * unit(random));
      box.add(point.cast<double>());
    }
    const Eigen::Vector3d origin = choose_origin(box);
    for (const Eigen::Vector3f& point : points) {
      const Eigen::Vector3d relative = point.cast<double>() - origin;
      for (const double x : relative) {
        const volatile float single = static_cast<float>(x);  // volatile: GCC 12 may drop the rounding
        ASSERT_EQ(x, single) << away << ' ' << side;
      }
    }
  }
}

}  // namespace polygon_mesh_test
}  // namespace hermesh
