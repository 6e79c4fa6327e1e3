#include <gtest/gtest.h>

#include <numbers>

#include "algorithms/core/level_set_grid.h"
#include "reference/isosurface_seeds.h"
#include "reference/test_meshes.h"

namespace hermesh {
namespace cgal_surface_mesher_test {

TEST(CgalSurfaceMesher, SphereIsClosedOutwardAndNearTheSurface) {
  const double voxel = 0.05;
  const LevelSet level_set = test::voxelize("exact", test::sphere(1.0, 5), voxel);
  const PolygonMesh mesh = test::extract("cgal-surface-mesher", level_set);
  EXPECT_TRUE(test::closed_and_oriented(mesh));
  EXPECT_EQ(test::euler_characteristic(mesh), 2);
  EXPECT_NEAR(test::signed_volume(mesh), 4.0 / 3.0 * std::numbers::pi, 0.15);
  for (std::size_t i = 0; i < mesh.points.size(); ++i) EXPECT_NEAR(mesh.world(i).norm(), 1.0, 0.05 * voxel);
}

TEST(CgalSurfaceMesher, TorusHasItsHole) {
  const LevelSet level_set = test::voxelize("exact", test::torus(1.0, 0.4, 80, 40), 0.05);
  const PolygonMesh mesh = test::extract("cgal-surface-mesher", level_set);
  EXPECT_TRUE(test::closed_and_oriented(mesh));
  EXPECT_EQ(test::euler_characteristic(mesh), 0);
  EXPECT_GT(test::signed_volume(mesh), 0.0);
}

TEST(CgalSurfaceMesher, EveryComponentIsFoundFarFromTheOrigin) {
  PolygonMesh mesh = test::sphere(1.0, 4);
  for (int i = 1; i < 6; ++i) mesh = test::joined(mesh, test::sphere(0.2, 3, {1.5 * i, 0.3 * i, 0.0}));
  mesh.origin = Eigen::Vector3d(1 << 24, 0.0, 0.0);
  const PolygonMesh result = test::extract("cgal-surface-mesher", test::voxelize("exact", mesh, 0.05));
  EXPECT_TRUE(test::closed_and_oriented(result));
  EXPECT_EQ(test::euler_characteristic(result), 12);
  EXPECT_NEAR(result.world(0).x(), double(1 << 24), 10.0);
}

TEST(CgalSurfaceMesher, CreasesEndAndSmallerFacetsAreMore) {
  const LevelSet level_set = test::voxelize("exact", test::turned_cube(1.0), 0.1);
  const PolygonMesh coarse = test::extract("cgal-surface-mesher", level_set);
  const PolygonMesh fine = test::extract("cgal-surface-mesher", level_set, {{"facet_size", "1"}});
  EXPECT_TRUE(test::closed_and_oriented(coarse));
  EXPECT_TRUE(test::closed_and_oriented(fine));
  EXPECT_LT(4 * coarse.triangle_count(), fine.triangle_count());
  EXPECT_NEAR(test::signed_volume(fine), 8.0, 0.2);
}

TEST(CgalSurfaceMesher, SameInputSameMesh) {
  const LevelSet level_set = test::voxelize("exact", test::turned_cube(1.0), 0.1);
  const PolygonMesh first = test::extract("cgal-surface-mesher", level_set);
  // Another allocation pattern: CGAL by itself would order by addresses.
  const std::vector<std::vector<char>> clutter(1000, std::vector<char>(1000));
  EXPECT_EQ(test::extract("cgal-surface-mesher", level_set), first);
}

TEST(CgalSurfaceMesher, LimitOfPointsIsAnErrorAndEmptyIsEmpty) {
  const LevelSet level_set = test::voxelize("exact", test::sphere(1.0, 4), 0.1);
  EXPECT_THROW(test::extract("cgal-surface-mesher", level_set, {{"max_points", "50"}}), Error);
  const LevelSet empty = make_level_set(openvdb::FloatGrid::create(1.0f));
  EXPECT_TRUE(test::extract("cgal-surface-mesher", empty).empty());
}

TEST(IsosurfaceSeeds, LieOnTheSurfaceOfEveryComponent) {
  const PolygonMesh mesh = test::joined(test::sphere(1.0, 4), test::sphere(0.15, 3, {3.0, 0.0, 0.0}));
  const LevelSet level_set = test::voxelize("exact", mesh, 0.1);
  int small = 0, large = 0;
  for (const openvdb::Vec3d& seed : isosurface_seeds(*level_set.grid().grid, 0.0, 8)) {
    const Eigen::Vector3d p = 0.1 * Eigen::Vector3d(seed.x(), seed.y(), seed.z());
    const bool is_small = p.x() > 2.0;
    ++(is_small ? small : large);
    EXPECT_NEAR((is_small ? Eigen::Vector3d(p - Eigen::Vector3d(3.0, 0.0, 0.0)) : p).norm(),
                is_small ? 0.15 : 1.0, 0.02);
  }
  EXPECT_EQ(small, 12);
  EXPECT_GE(large, 12);
}

}  // namespace cgal_surface_mesher_test
}  // namespace hermesh
