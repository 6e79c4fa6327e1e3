#include "algorithms/extraction/dual_contouring/qef.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace hermesh {
namespace {

using Eigen::Vector3d;

TEST(Qef, ThreePlanesMeetInTheirCorner) {
  const Vector3d corner(1000.3, -2000.6, 0.2);
  Qef qef(Vector3d(1000.5, -2000.5, 0.5));
  for (int axis = 0; axis < 3; ++axis)
    qef.add_plane(corner + Vector3d::Unit((axis + 1) % 3) * 0.3, Vector3d::Unit(axis));
  EXPECT_LT((qef.minimiser(0.1) - corner).norm(), 1e-12);
  EXPECT_LT(qef.error(corner), 1e-20);
}

TEST(Qef, OnAPlaneTheMinimiserIsTheMassPoint) {
  Qef qef(Vector3d::Constant(0.5));
  const Vector3d normal = Vector3d(1, 2, 3).normalized();
  const Vector3d along = normal.cross(Vector3d::UnitX()).normalized();
  for (const double step : {-0.3, 0.1, 0.4}) qef.add_plane(Vector3d::Constant(0.5) + step * along, normal);
  EXPECT_LT((qef.minimiser(0.1) - qef.mass_point()).norm(), 1e-12);
}

TEST(Qef, TruncationDropsAnAlmostFlatDirection) {
  // Two planes that differ by a thousandth of a radian meet in a line far away; truncated, the point stays
  // near.
  Qef qef(Vector3d::Zero());
  qef.add_plane(Vector3d(0.2, 0, 0.001), Vector3d(0.001, 0, 1).normalized());
  qef.add_plane(Vector3d(-0.2, 0, -0.001), Vector3d(-0.001, 0, 1).normalized());
  EXPECT_GT((qef.minimiser(0.0) - qef.mass_point()).norm(), 0.5);
  EXPECT_LT((qef.minimiser(0.1) - qef.mass_point()).norm(), 0.01);
}

TEST(Qef, ErrorIsTheSumOfSquaredPlaneDistances) {
  Qef qef(Vector3d(5, 5, 5));
  qef.add_plane(Vector3d(1, 0, 0), Vector3d::UnitX());
  qef.add_plane(Vector3d(0, 3, 0), Vector3d::UnitY());
  EXPECT_NEAR(qef.error(Vector3d(3, 0, 7)), 4.0 + 9.0, 1e-12);
}

TEST(Qef, WithinTheBoxNoSampledPointIsBetter) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0), sign(-1.0, 1.0);
  for (int round = 0; round < 200; ++round) {
    Qef qef(Vector3d::Constant(0.5));
    for (int i = 0; i < 4; ++i)
      qef.add_plane(Vector3d(unit(random), unit(random), unit(random)),
                    Vector3d(sign(random), sign(random), sign(random)).normalized());
    const Vector3d best = qef.minimiser_within(Vector3d::Zero(), Vector3d::Ones(), 1e-9);
    ASSERT_TRUE((best.array() >= 0).all() && (best.array() <= 1).all());
    for (int sample = 0; sample < 50; ++sample) {
      const Vector3d other(unit(random), unit(random), unit(random));
      ASSERT_LE(qef.error(best), qef.error(other) + 1e-9);
    }
  }
}

}  // namespace
}  // namespace hermesh
