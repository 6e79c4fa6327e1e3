#include "validation/normal_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace hermesh::validation {
namespace {

/// A square of side 2 about the z axis, turned by an angle about the x axis; its normal is +z for 0.
MeshFile square(double degrees) {
  const double radians = degrees * std::numbers::pi / 180.0;
  MeshFile mesh;
  for (const auto& [x, y] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
    mesh.points.emplace_back(x, y * std::cos(radians), y * std::sin(radians));
  mesh.quads.push_back({0, 1, 2, 3});
  return mesh;
}

NormalAngles angles(const MeshFile& from, const MeshFile& to) {
  RunContext context;
  const TriangleSoup from_soup(from), to_soup(to);
  return sampled_normal_angles(from_soup, TriangleTree(to_soup), 1000, context);
}

TEST(NormalError, IsTheAngleBetweenTwoPlanes) {
  for (const double degrees : {0.0, 1e-3, 17.0, 90.0, 179.0}) {
    const NormalAngles found = angles(square(degrees), square(0.0));
    EXPECT_NEAR(found.mean, degrees, 1e-9);
    EXPECT_NEAR(found.rms, degrees, 1e-9);
    EXPECT_NEAR(found.max, degrees, 1e-9);
    EXPECT_EQ(found.samples, 1000);
  }
}

TEST(NormalError, SeesASurfaceThatIsInsideOut) {
  MeshFile reversed = square(0.0);
  reversed.quads[0] = {3, 2, 1, 0};
  EXPECT_NEAR(angles(reversed, square(0.0)).mean, 180.0, 1e-9);
}

TEST(NormalError, AveragesOverTheArea) {
  // Half of the area leans by 60 degrees: the mean is 30, the rms 60/√2.
  MeshFile both = square(0.0);
  const MeshFile leaning = square(60.0);
  for (const Eigen::Vector3d& p : leaning.points) both.points.push_back(p + Eigen::Vector3d(0, 0, 5));
  both.quads.push_back({4, 5, 6, 7});
  MeshFile flat = square(0.0);
  for (Eigen::Vector3d& p : flat.points) p *= 100.0;
  const NormalAngles found = angles(both, flat);
  EXPECT_NEAR(found.mean, 30.0, 1e-9);
  EXPECT_NEAR(found.rms, 60.0 / std::sqrt(2.0), 1e-9);
}

TEST(NormalError, LeavesOutTrianglesWithoutArea) {
  MeshFile needle = square(10.0);
  needle.triangles.push_back({0, 1, 1});
  EXPECT_NEAR(angles(needle, square(0.0)).max, 10.0, 1e-9);
}

}  // namespace
}  // namespace hermesh::validation
