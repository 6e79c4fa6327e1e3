#include "algorithms/extraction/frustum.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace frustum_test {

using Eigen::Vector3d;

/// Looks along −z from the origin: half as high as it is deep, and twice as wide as it is high.
Frustum simple() {
  return {.field_of_view = 2.0 * std::atan(0.5) * 180.0 / M_PI, .aspect = 2.0, .near = 2.0, .far = 10.0};
}

TEST(Frustum, ClosedFormDistances) {
  const Frustum frustum = simple();
  const auto at = [&](double x, double y, double z) { return signed_distance(frustum, {x, y, z}); };
  EXPECT_NEAR(at(0, 0, 0), 2.0, 1e-12);    // before the near plane
  EXPECT_NEAR(at(0, 0, -13), 3.0, 1e-12);  // behind the far plane
  EXPECT_NEAR(at(0, 0, -2.5), -0.5, 1e-12);
  EXPECT_NEAR(at(0, 0, -9), -1.0, 1e-12);
  // Half height 2.5 at depth 5; the upper plane has a slope of one half.
  EXPECT_NEAR(at(0, 1.5, -5), -1.0 * 2.0 / std::sqrt(5.0), 1e-12);
  EXPECT_NEAR(at(0, 3.5, -5), 1.0 * 2.0 / std::sqrt(5.0), 1e-12);
  // Corners at depth 10 are (±10, ±5), at depth 2 (±2, ±1).
  EXPECT_NEAR(at(13, 9, -22), std::sqrt(9.0 + 16.0 + 144.0), 1e-12);
  EXPECT_NEAR(at(10, 5, -10), 0.0, 1e-12);
  EXPECT_NEAR(at(0, 9, -13), std::hypot(4.0, 3.0), 1e-12);  // beyond an edge of the far plane
}

TEST(Frustum, MovesWithTheCamera) {
  Frustum moved = simple();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Vector3d shift(100, -20, 3);
  moved.position = shift;
  moved.look_at = shift - 5.0 * turn.col(2);
  moved.up = turn.col(1) + 0.3 * turn.col(2);  // need not be square to the view
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-15.0, 15.0);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d p(unit(random), unit(random), unit(random));
    EXPECT_NEAR(signed_distance(moved, shift + turn * p), signed_distance(simple(), p), 1e-9);
  }
}

TEST(Frustum, TheMaskHoldsTheDistancesInItsBand) {
  RunContext context;
  const LevelSet mask = frustum_mask(simple(), 84, context);
  const openvdb::FloatGrid& grid = *mask.grid().grid;
  EXPECT_NEAR(mask.voxel_size(), 20.0 / 84, 1e-6);
  EXPECT_EQ(grid.getGridClass(), openvdb::GRID_LEVEL_SET);
  std::size_t judged = 0;
  for (auto it = grid.cbeginValueOn(); it; ++it, ++judged) {
    const openvdb::Vec3d p = grid.indexToWorld(it.getCoord());
    ASSERT_NEAR(*it, signed_distance(simple(), {p.x(), p.y(), p.z()}), 1e-5);
  }
  EXPECT_GT(judged, 20'000u);
  const openvdb::FloatGrid::ConstAccessor values = grid.getConstAccessor();
  const auto at = [&](double x, double y, double z) {
    return values.getValue(openvdb::Coord::round(grid.worldToIndex({x, y, z})));
  };
  EXPECT_FLOAT_EQ(at(0, 0, -6), -grid.background());
  EXPECT_FLOAT_EQ(at(0, 0, 5), grid.background());
  EXPECT_FLOAT_EQ(at(0, 40, -6), grid.background());
}

TEST(Frustum, WhatIsNoneIsRefused) {
  RunContext context;
  const auto refused = [&](auto&& change) {
    Frustum frustum = simple();
    change(frustum);
    EXPECT_THROW(frustum_mask(frustum, 84, context), Error);
  };
  refused([](Frustum& f) { f.look_at = f.position; });
  refused([](Frustum& f) { f.up = Vector3d(0, 0, 3); });
  refused([](Frustum& f) { f.up.setZero(); });
  refused([](Frustum& f) { f.field_of_view = 180.0; });
  refused([](Frustum& f) { f.field_of_view = 0.0; });
  refused([](Frustum& f) { f.aspect = 0.0; });
  refused([](Frustum& f) { f.near = 0.0; });
  refused([](Frustum& f) { f.far = f.near; });
  refused([](Frustum& f) { f.position[1] = NAN; });
  refused([](Frustum& f) { f.far = INFINITY; });
}

}  // namespace frustum_test
}  // namespace hermesh
