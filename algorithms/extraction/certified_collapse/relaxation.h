// Points of a merged mesh go where it is nearest to the fine mesh in the sense of least squares, as far as
// that can be proved.
//
// Collapses put a point where it is nearest to the *planes* of what it stands for (quadric.h). On a curved
// surface the triangles between such points lie on one side of it: on a paraboloid with the triangles of a
// regular lattice the root mean square distance is twice what points a little farther out would have. Here
// all points are moved for the sum of squared distances of the fine mesh to the triangles, each sweep with
// the fine mesh laid upon the triangles anew.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"
#include "algorithms/extraction/certified_collapse/merge_proof.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"

namespace hermesh {

/// Proposes moves of the merged mesh's points to `forest`, as sets above those that they move
/// (MergeForest::Node::moves); nothing is promised of them until MergeProof::prove() has been called. Each
/// way is proposed as a quarter, a half and the whole of it, one set above another, so that a proof that
/// fails takes back no more than it has to. The same proposals for every number of threads. All places in
/// voxels, index space.
/// @param forest whose merged mesh is moved; settled
/// @param merged the mesh of `forest`, as MergeProof returns it
/// @param fine the fine mesh
/// @param tolerance by point of `fine`, voxels: points go no farther from the fine mesh than a little less
/// @param pinned by point of `fine`: points that stay
/// @param sweeps how often the fine mesh is laid upon the triangles; 0 does nothing
/// @param file rounds places to the file's precision
/// @param context asked whether to stop
/// @throws Cancelled
void propose_relaxation(MergeForest& forest, const MergedMesh& merged, const FineMesh& fine,
                        std::span<const float> tolerance, std::span<const std::uint8_t> pinned, int sweeps,
                        const FilePoints& file, RunContext& context);

}  // namespace hermesh
