// Proof that two meshes are nowhere farther apart than a bound.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/extraction/manifold_dual_contouring/decimation.h"

namespace hermesh {

/// What could not be proved, as the samples that have a part in it; ascending, once each.
struct DistanceCertificate {
  std::vector<std::uint32_t> samples;
  std::uint64_t fine_triangles = 0, coarse_triangles = 0;  ///< that were not proved
  bool holds() const { return fine_triangles + coarse_triangles == 0; }
};

/// **What it proves.** A piece of a triangle whose corners are within d of one triangle of the other mesh is so as a whole,
/// for the distance to a convex set is convex. Every triangle of either mesh is cut into pieces until that holds of each,
/// or until it is so small that its middle's distance and its radius add up to no more than d + 0.005, where d is the least
/// tolerance of the samples of the fine triangle concerned. So both one-sided Hausdorff distances are at most the tolerance
/// and 0.005 voxel.
///
/// Not searched, because decimate() has seen to it edge by edge (decimation.h): fine triangles whose corners are attached
/// to triangles that touch one another and face the same way within 60 degrees. (The same was tried for coarse triangles
/// and let a distance of 0.2576 pass for 0.25.)
///
/// `tolerance` by sample, voxels.
DistanceCertificate certify_distance(const DecimatedMesh& mesh, std::span<const float> tolerance, RunContext& context);

}  // namespace hermesh
