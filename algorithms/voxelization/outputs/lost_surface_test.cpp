#include "algorithms/voxelization/outputs/lost_surface.h"

#include <gtest/gtest.h>

#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace lost_surface_test {

using namespace voxelize_for_tests;

LostSurface lost_of(const PolygonMesh& mesh, double voxel_size) {
  RunContext context;
  const LevelSet level_set = make_level_set(
      voxelize(mesh, {.voxel_size = voxel_size, .signs = SignRule::flood_fill}, context).distance);
  return find_lost_surface(mesh, level_set, true, context);
}

TEST(LostSurface, NothingIsLostOfSolidsThickerThanAVoxel) {
  PolygonMesh mesh = box({0.3, 0.3, 0.3}, {8.3, 7.7, 1.4});
  const LostSurface lost = lost_of(mesh, 1.0);
  EXPECT_EQ(lost.lost_area, 0.0);
  EXPECT_NEAR(lost.area, 2 * (8.0 * 7.4 + 8.0 * 1.1 + 7.4 * 1.1), 1e-3);
  EXPECT_EQ(lost_surface_note(lost, 1.0), "");
}

TEST(LostSurface, AFinBetweenSamplesIsLost) {
  PolygonMesh mesh = box({0.5, 0.5, 0.5}, {10.5, 10.5, 10.5});
  append(mesh, box({8.5, 1.5, 4.3}, {40.5, 9.5, 4.7}));
  const LostSurface lost = lost_of(mesh, 1.0);
  // From x = 10.5 on, its two sides and its edges; the part within a voxel of the body has the body's
  // surface.
  const double fin = 2 * 30.0 * 8.0 + 2 * 30.0 * 0.4 + 8.0 * 0.4;
  // The root of the fin counts as far as it is within a voxel of the body's surface.
  EXPECT_NEAR(lost.area, 600.0 - 8.0 * 0.4 + fin, 50.0);
  EXPECT_LT(lost.lost_area, fin);
  EXPECT_GT(lost.lost_area, fin * 28.0 / 30.0);
  EXPECT_NEAR(lost.thickness, 0.4, 1e-5);
  EXPECT_NE(lost_surface_note(lost, 1.0).find("voxels of 0.399 would keep it"), std::string::npos)
      << lost_surface_note(lost, 1.0);
  EXPECT_EQ(lost_of(mesh, 0.399).lost_area, 0.0);
}

TEST(LostSurface, AGapBetweenSamplesIsLost) {
  PolygonMesh mesh = box({0.5, 0.5, 0.5}, {20.5, 20.5, 8.3});
  append(mesh, box({0.5, 0.5, 8.7}, {20.5, 20.5, 16.5}));
  const LostSurface lost = lost_of(mesh, 1.0);
  EXPECT_LT(lost.lost_area, 2 * 400.0);
  EXPECT_GT(lost.lost_area, 2 * 16.0 * 16.0);
  EXPECT_NEAR(lost.thickness, 0.4, 1e-5);
}

/// The walls of the overlap bound nothing, so nothing of the solid is lost with them.
TEST(LostSurface, WallsWithinTheSolidDoNotCount) {
  PolygonMesh mesh = box({0.0, 0.0, 0.0}, {20.0, 10.0, 10.0});
  append(mesh, box({15.0, 0.0, 0.0}, {40.0, 10.0, 10.0}));
  const LostSurface lost = lost_of(mesh, 1.0);
  EXPECT_EQ(lost.lost_area, 0.0);
  // The sides of the overlap are there twice, and the walls within a voxel of the surface count.
  EXPECT_GE(lost.area, 1800.0 + 4 * 50.0);
  EXPECT_LE(lost.area, 1800.0 + 4 * 50.0 + 150.0);
}

}  // namespace lost_surface_test
}  // namespace hermesh
