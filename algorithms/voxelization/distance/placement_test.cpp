// Where a volume lies in the world, far from the origin above all.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>

#include "algorithms/io/mesh_file.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// The exact signed distance from p to a box, negative inside.
double to_box(const Vector3d& p, const Vector3d& low, const Vector3d& high) {
  const Vector3d out = (low - p).cwiseMax(p - high);
  return out.cwiseMax(0.0).norm() + std::min(out.maxCoeff(), 0.0);
}

/// A box whose coordinates went through a file of decimal numbers.
PolygonMesh box_from_file(const Vector3d& low, const Vector3d& high) {
  const auto path =
      std::filesystem::temp_directory_path() / ("hermesh-placement-" + std::to_string(getpid()) + ".obj");
  {
    std::ofstream file(path);
    file << std::setprecision(17);
    for (int i = 0; i < 8; ++i)
      file << "v " << (i & 1 ? high : low).x() << ' ' << (i & 2 ? high : low).y() << ' '
           << (i & 4 ? high : low).z() << '\n';
    file << "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
  }
  RunContext context;
  const PolygonMesh mesh = read_mesh(path, context);
  std::filesystem::remove(path);
  return mesh;
}

TEST(Placement, ObjectOfSizeOneAMillionAwayKeepsWhatTheFileHolds) {
  // A thousandth of a voxel is 1e-5 here, and single precision at a million has steps of 0.06.
  const Vector3d low(1e6 + 0.10437, -2e6 + 0.20591, 3e6 + 0.30113),
      high = low + Vector3d(1.00217, 0.80541, 0.9);
  const PolygonMesh mesh = box_from_file(low, high);
  RunContext context;
  const Voxelization result = voxelize(mesh, {.voxel_size = 0.01}, context);
  const openvdb::math::Transform& transform = result.distance->transform();
  std::size_t inside = 0;
  for (auto value = result.distance->cbeginValueOn(); value; ++value) {
    const openvdb::Vec3d at = transform.indexToWorld(value.getCoord());
    ASSERT_NEAR(*value, to_box({at[0], at[1], at[2]}, low, high), 3e-7) << value.getCoord();
    inside += *value < 0 ? 1 : 0;
  }
  EXPECT_GT(inside, 100'000u);
}

TEST(Placement, OriginOfTheMeshMovesTheTransformAlone) {
  const PolygonMesh near = box_from_file({0.1, 0.2, 0.3}, {1.1, 0.9, 1.3});
  PolygonMesh far = near;
  far.origin = {1e6, -2.5e6, 1e9};
  RunContext context;
  const Voxelization here = voxelize(near, {.voxel_size = 0.02}, context),
                     there = voxelize(far, {.voxel_size = 0.02}, context);
  ASSERT_TRUE(here.distance->tree().hasSameTopology(there.distance->tree()));
  for (auto a = here.distance->tree().cbeginLeaf(), b = there.distance->tree().cbeginLeaf(); a; ++a, ++b)
    ASSERT_EQ(std::memcmp(a->buffer().data(), b->buffer().data(), 512 * sizeof(float)), 0);
  const openvdb::Vec3d first = there.distance->transform().indexToWorld(openvdb::Coord(0, 0, 0));
  EXPECT_EQ(first, openvdb::Vec3d(1e6, -2.5e6, 1e9));
}

}  // namespace
}  // namespace hermesh
