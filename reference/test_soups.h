// Meshes of a few thousand triangles that cross one another, as people's models do, and worse.
#pragma once

#include <cstdint>
#include <string>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh::test {

struct Soup {
  std::string name;  ///< kind of soup, number of triangles and resolution
  PolygonMesh mesh;
  double voxel_size = 1.0;  ///< world units
};

/// Returns a soup of 100 to 10,000 triangles and 12 to 400 voxels along its longest side, which only the seed
/// determines, on every platform: triangles at random, balls that overlap, turned boxes, tori that cross
/// themselves, spikes out of a middle, or sheets stacked closer than a voxel.
Soup soup(std::uint64_t seed);

}  // namespace hermesh::test
