// Volumes of every kind through each of our extractors: the mesh is closed or empty, or the volume is
// refused.
#include <openvdb/tools/LevelSetUtil.h>

#include <functional>
#include <random>

#include "experiments/promises/methods_for_tests.h"

namespace hermesh {
namespace any_volume_test {

using openvdb::Coord;
using openvdb::FloatGrid;

class AnyVolume : public testing::TestWithParam<Extractor> {
 protected:
  /// Tolerance 0, since merging does not change which volumes are closed, and certifying it on noise takes
  /// long.
  PolygonMesh extract(const FloatGrid::Ptr& grid, double isovalue, Ends ends = Ends::closed) {
    GivenOptions given;
    if (test_methods::has_option(GetParam(), "tolerance")) given["tolerance"] = "0";
    return test_methods::extract_all(GetParam(), make_level_set(grid), isovalue, ends, context, given).mesh;
  }
  /// Expects the guarantees and no boundary; returns the number of triangles.
  std::size_t expect_closed(const FloatGrid::Ptr& grid, double isovalue) {
    SCOPED_TRACE("isovalue " + std::to_string(isovalue));
    const PolygonMesh mesh = extract(grid, isovalue);
    const MeshFile file = to_mesh_file(mesh);
    if (file.triangle_count() == 0) return 0;
    Promises promises = GetParam().promises;
    // As printed it guarantees nothing, since its ten bytes lose crossings; without losses its meshes are
    // closed.
    if (test_methods::has_option(GetParam(), "lost_crossings")) promises.closed = promises.oriented = true;
    EXPECT_TRUE(promises.closed && promises.oriented);
    const PromiseCheck check = judge(file, promises, kCounts, context).promises;
    EXPECT_TRUE(check.broken.empty()) << promise_verdict(promises, check);
    for (const Eigen::Vector3f& point : mesh.points) EXPECT_TRUE(point.allFinite());
    return file.triangle_count();
  }
  RunContext context;
};

FloatGrid::Ptr scan(const Coord& size, float background, const std::function<float(const Coord&)>& value) {
  initialize_openvdb();
  auto grid = FloatGrid::create(background);
  for (const Coord& at : openvdb::CoordBBox(Coord(0), size.offsetBy(-1)))
    grid->tree().setValue(at, value(at));
  return grid;
}

FloatGrid::Ptr integers(int values, std::uint32_t seed) {
  std::mt19937 random(seed);
  return scan(Coord(24, 20, 17), -1.0f,
              [&](const Coord&) { return float(int(random() % std::uint32_t(values))); });
}

/// Returns the level set of a ball with a radius of ten voxels.
FloatGrid::Ptr sphere(float width) { return test_methods::sphere_band(5.13f, 0.5f, width); }

TEST_P(AnyVolume, IntegersAtIntegerIsovalues) {
  const FloatGrid::Ptr grid = integers(5, 1);
  for (const double isovalue : {0.0, 1.0, 2.0, 3.0, 0.5})
    EXPECT_GT(expect_closed(grid, isovalue), 0u) << isovalue;
  // No value is greater than the greatest; below the least everything is inside, or the background changes
  // sides.
  for (const double isovalue : {4.0, 1e30, -1.0, -1e30}) EXPECT_EQ(expect_closed(grid, isovalue), 0u);
  EXPECT_GT(expect_closed(grid, -0.5), 0u);  // all of the box
}

TEST_P(AnyVolume, SmoothIntegersAtIntegerIsovalues) {
  const FloatGrid::Ptr grid = scan(Coord(32), -2000.0f, [](const Coord& at) {
    return std::floor(100.0f * std::sin(0.4f * at.x()) * std::cos(0.3f * at.y()) + 5.0f * at.z());
  });
  for (const double isovalue : {0.0, 50.0, 75.0, 100.0}) EXPECT_GT(expect_closed(grid, isovalue), 0u);
}

TEST_P(AnyVolume, BandsOfAVoxelAndLess) {
  for (const float width : {0.5f, 0.6f, 0.9f, 1.0f, 1.2f, 2.0f}) {
    const FloatGrid::Ptr grid = sphere(width);
    SCOPED_TRACE(width);
    EXPECT_GT(expect_closed(grid, 0.0), 0u);
    const double background = grid->background();
    for (const double share : {0.5, 0.9, -0.5, -0.9})
      EXPECT_GT(expect_closed(grid, share * background), 0u) << share;
  }
}

TEST_P(AnyVolume, IsovaluesAtAndBeyondTheBackground) {
  const FloatGrid::Ptr grid = sphere(3.0f);
  const double background = grid->background();
  expect_closed(grid, background);
  expect_closed(grid, -background);
  for (const double isovalue : {1.01 * background, -1.01 * background, 1e10, -1e10})
    EXPECT_EQ(expect_closed(grid, isovalue), 0u) << isovalue;
  const FloatGrid::Ptr fog = sphere(3.0f);
  openvdb::tools::sdfToFogVolume(*fog);
  for (const double isovalue : {0.001, 0.5, 0.999}) EXPECT_GT(expect_closed(fog, isovalue), 0u) << isovalue;
  for (const double isovalue : {0.0, 1.0, 2.0, -1.0}) expect_closed(fog, isovalue);
}

TEST_P(AnyVolume, SamplesExactlyAtTheIsovalue) {
  // A plane of samples at 0, then a block whose faces lie on samples, as a level set and as a scan.
  for (const auto grid_class : {openvdb::GRID_LEVEL_SET, openvdb::GRID_UNKNOWN}) {
    const FloatGrid::Ptr grid = scan(Coord(20), 8.0f, [](const Coord& at) {
      const Coord d = (at - Coord(10));
      return float(std::max({std::abs(d.x()), std::abs(d.y()), std::abs(d.z())}) - 6);
    });
    grid->setGridClass(grid_class);
    EXPECT_GT(expect_closed(grid, 0.0), 0u);
    EXPECT_GT(expect_closed(grid, -1.0), 0u);
    expect_closed(grid, 3.0);
    expect_closed(grid, 4.0);
  }
}

TEST_P(AnyVolume, TilesOfTheOtherSign) {
  initialize_openvdb();
  for (const auto grid_class : {openvdb::GRID_LEVEL_SET, openvdb::GRID_UNKNOWN, openvdb::GRID_FOG_VOLUME})
    for (const bool active : {false, true}) {
      auto grid = FloatGrid::create(1.0f);
      grid->setGridClass(grid_class);
      grid->tree().addTile(1, Coord(0, 0, 0), -1.0f, active);
      grid->tree().addTile(1, Coord(8, 8, 0), -0.5f, true);
      for (const Coord& at : openvdb::CoordBBox(Coord(8, 0, 0), Coord(11, 7, 7)))
        grid->tree().setValue(at, 0.5f);
      for (const Coord& at : openvdb::CoordBBox(Coord(0, 0, 8), Coord(3, 3, 9)))
        grid->tree().setValue(at, -0.25f);
      EXPECT_GT(expect_closed(grid, 0.0), 0u);
    }
}

TEST_P(AnyVolume, BandWithVoxelsMissing) {
  // A quarter of the active voxels lost: inactive, with the background's value of either sign.
  std::mt19937 random(3);
  for (const float sign : {1.0f, -1.0f}) {
    const FloatGrid::Ptr grid = sphere(3.0f);
    for (auto it = grid->beginValueOn(); it; ++it)
      if (random() % 4 == 0) {
        it.setValue(sign * grid->background());
        it.setActiveState(false);
      }
    EXPECT_GT(expect_closed(grid, 0.0), 0u);
  }
}

TEST_P(AnyVolume, WhatIsNotFiniteIsRefused) {
  for (const float bad : {std::nanf(""), INFINITY, -INFINITY}) {
    const FloatGrid::Ptr grid =
        scan(Coord(9), -1.0f, [=](const Coord& at) { return at == Coord(4) ? bad : float(at.x()); });
    EXPECT_THROW(extract(grid, 3.0), Error);
  }
  EXPECT_THROW(extract(integers(3, 2), NAN), Error);
  EXPECT_THROW(extract(integers(3, 2), INFINITY), Error);
}

TEST_P(AnyVolume, NoiseThatFillsTheBoxIsClosedAndOpened) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> value(-1.0f, 1.0f);
  const FloatGrid::Ptr grid = scan(Coord(20, 21, 22), -1.0f, [&](const Coord&) { return value(random); });
  EXPECT_GT(expect_closed(grid, 0.1), 0u);
  const PolygonMesh open = extract(grid, 0.1, Ends::open);
  const auto report = validation::check_mesh(to_mesh_file(open), kCounts, context);
  EXPECT_GT(report.boundary_edges, 100);
  EXPECT_EQ(report.inconsistent_edges, 0);
  for (std::size_t i = 0; i < open.points.size(); ++i) {
    EXPECT_GE(open.world(i).minCoeff(), -1e-6);
    EXPECT_LE(open.world(i).z(), 21.0 + 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Ours, AnyVolume, testing::ValuesIn(our_extractors().begin(), our_extractors().end()),
                         test_methods::test_name);

}  // namespace any_volume_test
}  // namespace hermesh
