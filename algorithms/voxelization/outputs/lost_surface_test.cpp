#include "algorithms/voxelization/outputs/lost_surface.h"

#include <gtest/gtest.h>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {
namespace {

void add_box(PolygonMesh& mesh, const Eigen::Vector3f& low, const Eigen::Vector3f& high) {
  const auto n = std::uint32_t(mesh.points.size());
  for (unsigned i = 0; i < 8; ++i)
    mesh.points.push_back(
        {i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z()});
  for (const Quad& q : {Quad{0, 2, 3, 1}, Quad{4, 5, 7, 6}, Quad{0, 1, 5, 4}, Quad{2, 6, 7, 3},
                        Quad{0, 4, 6, 2}, Quad{1, 3, 7, 5}})
    mesh.quads.push_back({n + q[0], n + q[1], n + q[2], n + q[3]});
}

LostSurface lost_of(const PolygonMesh& mesh, double voxel_size) {
  RunContext context;
  const LevelSet level_set = make_level_set(
      voxelize(mesh, {.voxel_size = voxel_size, .signs = SignRule::flood_fill}, context).distance);
  return find_lost_surface(mesh, level_set, true, context);
}

TEST(LostSurface, NothingIsLostOfSolidsThickerThanAVoxel) {
  PolygonMesh mesh;
  add_box(mesh, {0.3f, 0.3f, 0.3f}, {8.3f, 7.7f, 1.4f});
  const LostSurface lost = lost_of(mesh, 1.0);
  EXPECT_EQ(lost.lost_area, 0.0);
  EXPECT_NEAR(lost.area, 2 * (8.0 * 7.4 + 8.0 * 1.1 + 7.4 * 1.1), 1e-3);
  EXPECT_EQ(lost_surface_note(lost, 1.0), "");
}

TEST(LostSurface, AFinBetweenSamplesIsLost) {
  PolygonMesh mesh;
  add_box(mesh, {0.5f, 0.5f, 0.5f}, {10.5f, 10.5f, 10.5f});
  add_box(mesh, {8.5f, 1.5f, 4.3f}, {40.5f, 9.5f, 4.7f});
  const LostSurface lost = lost_of(mesh, 1.0);
  // From x = 10.5 on, its two sides and its edges; what is within a voxel of the body has the body's surface.
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
  PolygonMesh mesh;
  add_box(mesh, {0.5f, 0.5f, 0.5f}, {20.5f, 20.5f, 8.3f});
  add_box(mesh, {0.5f, 0.5f, 8.7f}, {20.5f, 20.5f, 16.5f});
  const LostSurface lost = lost_of(mesh, 1.0);
  EXPECT_LT(lost.lost_area, 2 * 400.0);
  EXPECT_GT(lost.lost_area, 2 * 16.0 * 16.0);
  EXPECT_NEAR(lost.thickness, 0.4, 1e-5);
}

/// The walls of the overlap bound nothing, so that nothing of the solid is lost with them.
TEST(LostSurface, WallsWithinTheSolidDoNotCount) {
  PolygonMesh mesh;
  add_box(mesh, {0.0f, 0.0f, 0.0f}, {20.0f, 10.0f, 10.0f});
  add_box(mesh, {15.0f, 0.0f, 0.0f}, {40.0f, 10.0f, 10.0f});
  const LostSurface lost = lost_of(mesh, 1.0);
  EXPECT_EQ(lost.lost_area, 0.0);
  // The sides of the overlap are there twice, and the walls within a voxel of the surface count.
  EXPECT_GE(lost.area, 1800.0 + 4 * 50.0);
  EXPECT_LE(lost.area, 1800.0 + 4 * 50.0 + 150.0);
}

}  // namespace
}  // namespace hermesh
