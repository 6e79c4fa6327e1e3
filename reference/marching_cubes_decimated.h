// The most common approach to few triangles: marching cubes (ours), then quadric edge collapse (Garland &
// Heckbert 1997) by OpenMesh, sequentially.
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

/// Runs marching cubes, and decimates the mesh by OpenMesh. Options: `triangles`, the budget (0 = use the
/// fraction); `fraction` of marching cubes' own triangles; `normal_flip`, the largest turn of a triangle's
/// normal in one collapse, in degrees (180 = any). OpenMesh collapses a point into a neighbour, so every
/// point is one of marching cubes'. A collapse that would change the topology is not made: the mesh stays
/// closed and manifold, and if that leaves it above its budget, a note reports it.
/// @throws Cancelled; Error if OpenMesh cannot load the mesh
PolygonMesh marching_cubes_decimated(const ExtractionInput& input);

/// Runs only the decimation: quadric edge collapse to at most `budget` triangles, as far as the topology
/// permits.
PolygonMesh decimate(const PolygonMesh& mesh, std::size_t budget, double normal_flip_degrees,
                     RunContext& context);

}  // namespace hermesh
