#include <gtest/gtest.h>

#include "algorithms/core/level_set_grid.h"
#include "reference/test_meshes.h"
#include "reference/variants.h"

namespace hermesh {
namespace exact_voxelizer_test {

/// Signed distance to an axis-aligned cube about the origin.
double cube_distance(const Eigen::Vector3d& p, double half) {
  const Eigen::Vector3d q = p.cwiseAbs() - Eigen::Vector3d::Constant(half);
  return q.cwiseMax(0.0).norm() + std::min(0.0, q.maxCoeff());
}

Eigen::Vector3d world(const openvdb::FloatGrid& grid, const openvdb::Coord& xyz) {
  const openvdb::Vec3d p = grid.transform().indexToWorld(xyz);
  return {p.x(), p.y(), p.z()};
}

TEST(ExactVoxelizer, TurnedCubeIsExactInValueSignAndBand) {
  const double half = 1.0, voxel = 0.09, exterior = 2.5, interior = 4.0;
  const LevelSet level_set = test::voxelize("exact", test::turned_cube(half), voxel, exterior, interior);
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  // Every voxel of a box around the cube: the band is exactly the voxels nearer than its width, on either
  // side.
  std::size_t active = 0, ties = 0;
  for (int x = -25; x <= 25; ++x)
    for (int y = -25; y <= 25; ++y)
      for (int z = -25; z <= 25; ++z) {
        const openvdb::Coord xyz(x, y, z);
        const double truth = cube_distance(test::turn().transpose() * world(grid, xyz), half);
        const double value = grid.tree().getValue(xyz);
        const double clamped = std::clamp(truth, -interior * voxel, exterior * voxel);
        ASSERT_NEAR(value, clamped, 1e-5) << xyz;
        if (std::abs(truth - clamped) > 1e-5) {
          EXPECT_FALSE(grid.tree().isValueOn(xyz)) << xyz;
        }
        if (truth < exterior * voxel - 1e-5 && truth > -interior * voxel + 1e-5) {
          EXPECT_TRUE(grid.tree().isValueOn(xyz)) << xyz;
          ++active;
        } else if (std::abs(truth - clamped) < 1e-5) {
          ++ties;
        }
      }
  EXPECT_GE(grid.activeVoxelCount(), active);
  EXPECT_LE(grid.activeVoxelCount(), active + ties);
}

TEST(ExactVoxelizer, SphereInsideIsFilledByTilesAndFramesFollow) {
  PolygonMesh mesh = test::sphere(10.0, 4);
  mesh.origin = Eigen::Vector3d(1e6, -1e6, 0.0);
  const LevelSet level_set = test::voxelize("exact", mesh, 0.25);
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  for (const double r : {0.0, 3.0, 6.0, 9.0, 9.6}) {
    const openvdb::Coord xyz = grid.transform().worldToIndexCellCentered({1e6 + r, -1e6, 0.0});
    EXPECT_LT(grid.tree().getValue(xyz), 0.0f) << r;
  }
  EXPECT_FLOAT_EQ(grid.tree().getValue({0, 0, 0}), -0.75f);
  EXPECT_FLOAT_EQ(grid.tree().getValue({100, 0, 0}), 0.75f);
}

TEST(ExactVoxelizer, WindingDoesNotMatterAndNestedShellsAlternate) {
  const PolygonMesh outer = test::sphere(1.0, 4), inner = test::sphere(0.5, 4);
  const LevelSet plain = test::voxelize("exact", test::joined(outer, inner), 0.1);
  const LevelSet turned = test::voxelize("exact", test::joined(test::reversed(outer), inner), 0.1);
  const openvdb::FloatGrid &a = *plain.grid().grid, &b = *turned.grid().grid;
  for (int x = 0; x <= 12; ++x) EXPECT_EQ(a.tree().getValue({x, 0, 0}), b.tree().getValue({x, 0, 0})) << x;
  EXPECT_GT(a.tree().getValue({0, 0, 0}), 0.0f);
  EXPECT_LT(a.tree().getValue({7, 0, 0}), 0.0f);
  EXPECT_GT(a.tree().getValue({12, 0, 0}), 0.0f);
}

TEST(ExactVoxelizer, DegenerateTrianglesChangeNothing) {
  const PolygonMesh clean = test::turned_cube(1.0);
  PolygonMesh dirty = clean;
  dirty.triangles = {{0, 0, 1}, {3, 3, 3}};
  const openvdb::FloatGrid::ConstPtr a = test::voxelize("exact", clean, 0.1).grid().grid,
                                     b = test::voxelize("exact", dirty, 0.1).grid().grid;
  ASSERT_EQ(a->activeVoxelCount(), b->activeVoxelCount());
  for (auto value = a->cbeginValueOn(); value; ++value)
    ASSERT_EQ(*value, b->tree().getValue(value.getCoord()));

  PolygonMesh flat = clean;
  flat.quads = {{0, 1, 0, 1}};
  EXPECT_THROW(test::voxelize("exact", flat, 0.1), Error);
}

TEST(ExactVoxelizer, OpenvdbAgreesNextToTheSurface) {
  const PolygonMesh mesh = test::sphere(1.0, 5);
  const double voxel = 0.05;
  const openvdb::FloatGrid::ConstPtr exact = test::voxelize("exact", mesh, voxel).grid().grid,
                                     other = test::voxelize("openvdb", mesh, voxel).grid().grid;
  EXPECT_NEAR(double(other->activeVoxelCount()), double(exact->activeVoxelCount()),
              0.02 * double(exact->activeVoxelCount()));
  double sum = 0.0, largest = 0.0;
  for (auto value = exact->cbeginValueOn(); value; ++value) {
    const double error = std::abs(*value - other->tree().getValue(value.getCoord())) / voxel;
    sum += error;
    largest = std::max(largest, error);
  }
  EXPECT_LT(sum / double(exact->activeVoxelCount()), 0.05);
  EXPECT_LT(largest, 1.2);
}

}  // namespace exact_voxelizer_test
}  // namespace hermesh
