#include "algorithms/remesh/auto_voxel.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>

#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace auto_voxel_test {

using Eigen::Vector3d;
using voxelize_for_tests::append;
using voxelize_for_tests::box;

AutoVoxel chosen(const PolygonMesh& mesh, const AutoVoxelLimits& limits = {}) {
  RunContext context;
  return auto_voxel(mesh, limits, context);
}

/// A block with a plate of some thickness next to it; the plate has a third of the area.
PolygonMesh block_and_plate(double thickness) {
  PolygonMesh mesh = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  append(mesh, box(Vector3d(1.5, 0, 0), Vector3d(1.5 + thickness, 1, 1)));
  return mesh;
}

TEST(AutoVoxel, SolidBodiesNeedTheFewestVoxels) {
  const AutoVoxel cube = chosen(box(Vector3d(0, 0, 0), Vector3d(1, 1, 1)));
  EXPECT_DOUBLE_EQ(cube.voxel_size, 1.0 / 200);
  EXPECT_EQ(cube.thin_share, 0.0);
  EXPECT_GT(cube.bytes, 1e6);
  EXPECT_LT(cube.seconds, 10.0);
  EXPECT_DOUBLE_EQ(chosen(voxelize_for_tests::sphere(Vector3d(9, 9, 9), 2.0)).voxel_size, 4.0 / 200);
}

TEST(AutoVoxel, APlateIsAsThickAsVoxelsCanShow) {
  for (const double thickness : {0.005, 0.007}) {
    const AutoVoxel made = chosen(block_and_plate(thickness));
    EXPECT_NEAR(made.voxel_size, thickness / 1.2, 1e-5);
    EXPECT_EQ(made.thin_share, 0.0);
  }
  // Voxels of the fewest that are permitted show this one.
  EXPECT_NEAR(chosen(block_and_plate(0.02)).voxel_size, 1.52 / 200, 1e-8);
}

TEST(AutoVoxel, OrientationDoesNotMatter) {
  PolygonMesh mesh = block_and_plate(0.005);
  for (Quad& quad : mesh.quads) std::swap(quad[1], quad[3]);
  // Walls count as gaps then, which larger voxels leave open.
  const double voxel_size = chosen(mesh).voxel_size;
  EXPECT_LE(voxel_size, 0.00501);
  EXPECT_GE(voxel_size, 0.005 / 1.2 - 1e-5);
}

TEST(AutoVoxel, AGapIsAsWideAsAVoxel) {
  PolygonMesh mesh = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  append(mesh, box(Vector3d(1.05, 0, 0), Vector3d(2.05, 1, 1)));
  EXPECT_NEAR(chosen(mesh, {.fewest_voxels = 20}).voxel_size, 0.05, 1e-6);
}

TEST(AutoVoxel, PartsThatAreNotVisibleDoNotCount) {
  PolygonMesh mesh = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  append(mesh, box(Vector3d(0.2, 0.2, 0.2), Vector3d(0.8, 0.8, 0.201)));
  EXPECT_DOUBLE_EQ(chosen(mesh).voxel_size, 1.0 / 200);
}

TEST(AutoVoxel, AShareMayBeThin) {
  // Of the surface of two blocks and a plate, the plate has a seventh.
  PolygonMesh mesh = block_and_plate(0.008);
  append(mesh, box(Vector3d(0, 2, 0), Vector3d(1, 3, 1)));
  EXPECT_NEAR(chosen(mesh, {.share = 0.13}).voxel_size, 0.008 / 1.2, 1e-5);
  EXPECT_DOUBLE_EQ(chosen(mesh, {.share = 0.16}).voxel_size, 3.0 / 200);
}

TEST(AutoVoxel, LimitsHoldForWallsAsThinAsAHair) {
  const AutoVoxelLimits limits;
  const AutoVoxel plate = chosen(box(Vector3d(0, 0, 0), Vector3d(1, 1, 1e-5)));
  EXPECT_NEAR(plate.wanted, 1e-5 / 1.2, 1e-7);
  EXPECT_NEAR(std::max(plate.bytes / limits.most_bytes, plate.seconds / limits.most_seconds), 1.0, 1e-9);
  EXPECT_NEAR(plate.thin_share, 1.0, 0.01);
  const AutoVoxel rod = chosen(box(Vector3d(0, 0, 0), Vector3d(1, 1e-5, 1e-5)));
  EXPECT_DOUBLE_EQ(rod.voxel_size, 1.0 / limits.most_voxels);
}

TEST(AutoVoxel, OpenSurfacesTakeMoreTime) {
  PolygonMesh sheet;
  sheet.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.quads = {{0, 1, 2, 3}};
  const AutoVoxel open = chosen(sheet), closed = chosen(box(Vector3d(0, 0, 0), Vector3d(1, 1, 1)));
  EXPECT_EQ(open.voxel_size, closed.voxel_size);
  EXPECT_EQ(open.thin_share, 0.0);
  EXPECT_NEAR(open.bytes, closed.bytes / 6, 1.0);
  EXPECT_GT(open.seconds, 2.0 * closed.seconds / 6);
}

TEST(AutoVoxel, SameAtAnyThreadCount) {
  std::vector<double> sizes;
  for (const std::size_t threads : {1u, 3u}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    sizes.push_back(
        chosen(voxelize_for_tests::sphere(Vector3d(0, 0, 0), 1.0), {.share = 0.5, .fewest_voxels = 2})
            .voxel_size);
  }
  EXPECT_EQ(sizes[0], sizes[1]);
}

TEST(AutoVoxel, PolygonsWithoutExtentHaveNoVoxelSize) {
  PolygonMesh mesh;
  mesh.points = {{1, 1, 1}};
  mesh.triangles = {{0, 0, 0}};
  EXPECT_EQ(chosen(mesh).voxel_size, 0.0);
}

}  // namespace auto_voxel_test
}  // namespace hermesh
