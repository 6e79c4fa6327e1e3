// The points of a block become one where the surface is flat: the first, cheap step of a decimation (decimation.h).
#pragma once

#include "algorithms/extraction/manifold_dual_contouring/cube_collapse.h"

namespace hermesh {

/// Lattice-aligned blocks of `width` voxels. The vertices of a block that hang together become one point if the faces
/// around them are a disc, so that the topology stays, and if the collapse passes its tests. One such test does the work of
/// dozens of collapses of edges.
void merge_blocks(CubeCollapse& collapses, double width, const RunContext& context);

}  // namespace hermesh
