// The joint mesh of all pieces with fewer triangles: seams stay one surface with two sides.
#pragma once

#include "algorithms/core/run_context.h"
#include "algorithms/fracture/labelled_mesh.h"

namespace hermesh {

/// Merges points within the patches of the mesh, a patch being what lies between the same two pieces and was cut by the same
/// cutter. The points of rims, where patches meet, stay as they are, so merging never crosses a change of labels, and a
/// seam has the same triangles on both of its sides because it is there only once. What the joint mesh guarantees holds
/// after it; and no point of the mesh is farther than `tolerance` voxels (and 0.005) from the one before, or that from it
/// (certified_decimation.h).
/// The same bytes at any thread count. @throws Cancelled.
void decimate_joint_mesh(JointMesh& mesh, double tolerance, RunContext& context);

}  // namespace hermesh
