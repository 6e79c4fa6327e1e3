// The part of a collapse's tests that keeps the mesh free of self-intersection (decimation.h).
#pragma once

#include "algorithms/extraction/manifold_dual_contouring/cube_mesh.h"

namespace hermesh {

/// Whether it is certain that the new triangles meet no other triangle and not one another, except in the corners and
/// edges that they share.
bool is_embedded(CubeMesh& cube, const Collapse& collapse);

}  // namespace hermesh
