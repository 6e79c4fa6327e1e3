#include "reference/marching_cubes_decimated.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "reference/test_meshes.h"

namespace hermesh {
namespace marching_cubes_decimated_test {

LevelSet sphere_level_set() { return test::voxelize("openvdb", test::sphere(1.0, 5), 0.05); }

TEST(MarchingCubesDecimated, MeetsAnAbsoluteBudgetAndStaysClosed) {
  const PolygonMesh mesh =
      test::extract("marching-cubes-decimated", sphere_level_set(), {{"triangles", "500"}});
  EXPECT_LE(mesh.triangle_count(), 500u);
  EXPECT_GE(mesh.triangle_count(), 498u);
  EXPECT_TRUE(test::closed_and_oriented(mesh));
  EXPECT_EQ(test::euler_characteristic(mesh), 2);
  EXPECT_NEAR(test::signed_volume(mesh), 4.0 / 3.0 * std::numbers::pi, 0.2);
}

TEST(MarchingCubesDecimated, FractionIsOfMarchingCubes) {
  const LevelSet level_set = sphere_level_set();
  const auto whole =
      test::extract("marching-cubes-decimated", level_set, {{"fraction", "1"}}).triangle_count();
  const auto tenth = test::extract("marching-cubes-decimated", level_set).triangle_count();
  EXPECT_LE(10 * tenth, whole);
  EXPECT_GE(10 * tenth + 30, whole);
}

TEST(MarchingCubesDecimated, NormalFlipIsHeeded) {
  const PolygonMesh mesh = test::extract("marching-cubes-decimated", sphere_level_set(),
                                         {{"triangles", "200"}, {"normal_flip", "60"}});
  EXPECT_LE(mesh.triangle_count(), 200u);
  EXPECT_TRUE(test::closed_and_oriented(mesh));
}

TEST(Decimate, KeepsTopologyAndPointsAndSaysWhenItMust) {
  const PolygonMesh fine = test::torus(1.0, 0.4, 40, 20);
  RunContext context;
  const PolygonMesh coarse = decimate(fine, 4, 180.0, context);
  EXPECT_TRUE(test::closed_and_oriented(coarse));
  EXPECT_EQ(test::euler_characteristic(coarse), 0);
  // A torus needs 14 triangles; no chain of collapses can reach 4.
  EXPECT_GE(coarse.triangle_count(), 14u);
  EXPECT_EQ(context.notes.size(), 1u);
  for (const Eigen::Vector3f& p : coarse.points)
    EXPECT_NE(std::find(fine.points.begin(), fine.points.end(), p), fine.points.end());
}

TEST(Decimate, RefusesWhatIsNotManifold) {
  PolygonMesh mesh = test::turned_cube(1.0);
  mesh.triangles = {{0, 4, 7}};  // a third polygon on an edge of the cube
  RunContext context;
  EXPECT_THROW(decimate(mesh, 4, 180.0, context), Error);
}

}  // namespace marching_cubes_decimated_test
}  // namespace hermesh
