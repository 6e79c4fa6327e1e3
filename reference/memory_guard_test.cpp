// The memory check that precedes every voxelizer, and its estimate compared with the allocations of the exact
// voxelizer.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "algorithms/lattice/memory_estimate.h"
#include "reference/test_meshes.h"
#include "reference/variants.h"

namespace hermesh {
namespace memory_guard_test {

const double kInfinity = std::numeric_limits<double>::infinity(), kNan = std::nan("");

std::string refusal(const PolygonMesh& mesh, double voxel_size, double exterior = 3.0,
                    double interior = 3.0) {
  try {
    check_voxelization_fits(mesh, voxel_size, exterior, interior);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(MemoryGuard, RefusesBadArguments) {
  const PolygonMesh mesh = test::sphere(1.0, 3);
  for (const double voxel : {0.0, -1.0, kNan, kInfinity, -kInfinity})
    EXPECT_NE(refusal(mesh, voxel).find("voxel size"), std::string::npos) << voxel;
  for (const double band : {0.0, 0.5, -3.0, kNan, kInfinity}) {
    EXPECT_NE(refusal(mesh, 0.1, band, 3.0).find("band"), std::string::npos) << band;
    EXPECT_NE(refusal(mesh, 0.1, 3.0, band).find("band"), std::string::npos) << band;
  }
  EXPECT_EQ(refusal(mesh, 0.1), "");
}

TEST(MemoryGuard, RefusesBadMeshes) {
  EXPECT_NE(refusal(PolygonMesh{}, 0.1).find("no polygon"), std::string::npos);
  PolygonMesh mesh = test::sphere(1.0, 2);
  mesh.points[3].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(refusal(mesh, 0.1).find("not finite"), std::string::npos);
  mesh.points[3].y() = std::numeric_limits<float>::infinity();
  EXPECT_NE(refusal(mesh, 0.1).find("not finite"), std::string::npos);
}

TEST(MemoryGuard, RefusesWhatWouldNotFit) {
  const PolygonMesh mesh = test::sphere(1000.0, 3);
  // 4π(1000/0.001)² voxel faces times six voxels are 7.5e13 active voxels: near a petabyte.
  EXPECT_NE(refusal(mesh, 0.001).find("GiB"), std::string::npos);
  EXPECT_NE(refusal(mesh, 2e-5).find("GiB"), std::string::npos);
  EXPECT_NE(refusal(mesh, 1e-9).find("voxel size"), std::string::npos);
  PolygonMesh far = test::sphere(1.0, 3);
  far.points.emplace_back(1e6f, 0.0f, 0.0f);
  far.triangles.push_back({0, 1, std::uint32_t(far.points.size() - 1)});
  EXPECT_NE(refusal(far, 1e-4).find("range"), std::string::npos);
}

TEST(MemoryGuard, EveryVoxelizerIsGuarded) {
  const PolygonMesh mesh = test::sphere(1.0, 3);
  for (const Voxelizer& voxelizer : reference_voxelizers())
    for (const double voxel : {0.0, kNan, 1e-9})
      EXPECT_THROW(test::voxelize(voxelizer.name, mesh, voxel), Error) << voxelizer.name;
}

TEST(MemoryEstimate, IsRightWithinAFactorOfTwoForSurfaces) {
  for (const double voxel : {0.1, 0.05, 0.03})
    for (const double band : {1.0, 3.0, 5.0})
      for (const PolygonMesh& mesh :
           {test::sphere(1.0, 4), test::turned_cube(1.0), test::torus(1.0, 0.4, 40, 20)}) {
        const BandEstimate estimate = estimate_band(mesh, voxel, band, band);
        const LevelSet truth = test::voxelize("openvdb", mesh, voxel, band, band);
        const double active = estimate.active_voxels / double(truth.active_voxels());
        const double bytes = estimate.grid_bytes / double(truth.memory_bytes());
        EXPECT_TRUE(active > 0.5 && active < 2.0) << voxel << " " << band << " " << active;
        EXPECT_TRUE(bytes > 0.5 && bytes < 2.0) << voxel << " " << band << " " << bytes;
      }
}

TEST(MemoryEstimate, CountsScatteredPieces) {
  PolygonMesh mesh;
  for (int i = 0; i < 50; ++i)
    mesh = test::joined(mesh, test::sphere(0.01, 1, {7.0 * i, 3.0 * (i % 7), 0.0}));
  const BandEstimate estimate = estimate_band(mesh, 0.1, 3.0, 3.0);
  const LevelSet truth = test::voxelize("exact", mesh, 0.1);
  const double ratio = estimate.active_voxels / double(truth.active_voxels());
  EXPECT_GT(ratio, 0.5);
  EXPECT_LT(ratio, 8.0);
  const double bytes = estimate.grid_bytes / double(truth.memory_bytes());
  EXPECT_GT(bytes, 0.5);
  EXPECT_LT(bytes, 8.0);
}

TEST(MemoryEstimate, AvailableMemoryIsKnownHere) {
  const auto available = available_memory();
  ASSERT_TRUE(available.has_value());
  EXPECT_GT(*available, std::uint64_t(1) << 24);
}

}  // namespace memory_guard_test
}  // namespace hermesh
