#include "algorithms/extraction/contact/triangle_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

namespace hermesh {
namespace triangle_contact_test {

using Eigen::Vector3d;

const Vector3d o(0, 0, 0), x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);

TEST(TriangleContact, NoSharedCorner) {
  const Corners flat = {o, x, y};
  EXPECT_TRUE(certainly_apart(flat, {o + z, x + z, y + z}, 0));
  EXPECT_TRUE(certainly_apart(flat, {x + y, x + y + x, x + y + y}, 0));  // next to it in its plane
  EXPECT_FALSE(
      certainly_apart(flat, {Vector3d(0.2, 0.2, -1), Vector3d(0.3, 0.2, 1), Vector3d(0.2, 0.3, 1)}, 0));
  EXPECT_FALSE(certainly_apart(flat, {Vector3d(0.2, 0.2, 0), x + y, y + y}, 0));  // overlaps in its plane
  EXPECT_FALSE(certainly_apart(flat, {Vector3d(0.2, 0.2, 0), x + z, y + z}, 0));  // a corner in its interior
  EXPECT_FALSE(certainly_apart(flat, {x, x + x, x + z}, 0));  // a corner at one of its corners
}

TEST(TriangleContact, OneSharedCorner) {
  const Corners flat = {o, x, y};
  EXPECT_TRUE(certainly_apart(flat, {o, x + z, y + z}, 1));
  EXPECT_TRUE(certainly_apart(flat, {o, -x, -y}, 1));      // in its plane, opposite
  EXPECT_TRUE(certainly_apart(flat, {o, -x, -x - y}, 1));  // a straight line through the corner
  EXPECT_TRUE(certainly_apart(flat, {o, -x, -y + 0.1 * x}, 1));
  EXPECT_FALSE(certainly_apart(flat, {o, x + y, x + y + y}, 1));      // overlaps in its plane
  EXPECT_FALSE(certainly_apart(flat, {o, x, -y}, 1));                 // shares more than specified
  EXPECT_FALSE(certainly_apart(flat, {o, x + y + z, x + y - z}, 1));  // passes through it
  EXPECT_TRUE(certainly_apart(flat, {o, -x - y + z, -x - y - z}, 1));
}

TEST(TriangleContact, SidesThatLieOnOneAnotherMeet) {
  // Triangles with a common corner, sides along one ray from it and the other sides on either side, rotated
  // at random: the plane through two parallel sides is only rounding error and separates nothing.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto point = [&] { return Vector3d(unit(random), unit(random), unit(random)); };
  for (int i = 0; i < 2000; ++i) {
    const Vector3d corner = point(), ray = point();
    const Corners a = {corner, corner + ray, corner + point()},
                  b = {corner, corner + 0.37 * ray, corner + point()};
    EXPECT_FALSE(certainly_apart(a, b, 1)) << i;
  }
}

TEST(TriangleContact, SharedEdge) {
  const Corners flat = {o, x, y};
  EXPECT_TRUE(certainly_apart(flat, {o, x, z}, 2));
  EXPECT_TRUE(certainly_apart(flat, {o, x, -y}, 2));
  EXPECT_FALSE(certainly_apart(flat, {o, x, x + y}, 2));  // folded onto it
  EXPECT_TRUE(certainly_apart(flat, {o, x, y + 0.001 * z}, 2));
}

/// Triangles reported as apart have no common point among many samples of both, rotated and moved at random.
TEST(TriangleContact, NeverWronglySaysApart) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto point = [&] { return Vector3d(unit(random), unit(random), unit(random)); };
  int apart = 0, touching = 0;
  for (int round = 0; round < 2000; ++round) {
    const Corners a = {point(), point(), point()};
    // The second triangle passes through a point of the first.
    const Vector3d inside = 0.3 * a[0] + 0.3 * a[1] + 0.4 * a[2];
    const Vector3d p = point(), q = point();
    const Corners through = {p, q, 3.0 * inside - p - q};
    EXPECT_FALSE(certainly_apart(a, through, 0));
    ++touching;
    const Corners b = {point(), point(), point()};
    apart += certainly_apart(a, b, 0);
  }
  EXPECT_EQ(touching, 2000);
  EXPECT_GT(apart, 1000);
  EXPECT_LT(apart, 2000);
}

}  // namespace triangle_contact_test
}  // namespace hermesh
