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

/// **What it proves.** Most triangles of either mesh are covered by the other one right above or below, no farther away than
/// d (triangle_overlay.h), where d is the least tolerance of the samples of the fine triangle concerned. The others, at
/// creases and rims, are cut into pieces until each is covered so, or until its corners are within d of one triangle (the
/// distance to a convex set is convex), or until it is so small that its middle's distance and its radius add up to no more
/// than d + 0.005. So both one-sided Hausdorff distances are at most the tolerance and 0.005 voxel. Nothing that decimate()
/// has looked at is trusted.
///
/// If `before` is given, only what differs from that is looked at, and the fine triangles round about.
///
/// `tolerance` by sample, voxels.
DistanceCertificate certify_distance(const DecimatedMesh& mesh, std::span<const float> tolerance,
                                     const DecimatedMesh* before, RunContext& context);

}  // namespace hermesh
