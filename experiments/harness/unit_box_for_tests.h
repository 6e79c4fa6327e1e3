// The mesh that tests of the harness run variants on.
#pragma once

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// The cube from 0 to 1 along each axis: 8 points, 6 quads whose faces look outwards.
inline PolygonMesh unit_box() {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.points.emplace_back(float(i & 1), float(i >> 1 & 1), float(i >> 2));
  mesh.quads = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  return mesh;
}

}  // namespace hermesh
