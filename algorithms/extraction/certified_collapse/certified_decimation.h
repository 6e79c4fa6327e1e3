// A coarse mesh whose distance from a fine one is proved.
//
// *Propose*: sets of points become one, the minimiser of the squared distances to the planes of all triangles
// that they stand for (quadrics, Garland & Heckbert 1997): first those of blocks of up to 16 voxels
// (block_forest.h), then the ends of edges, cheapest first (decimation.h). *Prove*: the mesh that results
// (merge_proof.h). What cannot be proved is taken back, set by set, into the smaller sets that it was made
// of, at last into single points; so this ends, at worst with the fine mesh. Collapses come boldly first, by
// the quadrics alone and shy of the tolerance, which does much of the work in a small part of the time; then
// with care; and once the proof has taken sets back with care again, around these alone.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/shell_volumes.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"

namespace hermesh {

/// A coarse mesh, with the fine triangle that each of its triangles stands for.
struct CertifiedMesh {
  std::vector<Eigen::Vector3d> points;  ///< FilePoints::rounded()
  std::vector<Triangle> triangles;
  /// For each triangle one of the fine mesh, whose corners went into the corners of this one.
  std::vector<std::uint32_t> fine_triangle;
};

/// What is done for the root mean square distance, beside the bound of the greatest one.
struct Nearness {
  /// Greatest cost of a collapse, voxels⁴ (collapse_edges()); 0 for none, so that triangles are as few as the
  /// tolerance allows.
  double moment = 0;
  /// Sweeps of propose_relaxation() over the mesh; 0 for none.
  int relaxation = 0;
};

/// Merges points of a fine mesh where the outcome is proved: the same topology, no two triangles that meet,
/// each shell facing the way it did, and the distance both ways. A triangle's tolerance is the least of its
/// corners. Each place of the fine mesh is within its triangle's tolerance and kDistanceSlack of the coarse
/// one, and for each place of the coarse one there is a fine triangle within its own tolerance and that
/// slack, which where tolerances differ need not be the nearest. The same bytes for every number of threads.
/// @param fine closed and oriented, or a complex of patches; index space
/// @param tolerance by point of `fine`, voxels. Points with none stay where they are, and none goes into
///   another; others may go into them.
/// @param pinned by point of `fine`, or empty: further points that stay. Where more than two triangles meet
///   in an edge its ends must be pinned; so a complex of patches keeps their rims.
/// @param file rounds places to the file's precision
/// @param context told of progress, and asked whether to stop
/// @param nearness for the root mean square distance
/// @param pieces of each triangle of a complex (shell_volumes.h); empty for a closed mesh
/// @throws Cancelled
CertifiedMesh decimate_certified(const FineMesh& fine, const std::vector<float>& tolerance,
                                 std::vector<std::uint8_t> pinned, const FilePoints& file,
                                 RunContext& context, const Nearness& nearness = {},
                                 std::span<const TrianglePieces> pieces = {});

}  // namespace hermesh
