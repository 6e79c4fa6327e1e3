// Decimation of a fine mesh with a proved bound of the distance.
//
// *Propose* (merge_proposals.h): sets of vertices are merged into one vertex, the minimiser of the squared
// distances to the planes of all triangles that they represent (quadrics, Garland & Heckbert 1997): first the
// vertices of blocks of up to 16 voxels, then the ends of edges, cheapest first. *Prove* (merge_proof.h): the
// resulting mesh is checked. Merges that cannot be proved are undone, set by set, down to single vertices if
// necessary, so the algorithm terminates, at worst with the fine mesh. Unverified collapses
// (Collapses::bold), which evaluate only the quadrics and stay well below the tolerance, do much of the work
// in a small part of the time; verified ones (Collapses::careful) follow, and are repeated around the sets
// that the proof has split.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/shell_volumes.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/point_target.h"

namespace hermesh {

/// A coarse mesh, with the fine triangle that each of its triangles originates from.
struct CertifiedMesh {
  std::vector<Eigen::Vector3d> points;  ///< FilePoints::rounded()
  std::vector<Triangle> triangles;
  std::vector<std::uint32_t>
      fine_triangle;  ///< by triangle: the fine one whose corners were merged into its own
};

/// Settings that lower the root mean square distance; the bound of the largest distance holds regardless.
struct Nearness {
  double moment = 0;   ///< DecimationInput::moment; 0: as few triangles as the tolerance admits
  int relaxation = 0;  ///< sweeps of propose_relaxation(); 0: none
};

/// Merges vertices of a fine mesh as far as the result is proved: it has the same topology, no two triangles
/// intersect, each shell keeps its orientation, and the two-sided distance is bounded. The tolerance of a
/// triangle is the least of its corners. Every position on the fine mesh is within its triangle's tolerance
/// and kDistanceSlack of the coarse mesh, and every position on the coarse mesh is within the tolerance of
/// some fine triangle and that slack; where tolerances differ, this need not be the nearest triangle. The
/// result is identical for any number of threads.
/// @param fine closed and oriented, or a complex of patches, or open if all triangles around the vertices
/// that
///   are not pinned are part of it; index space
/// @param tolerance by vertex of `fine`, voxels. Vertices with tolerance 0 do not move, and none is merged
///   into another; others may be merged into them.
/// @param pinned by vertex of `fine`, or empty: further vertices that stay fixed. The ends of edges with more
///   than two triangles must be pinned, which preserves the boundaries of a complex's patches.
/// @param file rounds positions to the file's precision
/// @param pieces of each triangle of a complex (shell_volumes.h); empty for a closed mesh
/// @param within open box that all positions of merged vertices lie in; it must contain the triangles around
///   the vertices that are not pinned
/// @param missed better positions of vertices of `fine`, ascending (UniformMesh)
/// @throws Cancelled
CertifiedMesh decimate_certified(const FineMesh& fine, const std::vector<float>& tolerance,
                                 std::vector<std::uint8_t> pinned, const FilePoints& file,
                                 RunContext& context, const Nearness& nearness = {},
                                 std::span<const TrianglePieces> pieces = {},
                                 const Bounds& within = Bounds::unbounded(),
                                 std::span<const MissedTarget> missed = {});

}  // namespace hermesh
