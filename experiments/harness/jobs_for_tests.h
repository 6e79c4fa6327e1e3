// The job that tests of cells change, and the box that they run it on.
#pragma once

#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "experiments/harness/job.h"

namespace hermesh {

/// Returns the cube from 0 to 1 along each axis: 8 points, 6 quads whose faces look outwards.
inline PolygonMesh unit_box() {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.points.emplace_back(float(i & 1), float(i >> 1 & 1), float(i >> 2));
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return mesh;
}

inline VariantEntry variant(const std::string& name) { return {.name = name, .label = name}; }

/// Returns a job without pictures that times each variant three times.
inline GroupJob group_job(const std::string& input, int resolution,
                          const std::vector<VariantEntry>& variants) {
  GroupJob job;
  job.head = {{"experiment", "toy"}};
  job.input = input;
  job.resolution = resolution;
  job.variants = variants;
  job.voxelizer = variant("openvdb");
  job.repetitions = 3;
  job.samples = 500;
  job.pixels = 0;
  job.files = input;
  return job;
}

}  // namespace hermesh
