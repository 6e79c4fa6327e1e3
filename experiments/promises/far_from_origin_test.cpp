// Meshes far from the world's origin: the written files satisfy the extractor's guarantees, or the mesh is
// refused with an error message.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "algorithms/variants.h"
#include "experiments/pipeline.h"
#include "experiments/promises/solids_for_tests.h"

namespace hermesh {
namespace far_from_origin_test {

using test_solids::placed;

/// Runs the pipeline of `hermesh remesh` and validates its result. @throws Error if the format could not hold
/// the mesh.
Outcome written(const PolygonMesh& mesh, double voxel_size, const std::string& format,
                const GivenOptions& given) {
  RunContext context;
  return run({.source = {.polygons = &mesh},
              .voxelize = {.chosen = choose(our_voxelizers(), "hermesh"), .voxel_size = voxel_size},
              .extract = {.chosen = choose(our_extractors(), "manifold-dual-contouring", given)},
              .format = format,
              .judge = kPromisesAlone},
             context);
}

/// Writes solids at many offsets, each in one of the formats, and validates the files.
void expect_no_defect(std::uint64_t first, std::uint64_t count, double least_exponent, double most_exponent) {
  const char* const kExtensions[] = {".ply", ".off", ".obj", ".stl"};
  std::size_t in_files = 0;
  for (std::uint64_t i = first; i < first + count; ++i) {
    recipes::Random random{double(i)};
    const double distance = std::pow(10.0, random.uniform(least_exponent, most_exponent));
    Eigen::Vector3d offset = distance * test_solids::random_vector(random, 1.0);
    if (i % 3 == 0) offset[int(i % 9 / 3)] = 0.0;
    const PolygonMesh mesh = placed(test_solids::solid(i), test_solids::random_turn(random), offset);
    const double voxel_size = 2.0 / random.uniform(12.0, 40.0);
    const std::string extension = kExtensions[i / 2 % 4];
    const GivenOptions options = i % 2 ? GivenOptions{} : GivenOptions{{"tolerance", "0"}};
    SCOPED_TRACE("number " + std::to_string(i) + ", " + std::to_string(distance) + " away, " + extension);
    try {
      const Outcome outcome = written(mesh, voxel_size, extension, options);
      ++in_files;
      EXPECT_GT(outcome.judgement.report.triangles + outcome.judgement.report.quads, 0);
      EXPECT_EQ(promise_letters({true, true, true, true}, outcome.judgement.promises), "cmoi kept");
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("rounds coordinates of"), std::string::npos) << error.what();
    }
  }
  // Double precision holds such meshes up to 10¹¹ and beyond, and STL those of the nearest.
  EXPECT_GE(in_files, count * 3 / 4);
  testing::Test::RecordProperty("written", std::to_string(in_files) + " of " + std::to_string(count));
}

TEST(FarFromOrigin, FilesKeepThePromises) { expect_no_defect(0, 16, 6.0, 11.0); }

TEST(FarFromOrigin, StlKeepsThemWhereItsPrecisionIsJustEnough) {
  // 10³ away a number of single precision is rounded by up to 3·10⁻⁵, and voxels are about 0.1.
  for (std::uint64_t i = 6; i < 40; i += 8) expect_no_defect(i, 2, 3.0, 3.5);
}

TEST(FarFromOrigin, WhatAFormatCannotHoldIsRefused) {
  const PolygonMesh mesh = placed(test_solids::solid(0), Eigen::Matrix3d::Identity(), {1e6, 0, 0});
  EXPECT_NO_THROW(written(mesh, 0.1, ".ply", {}));
  try {
    written(mesh, 0.1, ".stl", {});
    FAIL() << "single precision rounds by up to 0.03 there";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("write .ply, .obj, .off, .glb or .3mf"), std::string::npos)
        << error.what();
  }
  // Half of the distance of doubles at 10¹³ is 0.001, a hundredth of a voxel, and at 10¹⁴ ten times as much.
  const PolygonMesh farther = placed(test_solids::solid(0), Eigen::Matrix3d::Identity(), {1e14, 0, 0});
  EXPECT_THROW(written(farther, 0.1, ".ply", {}), Error);
}

TEST(Slow, MeshesFarFromTheOriginKeepThePromisesInTheirFiles) { expect_no_defect(1000, 500, 6.0, 11.0); }

}  // namespace far_from_origin_test
}  // namespace hermesh
