#include "algorithms/search/triangle_point.h"

#include <gtest/gtest.h>

namespace hermesh {
namespace triangle_point_test {

using Eigen::Vector3d;

TEST(ClosestPoint, RegionsOfATriangle) {
  const Vector3d a(0, 0, 0), b(2, 0, 0), c(0, 2, 0);
  const auto expect = [&](const Vector3d& p, const Vector3d& position, const Vector3d& weights) {
    const TrianglePoint found = closest_point(p, a, b, c);
    EXPECT_LT((found.position - position).norm(), 1e-15) << p.transpose();
    EXPECT_LT((found.weights - weights).norm(), 1e-15) << p.transpose();
  };
  expect({0.5, 0.5, 3}, {0.5, 0.5, 0}, {0.5, 0.25, 0.25});
  expect({-1, -1, 1}, a, {1, 0, 0});
  expect({5, -1, 0}, b, {0, 1, 0});
  expect({-1, 5, 0}, c, {0, 0, 1});
  expect({1, -2, 0}, {1, 0, 0}, {0.5, 0.5, 0});
  expect({2, 2, 1}, {1, 1, 0}, {0, 0.5, 0.5});
  expect({-3, 1.5, 0}, {0, 1.5, 0}, {0.25, 0, 0.75});
}

TEST(ClosestPoint, OfDegenerateTriangles) {
  const Vector3d a(1, 0, 0), b(3, 0, 0);
  EXPECT_EQ(closest_point({0, 5, 0}, a, a, a).position, a);
  EXPECT_EQ(closest_point({2, 5, 0}, a, b, Vector3d(2.5, 0, 0)).position, Vector3d(2, 0, 0));
  EXPECT_EQ(closest_point({9, 5, 0}, a, b, b).position, b);
}

}  // namespace triangle_point_test
}  // namespace hermesh
