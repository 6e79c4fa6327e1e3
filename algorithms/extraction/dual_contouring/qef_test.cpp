#include "algorithms/extraction/dual_contouring/qef.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <initializer_list>
#include <random>

namespace hermesh {
namespace qef_test {

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

TEST(Qef, ALineOfMinimaLeavesTheBoxWhereItIsNearest) {
  // Two planes meet in the line (0.9 + t, t, 0.5), which crosses the box from (0.9, 0) to (1, 0.1). The point
  // nearest to the mass point lies beyond the box. Both ends have the same error, so rounding must not
  // choose.
  std::mt19937 random(2);
  std::uniform_real_distribution<double> rounding(-1e-7, 1e-7);
  for (int round = 0; round < 100; ++round) {
    Qef qef(Vector3d::Constant(0.5));
    const auto add = [&](const Vector3d& point, const Vector3d& normal) {
      qef.add_plane(point + Vector3d(rounding(random), rounding(random), rounding(random)), normal);
    };
    for (const Vector3d& point : {Vector3d(0.6, 1, 0.5), Vector3d(0.7, 1, 0.5), Vector3d(0.6, 0.9, 0.5)})
      add(point, Vector3d::UnitZ());
    add(Vector3d(0.95, 0.05, 0.3), Vector3d(1, -1, 0).normalized());
    const Vector3d best = qef.minimiser_within(Vector3d::Zero(), Vector3d::Ones(), 0.1);
    ASSERT_LT((best - Vector3d(1, 0.1, 0.5)).norm(), 1e-5) << best.transpose();
  }
}

/// Planes of the bowl z = k (x² + y²) / 2 at positions (x, y).
Qef bowl(double k, std::initializer_list<std::array<double, 2>> places) {
  Qef qef(Vector3d::Zero());
  for (const auto& [x, y] : places)
    qef.add_plane(Vector3d(x, y, 0.5 * k * (x * x + y * y)), Vector3d(-k * x, -k * y, 1).normalized());
  return qef;
}

TEST(Qef, MassPointAndMinimiserLieAsFarOffACurvedSurfaceToBothSides) {
  const double k = 0.01;
  const Qef qef = bowl(k, {{0.5, 0.4}, {-0.5, 0.3}, {-0.1, -0.5}, {0.3, -0.5}, {0.5, 0.1}});
  const auto above = [&](const Vector3d& x) { return x.z() - 0.5 * k * x.head<2>().squaredNorm(); };
  const Vector3d mass = qef.mass_point(), least = qef.minimiser(0.1);
  EXPECT_GT(above(mass), 0.001);
  EXPECT_NEAR(above(least), -above(mass), 0.02 * above(mass));
  EXPECT_NEAR(above(0.5 * (mass + least)), 0.0, 0.01 * above(mass));
}

TEST(Qef, TheShareRisesFromSmoothSurfacesToFeatures) {
  const double smooth = Qef::kShareOfExact;
  // Four corners of a square of side 1 about the axis: the sum of the products of two eigenvalues over the
  // square of their sum is k² / 2 for small k, which is 0.7 of the truncation's square at k = 0.118.
  const auto share = [&](double k) {
    return bowl(k, {{0.5, 0.5}, {-0.5, 0.5}, {-0.5, -0.5}, {0.5, -0.5}}).share_of_minimiser(smooth, 0.1);
  };
  EXPECT_DOUBLE_EQ(share(0.0), smooth);
  EXPECT_DOUBLE_EQ(share(0.118), smooth);
  EXPECT_GT(share(0.121), smooth);
  EXPECT_DOUBLE_EQ(share(0.15), 1.0);
  for (double k = 0.0; k < 0.2; k += 0.001) {
    EXPECT_GE(share(k + 0.001), share(k));
    EXPECT_LT(share(k + 0.001), share(k) + 0.02);
  }
  // An edge between two faces, one of which has only one plane of the five.
  Qef edge(Vector3d::Zero());
  for (int i = 0; i < 4; ++i) edge.add_plane(Vector3d(0.1 * i, 0, 0), Vector3d::UnitZ());
  edge.add_plane(Vector3d(0.4, 0, -0.2), Vector3d::UnitX());
  EXPECT_EQ(edge.share_of_minimiser(smooth, 0.1), 1.0);
  EXPECT_EQ(edge.share_of_minimiser(smooth, 0.0), 1.0);
}

TEST(Qef, TellsCreasesFromCorners) {
  Qef planes(Vector3d::Zero());
  planes.add_plane(Vector3d(0, 0, 0.3), Vector3d::UnitZ());
  EXPECT_TRUE(planes.line(0.1).isZero());
  planes.add_plane(Vector3d(0.4, 0, 0), Vector3d::UnitX());
  EXPECT_NEAR(std::abs(planes.line(0.1).y()), 1.0, 1e-12);
  EXPECT_FALSE(planes.has_corner(planes.minimiser(0.1), 0.1));
  planes.add_plane(Vector3d(0, 0.2, 0), Vector3d::UnitY());
  EXPECT_TRUE(planes.line(0.1).isZero());
  EXPECT_TRUE(planes.has_corner(planes.minimiser(0.1), 0.1));
  // A fourth plane that misses the corner of the others by more than Qef::kMeet.
  planes.add_plane(Vector3d(0.4, 0.2, 0.31), Vector3d(1, 1, 1).normalized());
  EXPECT_FALSE(planes.has_corner(planes.minimiser(0.1), 0.1));
}

}  // namespace qef_test
}  // namespace hermesh
