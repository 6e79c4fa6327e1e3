// Extractors as parameters of tests, and inputs for them.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/variants.h"
#include "experiments/pipeline.h"

namespace hermesh {

/// Names a test's extractor; GoogleTest would print its bytes.
inline void PrintTo(const Extractor& extractor, std::ostream* out) { *out << extractor.name; }

namespace test_methods {

inline std::string test_name(const testing::TestParamInfo<Extractor>& info) {
  std::string name = info.param.name;
  std::ranges::replace(name, '-', '_');
  return name;
}

inline bool has_option(const Extractor& extractor, const std::string& name) {
  return std::ranges::find(extractor.options, name, &OptionSpec::name) != extractor.options.end();
}

/// Extracts with floats as Hermite data where the thesis's ten bytes would lose crossings.
inline EndedMesh extract_all(const Extractor& extractor, const LevelSet& volume, double isovalue, Ends ends,
                             RunContext& context, GivenOptions given = {}) {
  if (has_option(extractor, "lost_crossings")) given["representation"] = "sparse-float";
  const Options options(extractor.name, extractor.options, given);
  return extract(volume, nullptr, {.chosen = {extractor, options}, .isovalue = isovalue, .ends = ends},
                 context);
}

/// Expects the guarantees, without self-intersections if there is no guarantee about them; returns the
/// report.
inline validation::MeshReport expect_guarantees(const Promises& promises, const MeshFile& mesh,
                                                RunContext& context,
                                                const Circumstances& circumstances = {}) {
  const auto& [report, check] =
      judge(mesh, promises, promises.no_self_intersection ? kPromisesAlone : kCounts, context, circumstances);
  EXPECT_TRUE(check.broken.empty() && check.unchecked.empty()) << promise_verdict(promises, check);
  return report;
}

inline LevelSet voxelized(const PolygonMesh& mesh, double voxel_size, RunContext& context,
                          const GivenOptions& given = {}) {
  return voxelize(mesh, {.chosen = choose(our_voxelizers(), "hermesh", given), .voxel_size = voxel_size},
                  context);
}

/// Returns a sphere about the origin with a band of any width; OpenVDB's function makes none of a voxel or
/// less.
inline openvdb::FloatGrid::Ptr sphere_band(float radius, float voxel, float width) {
  initialize_openvdb();
  const float background = width * voxel;
  auto grid = openvdb::FloatGrid::create(background);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->setTransform(openvdb::math::Transform::createLinearTransform(voxel));
  for (const openvdb::Coord& at : openvdb::CoordBBox(openvdb::Coord(-26), openvdb::Coord(26))) {
    const auto distance = static_cast<float>(at.asVec3d().length() * voxel - radius);
    if (std::fabs(distance) < background)
      grid->tree().setValueOn(at, distance);
    else if (distance < 0)
      grid->tree().setValueOff(at, -background);
  }
  return grid;
}

}  // namespace test_methods
}  // namespace hermesh
