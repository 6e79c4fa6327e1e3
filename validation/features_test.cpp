#include "validation/features.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "validation/geometry/test_meshes.h"

namespace hermesh::validation {
namespace features_test {

using namespace test;

SharpFeatures features(const MeshFile& mesh, double degrees) {
  return find_sharp_features(TriangleSoup(mesh), degrees);
}

FeatureDistances distances(const MeshFile& reference, const MeshFile& mesh, double degrees) {
  RunContext context;
  return feature_distances(TriangleSoup(reference), TriangleTree(TriangleSoup(mesh)), degrees, context);
}

// Every quad cut into n², each with the triangle split of its own, to walk across many flat edges.
MeshFile refined_quads(const MeshFile& mesh, int n) {
  MeshFile fine;
  for (const Quad& q : mesh.quads) {
    const std::uint32_t base = std::uint32_t(fine.points.size());
    const std::uint32_t row = std::uint32_t(n + 1);
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j) {
        const double u = double(i) / n, v = double(j) / n;
        const Eigen::Vector3d bottom = (1 - u) * mesh.points[q[0]] + u * mesh.points[q[1]];
        const Eigen::Vector3d top = (1 - u) * mesh.points[q[3]] + u * mesh.points[q[2]];
        fine.points.push_back((1 - v) * bottom + v * top);
      }
    for (std::uint32_t i = 0; i + 1 < row; ++i)
      for (std::uint32_t j = 0; j + 1 < row; ++j) {
        const std::uint32_t a = base + i * row + j;
        fine.quads.push_back({a, a + row, a + row + 1, a + 1});
      }
  }
  return fine;
}

// A square of side 4 whose corners are rounded with radius 1 in `steps` steps each, swept over 3.
MeshFile rounded_box(int steps) {
  std::vector<Eigen::Vector2d> profile;
  for (int quarter = 0; quarter < 4; ++quarter)
    for (int i = 0; i <= steps; ++i) {
      const double middle = (quarter + 0.5) * std::numbers::pi / 2.0;
      const Eigen::Vector2d centre = std::sqrt(2.0) * Eigen::Vector2d(std::cos(middle), std::sin(middle));
      const double angle = (quarter + double(i) / steps) * std::numbers::pi / 2.0;
      profile.push_back(centre + Eigen::Vector2d(std::cos(angle), std::sin(angle)));
    }
  return extrusion(profile, 3.0);
}

TEST(Features, CubeHasTwelveEdgesAndEightCorners) {
  for (const MeshFile& mesh : {cube_of_quads(), cube_of_triangles(), soup_of_triangles(cube_of_quads()),
                               refined_quads(cube_of_quads({1e5, 0, 0}, 1.0), 1)}) {
    const SharpFeatures f = features(mesh, 30.0);
    EXPECT_EQ(f.edges.size(), 12u);
    EXPECT_EQ(f.corners.size(), 8u);
    EXPECT_EQ(f.edges_excluded, 0);
  }
  EXPECT_EQ(features(cube_of_quads(), 91.0).edges.size(), 0u);
}

TEST(Features, FineCubeKeepsItsEdges) {
  const SharpFeatures f = features(refined_quads(cube_of_quads(), 8), 30.0);
  EXPECT_EQ(f.edges.size(), 12u * 8u);
  EXPECT_EQ(f.corners.size(), 8u);
  EXPECT_EQ(f.edges_excluded, 0);
}

TEST(Features, CoarseCylindersKeepTheirRimsOnly) {
  for (int sides : {8, 16, 32}) {
    const SharpFeatures f = features(prism(sides), 10.0);
    EXPECT_EQ(f.edges.size(), 2u * std::size_t(sides));
    EXPECT_EQ(f.edges_excluded, sides);
    EXPECT_EQ(f.corners.size(), 0u);
    for (const auto& [a, b] : f.edges) EXPECT_EQ(a.z(), b.z());
  }
  // 11.25° is below the threshold: nothing there to be excluded.
  EXPECT_EQ(features(prism(32), 15.0).edges_excluded, 0);
}

TEST(Features, HollowCylinderTurnsTheOtherWay) {
  const SharpFeatures f = features(reversed(prism(16)), 10.0);
  EXPECT_EQ(f.edges.size(), 32u);
  EXPECT_EQ(f.edges_excluded, 16);
}

TEST(Features, FlippedTriangleDoesNotHideAnEdge) {
  MeshFile mesh = cube_of_triangles();
  std::swap(mesh.triangles[3][0], mesh.triangles[3][1]);
  EXPECT_EQ(features(mesh, 30.0).edges.size(), 12u);
}

TEST(Features, HexagonalPrismHasSharpSides) {
  const SharpFeatures f = features(prism(6), 30.0);
  EXPECT_EQ(f.edges.size(), 18u);
  EXPECT_EQ(f.corners.size(), 12u);
  EXPECT_EQ(f.edges_excluded, 0);
}

TEST(Features, RoundedBox) {
  // Three steps a quarter: edges of 15°, 30°, 30°, 15° on each; the 15° ones end the row.
  const SharpFeatures f = features(rounded_box(3), 10.0);
  EXPECT_EQ(f.edges_excluded, 16);
  EXPECT_EQ(f.edges.size(), 2u * 16u);
  for (const auto& [a, b] : f.edges) EXPECT_EQ(a.z(), b.z());
  EXPECT_EQ(f.corners.size(), 0u);
  const SharpFeatures two = features(rounded_box(2), 10.0);  // 22.5°, 45°, 22.5°
  EXPECT_EQ(two.edges_excluded, 12);
}

TEST(Features, LoneChamferIsNoBlend) {
  const SharpFeatures f = features(extrusion({{0, 0}, {4, 0}, {4, 3.5}, {3.5, 4}, {0, 4}}, 4.0), 30.0);
  EXPECT_EQ(f.edges_excluded, 0);
  EXPECT_EQ(f.edges.size(), 15u);
}

TEST(Features, ChamfersNearlyAsWideAsTheFacesAreACoarseCylinder) {
  EXPECT_EQ(features(rounded_box(1), 30.0).edges_excluded, 8);  // faces of 2.83, chamfers of 1.41
}

TEST(Features, RoofRidgeBetweenSharpEavesIsKept) {
  // The ridge turns by 40° and has eaves of 70° on both sides, alike and parallel.
  const double rise = std::tan(20.0 * std::numbers::pi / 180.0);
  const SharpFeatures f = features(extrusion({{-1, -1}, {1, -1}, {1, 0}, {0, rise}, {-1, 0}}, 5.0), 30.0);
  EXPECT_EQ(f.edges_excluded, 0);
  EXPECT_EQ(f.edges.size(), 15u);
}

TEST(Features, OpenBordersAreNoFeatures) {
  MeshFile mesh = cube_of_quads();
  mesh.quads.pop_back();
  EXPECT_EQ(features(mesh, 30.0).edges.size(), 8u);
}

TEST(Features, DistancesOfKnownCubes) {
  const MeshFile reference = cube_of_quads({-1, -1, -1}, 2.0);
  const FeatureDistances same = distances(reference, cube_of_triangles({-1, -1, -1}, 2.0), 30.0);
  EXPECT_EQ(same.edge_to_mesh.max, 0.0);
  EXPECT_DOUBLE_EQ(same.edge_length, 24.0);
  // A cube smaller by h on each side: an edge point away from the corners is h√2 from it, a corner h√3.
  const double h = 0.125;
  const FeatureDistances f = distances(reference, cube_of_quads({-1 + h, -1 + h, -1 + h}, 2.0 - 2 * h), 30.0);
  EXPECT_EQ(f.corners, 8);
  EXPECT_NEAR(f.corner_to_mesh.mean, h * std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(f.edge_to_mesh.max, h * std::sqrt(3.0), 1e-12);
  // Over the last h of an edge at both ends the distance is √(2h² + t²), t from 0 to h.
  const double end = 0.5 * h * h * (std::sqrt(3.0) + 2.0 * std::asinh(1.0 / std::sqrt(2.0)));
  EXPECT_NEAR(f.edge_to_mesh.mean, ((2.0 - 2.0 * h) * h * std::sqrt(2.0) + 2.0 * end) / 2.0, 1e-6);
  // The measure must detect a rounded edge.
  EXPECT_GT(
      distances(extrusion({{-2, -2}, {2, -2}, {2, 2}, {-2, 2}}, 3.0), rounded_box(8), 30.0).edge_to_mesh.mean,
      0.1);
}

TEST(Features, NoneOnAFlatOrSmoothSurface) {
  const FeatureDistances f = distances(torus(60, 40), cube_of_quads(), 30.0);
  EXPECT_EQ(f.edges, 0);
  EXPECT_EQ(f.corners, 0);
  EXPECT_EQ(f.edge_to_mesh.samples, 0);
  EXPECT_EQ(f.edge_to_mesh.max, 0.0);
}

}  // namespace features_test
}  // namespace hermesh::validation
