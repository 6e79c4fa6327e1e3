#include "algorithms/io/grid_frame.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "algorithms/core/error.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"

namespace hermesh {
namespace grid_frame_test {

using Eigen::Vector3d;
using openvdb::math::Transform;

double to_box(const Vector3d& p, const Vector3d& low, const Vector3d& high) {
  const Vector3d out = (low - p).cwiseMax(p - high);
  return out.cwiseMax(0.0).norm() + std::min(out.maxCoeff(), 0.0);
}

PolygonMesh box(const Vector3d& low, const Vector3d& high) {
  PolygonMesh mesh;
  mesh.origin = choose_origin({low, high});
  for (int i = 0; i < 8; ++i)
    mesh.points.push_back(
        (Vector3d((i & 1 ? high : low).x(), (i & 2 ? high : low).y(), (i & 4 ? high : low).z()) - mesh.origin)
            .cast<float>());
  mesh.quads = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return mesh;
}

Transform::Ptr turned(double voxel_size, const Vector3d& offset) {
  const auto transform = Transform::createLinearTransform(voxel_size);
  transform->postRotate(0.4, openvdb::math::X_AXIS);
  transform->postRotate(-0.9, openvdb::math::Z_AXIS);
  transform->postTranslate({offset.x(), offset.y(), offset.z()});
  return transform;
}

/// A level set of a box, made on the lattice of the transform; every value is checked against the box.
std::vector<openvdb::GridBase::Ptr> voxelized(const Vector3d& low, const Vector3d& high,
                                              const Transform::Ptr& transform, double tolerance) {
  const GridFrame frame = grid_frame(*transform);
  const FramedMesh framed = into_frame(box(low, high), frame);
  RunContext context;
  const auto grids = make_volume_outputs(framed.mesh, {.voxel_size = frame.voxel_size},
                                         parse_volume_request("sdf,triangle-id,closest-point"), context)
                         .grids;
  out_of_frame(grids, frame, framed.first);
  const auto sdf = openvdb::gridPtrCast<openvdb::FloatGrid>(grids[0]);
  const auto closest = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grids[2]);
  const auto points = closest->getConstAccessor();
  const auto zero = closest->metaValue<openvdb::Vec3d>("hermesh_origin");
  EXPECT_GT(sdf->activeVoxelCount(), 5000u);
  for (auto value = sdf->cbeginValueOn(); value; ++value) {
    const openvdb::Vec3d world = transform->indexToWorld(value.getCoord());
    const Vector3d at(world[0], world[1], world[2]);
    const openvdb::Vec3d p = zero + openvdb::Vec3d(points.getValue(value.getCoord()));
    EXPECT_NEAR(*value, to_box(at, low, high), tolerance);
    EXPECT_NEAR(to_box({p[0], p[1], p[2]}, low, high), 0.0, tolerance);
    EXPECT_NEAR((p - world).length(), std::abs(*value), tolerance);
    if (testing::Test::HasFailure()) break;
  }
  return grids;
}

TEST(GridFrame, TurnedLatticeHoldsTheDistancesOfTheWorld) {
  const auto grids = voxelized({0.2, -0.4, 0.1}, {1.9, 0.7, 1.3}, turned(0.05, {3.1, -2.2, 0.7}), 2e-6);
  for (const auto& grid : grids) {
    const openvdb::Vec3d here = grid->transform().indexToWorld(openvdb::Vec3d(10, 20, -30)),
                         there = turned(0.05, {3.1, -2.2, 0.7})->indexToWorld(openvdb::Vec3d(10, 20, -30));
    EXPECT_LT((here - there).length(), 1e-12);
  }
}

TEST(GridFrame, MeshFarFromTheLatticesOriginKeepsItsPrecision) {
  // 20 million voxels away: single precision would be off by a whole voxel.
  voxelized({1e6 + 0.2, -0.4, 0.1}, {1e6 + 1.9, 0.7, 1.3}, turned(0.05, {0, 0, 0}), 2e-5);
}

TEST(GridFrame, TwoVolumesOnOneLatticeAgreeVoxelByVoxel) {
  const auto transform = turned(0.05, {3.1, -2.2, 0.7});
  const auto a = voxelized({0, 0, 0}, {1, 1, 1}, transform, 2e-6),
             b = voxelized({0, 0, 0}, {2, 1, 1}, transform, 2e-6);
  EXPECT_EQ(a[0]->transform(), b[0]->transform());
  // Where both are nearest to the common face x = 0, they hold the same.
  const auto first = openvdb::gridPtrCast<openvdb::FloatGrid>(a[0]);
  const auto second = openvdb::gridPtrCast<openvdb::FloatGrid>(b[0])->getConstAccessor();
  std::size_t common = 0;
  for (auto value = first->cbeginValueOn(); value; ++value) {
    const openvdb::Vec3d at = transform->indexToWorld(value.getCoord());
    if (at[0] > 0.3 || at[1] < 0.4 || at[1] > 0.6 || at[2] < 0.4 || at[2] > 0.6) continue;
    EXPECT_NEAR(*value, second.getValue(value.getCoord()), 1e-6);
    ++common;
  }
  EXPECT_GT(common, 50u);
}

TEST(GridFrame, DistancesThatDependOnTheDirectionAreRefused) {
  const auto stretched = Transform::createLinearTransform(0.1);
  stretched->preScale(openvdb::Vec3d(1, 1, 1.01));
  EXPECT_THROW(grid_frame(*stretched), Error);
  const auto sheared = Transform::createLinearTransform(0.1);
  sheared->preShear(0.1, openvdb::math::X_AXIS, openvdb::math::Y_AXIS);
  EXPECT_THROW(grid_frame(*sheared), Error);
  const auto mirrored = Transform::createLinearTransform(0.1);
  mirrored->preScale(openvdb::Vec3d(-1, 1, 1));
  EXPECT_THROW(grid_frame(*mirrored), Error);
  EXPECT_THROW(read_grid_frame("/nowhere/there.vdb"), Error);
}

}  // namespace grid_frame_test
}  // namespace hermesh
