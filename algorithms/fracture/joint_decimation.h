// The joint mesh of all pieces with fewer triangles: seams stay one surface with two sides.
#pragma once

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/labelled_mesh.h"

namespace hermesh {

/// Merges vertices within the patches of the mesh; a *patch* is the triangles between the same two pieces, or
/// one piece and the outside, that the same cutter made. The vertices of patch boundaries are pinned, so
/// merging never crosses a change of labels, and a seam has the same triangles on both of its sides because
/// it is stored only once. The guarantees of JointMesh also hold afterwards, and no position of the mesh
/// before or after is farther than `tolerance` voxels (and 0.005) from the other mesh
/// (certified_decimation.h). Each connected part of a piece's boundary keeps its sign and 99 % of its volume:
/// where merging would change it by more, the tolerance is lowered for that part. A tolerance of 0 leaves the
/// mesh unchanged. The result has the same bytes at any thread count. @throws Cancelled.
void decimate_joint_mesh(JointMesh& mesh, double tolerance, RunContext& context);

}  // namespace hermesh
