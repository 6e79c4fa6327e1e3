#include "algorithms/hermite/samplers.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/test_normals.h"

namespace hermesh {
namespace samplers_test {

using Eigen::Vector3d;

LevelSet sphere(float radius) {
  initialize_openvdb();
  return make_level_set(openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      radius, openvdb::Vec3f(0.3f, 0.1f, -0.2f), 1.0f));
}

TEST(LevelSetSampler, SphereCrossingsLieOnItWithRadialNormals) {
  RunContext context;
  const FloatHermite grid = sample_level_set(sphere(20.0f), 0.0, context);
  const Vector3d centre(0.3, 0.1, -0.2);
  std::size_t crossings = 0;
  for_each_normal(grid, [&](const Vector3d& at, const Vector3d& normal) {
    ++crossings;
    ASSERT_NEAR((at - centre).norm(), 20.0, 0.01);  // linear interpolation errs by curvature / 8 at most
    ASSERT_GT(normal.dot((at - centre).normalized()), 0.998);
    ASSERT_NEAR(normal.norm(), 1.0, 1e-5);
  });
  EXPECT_EQ(crossings, grid.crossings.size());
  EXPECT_NEAR(static_cast<double>(crossings), 6.0 * M_PI * 400.0,
              200.0);  // two for each lattice line through the disc
}

TEST(LevelSetSampler, NormalsAreExactOnAPlaneEvenWhereTheBandEnds) {
  // Only the two layers next to the surface are active; the background beyond them must not be read.
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(100.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  const Vector3d normal = Vector3d(0.2, 0.1, 1.0).normalized();
  for (int x = 0; x < 20; ++x)
    for (int y = 0; y < 20; ++y)
      for (int z = 0; z < 20; ++z) {
        const double d = normal.dot(Vector3d(x, y, z) - Vector3d::Constant(9.7));
        if (std::abs(d) < 1.0)
          grid->tree().setValue(openvdb::Coord(x, y, z), static_cast<float>(d));
        else if (d < 0)
          grid->tree().setValueOff(openvdb::Coord(x, y, z), -100.0f);
      }
  RunContext context;
  int checked = 0;
  for_each_normal(sample_level_set(make_level_set(grid), 0.0, context),
                  [&](const Vector3d& at, const Vector3d& found) {
                    if ((at.array() < 3).any() || (at.array() > 16).any()) return;
                    ++checked;
                    ASSERT_GT(found.dot(normal), 1.0 - 1e-5);
                  });
  EXPECT_GT(checked, 100);
}

/// Octahedron with corners at ±radius from a centre, counter-clockwise or, reversed, inside out.
PolygonMesh octahedron(double radius, const Vector3d& centre, bool reversed) {
  PolygonMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {1.0, -1.0})
      mesh.points.push_back((centre + side * radius * Vector3d::Unit(axis)).cast<float>());
  for (std::uint32_t octant = 0; octant < 8; ++octant) {
    const std::uint32_t sx = octant & 1, sy = (octant >> 1) & 1, sz = octant >> 2;
    Triangle triangle{sx, 2 + sy, 4 + sz};
    if (((sx + sy + sz) % 2 == 1) != reversed) std::swap(triangle[1], triangle[2]);
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

LevelSet octahedron_level_set(double radius, const Vector3d& centre) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(3.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  for (int x = -20; x <= 20; ++x)
    for (int y = -20; y <= 20; ++y)
      for (int z = -20; z <= 20; ++z) {
        const double d = ((Vector3d(x, y, z) - centre).cwiseAbs().sum() - radius) / std::sqrt(3.0);
        grid->tree().setValue(openvdb::Coord(x, y, z), static_cast<float>(d));
      }
  return make_level_set(grid);
}

TEST(PolygonSampler, HitsAreExactWhicheverWayThePolygonsAreWound) {
  const Vector3d centre(0.31, -0.27, 0.13);
  const double radius = 12.4;
  RunContext context;
  for (const bool reversed : {false, true}) {
    PolygonSampling sampling;
    const FloatHermite grid = sample_polygons(octahedron_level_set(radius, centre), 0.0,
                                              octahedron(radius, centre, reversed), context, &sampling);
    EXPECT_EQ(sampling.fallback, 0u);
    EXPECT_EQ(sampling.exact, grid.crossings.size());
    for_each_normal(grid, [&](const Vector3d& at, const Vector3d& normal) {
      ASSERT_NEAR((at - centre).cwiseAbs().sum(), radius, 2e-5);
      const Vector3d face = (at - centre).cwiseSign() / std::sqrt(3.0);
      ASSERT_GT(normal.dot(face), 1.0 - 1e-5);
    });
  }
}

TEST(PolygonSampler, TheOrderOfTrianglesAndOfTheirCornersDoesNotCount) {
  // Lattice lines hit the edges and corners of this octahedron, so several triangles have the same hits.
  const Vector3d centre = Vector3d::Zero();
  PolygonMesh mesh = octahedron(12.0, centre, false);
  RunContext context;
  const FloatHermite expected = sample_polygons(octahedron_level_set(12.0, centre), 0.0, mesh, context);
  ASSERT_FALSE(expected.crossings.empty());
  std::mt19937 random(3);
  for (int round = 0; round < 10; ++round) {
    std::ranges::shuffle(mesh.triangles, random);
    for (Triangle& triangle : mesh.triangles)
      std::ranges::rotate(triangle, triangle.begin() + static_cast<int>(random() % 3));
    const FloatHermite found = sample_polygons(octahedron_level_set(12.0, centre), 0.0, mesh, context);
    ASSERT_EQ(found.crossings.size(), expected.crossings.size());
    for (std::size_t i = 0; i < found.crossings.size(); ++i) {
      ASSERT_EQ(found.crossings[i].offset, expected.crossings[i].offset);
      ASSERT_EQ(found.crossings[i].normal, expected.crossings[i].normal);
    }
  }
}

/// The volume of an open mesh depends on the reference point, and the world's origin is not a suitable one:
/// away from it in either direction (but not so far that index coordinates have another base) the data equal
/// those at the origin. Edges without a hit detect a dependence, because they require a polygon that faces
/// outwards.
TEST(PolygonSampler, AnOpenMeshIsNotTurnedOverForItsPlace) {
  initialize_openvdb();
  constexpr double kHalf = 12.4;
  const auto sampled = [](int far, PolygonSampling& sampling) {
    const Vector3d centre(far + 0.31, -0.27, 0.13);
    PolygonMesh open = octahedron(kHalf, centre, false);
    std::erase_if(open.triangles, [](const Triangle& t) { return std::ranges::count(t, 0u) > 0; });
    const auto grid = openvdb::FloatGrid::create(3.0f);
    grid->setGridClass(openvdb::GRID_LEVEL_SET);
    for (int x = -16; x <= 16; ++x)
      for (int y = -16; y <= 16; ++y)
        for (int z = -16; z <= 16; ++z) {
          const double sum = (Vector3d(far + x, y, z) - centre).cwiseAbs().sum();
          grid->tree().setValue(openvdb::Coord(far + x, y, z),
                                static_cast<float>((sum - kHalf) / std::sqrt(3.0)));
        }
    RunContext context;
    return sample_polygons(make_level_set(grid), 0.0, open, context, &sampling);
  };
  PolygonSampling at_origin;
  const FloatHermite expected = sampled(0, at_origin);
  EXPECT_GT(at_origin.nearest, 20u);
  for (const int far : {-64, 64}) {
    PolygonSampling sampling;
    const FloatHermite found = sampled(far, sampling);
    EXPECT_EQ(sampling.nearest, at_origin.nearest) << far;
    ASSERT_EQ(found.crossings.size(), expected.crossings.size());
    for (std::size_t i = 0; i < found.crossings.size(); ++i)
      for (int a = 0; a < 3; ++a)
        ASSERT_NEAR(found.crossings[i].normal[a], expected.crossings[i].normal[a], 1e-3) << far;
  }
}

TEST(PolygonSampler, OfSeveralHitsOneAgreesWithTheSigns) {
  // A thin plate's two faces between two samples, and a third face beyond: the edge runs from inside to
  // outside, so the faces that look along it are right, and the nearer to the level set's crossing of those
  // is taken.
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 8; ++z) grid->tree().setValue(openvdb::Coord(x, y, z), z <= 3 ? -0.5f : 0.5f);
  PolygonMesh mesh;
  const auto plane = [&](float height, bool up) {
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    for (const auto& [x, y] : {std::pair{-9.f, -9.f}, {19.f, -9.f}, {19.f, 19.f}, {-9.f, 19.f}})
      mesh.points.emplace_back(x, y, height);
    mesh.quads.push_back(up ? Quad{first, first + 1, first + 2, first + 3}
                            : Quad{first, first + 3, first + 2, first + 1});
  };
  plane(3.1f, true);
  plane(3.45f, false);
  plane(3.7f, true);
  plane(-30.0f, false);  // makes the whole wound outwards, as a solid's surface is
  RunContext context;
  PolygonSampling sampling;
  const FloatHermite hermite = sample_polygons(make_level_set(grid), 0.0, mesh, context, &sampling);
  EXPECT_GT(sampling.ambiguous, 0u);
  int checked = 0;
  for_each_normal(hermite, [&](const Vector3d& at, const Vector3d& normal) {
    if (at.z() < 3 || at.z() > 4 || normal.z() < 0.9) return;
    ++checked;
    EXPECT_NEAR(at.z(), 3.7, 1e-5);
  });
  EXPECT_EQ(checked, 64);
}

}  // namespace samplers_test
}  // namespace hermesh
