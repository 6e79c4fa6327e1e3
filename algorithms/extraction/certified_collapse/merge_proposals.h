// The three steps that propose merges of vertices of a fine mesh: blocks, edge collapses and moves. A
// proposal carries no guarantee; MergeProof (merge_proof.h) decides what remains. All lengths in voxels,
// index space; each step gives the same proposals for any number of threads, and throws Cancelled.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"
#include "algorithms/extraction/certified_collapse/merge_proof.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/point_target.h"

namespace hermesh {

/// Input that all steps share.
struct DecimationInput {
  const FineMesh& fine;
  std::span<const float> tolerance;      ///< by vertex of `fine`
  std::span<const std::uint8_t> pinned;  ///< by vertex of `fine`: 1 where it stays single and unmoved
  /// 0: a collapse costs the squared distances to the planes of all that the new vertex represents, and
  /// collapses continue as far as their tests allow. Otherwise the largest cost of a collapse, voxels⁴, which
  /// is the area-weighted sum of squared distances of the new vertex to the planes of the current triangles
  /// around the edge: memoryless, cheapest first (Lindstrom & Turk 1998).
  double moment;
  const FilePoints& file;                     ///< rounds positions to the file's precision
  Bounds within;                              ///< open box that contains all positions of merged vertices
  std::span<const MissedTarget> missed = {};  ///< by vertex of `fine`, ascending

  bool admits(const Eigen::Vector3d& place) const {
    return (place.array() > within.lower.array()).all() && (place.array() < within.upper.array()).all();
  }
};

/// Returns the sets of vertices that edges connect within lattice-aligned blocks of 2, 4, 8 and 16 voxels,
/// each made of those of the next smaller blocks. A set merges if its vertices, edges and triangles form a
/// disc or a tree and their planes pass well within the tolerance of one position.
MergeForest block_forest(const DecimationInput& input, const RunContext& context);

/// Tests of a collapse. `bold` collapses are unverified: only the quadrics are evaluated. `careful` ones are
/// verified: every sample (vertex of the fine mesh) stays near a triangle, and the new vertex and the new
/// edges stay near the fine mesh.
enum class Collapses { bold, careful };

/// Collapses edges of `merged`, the mesh of `forest`, and joins the sets of their ends.
///
/// The mesh is divided among cubic domains. A triangle within one domain belongs to it and stays within it;
/// all others are left unchanged for a round. So domains do not depend on one another's changes, and the
/// result is the same for any number of threads. The next round has larger domains with other borders, until
/// one contains the whole mesh.
/// @param where by vertex of the fine mesh: 1 for vertices of `merged` whose edges are tested; edges at
///   others only once something near them changes. Empty: all
void collapse_edges(MergeForest& forest, const MergedMesh& merged, std::span<const std::uint8_t> where,
                    const DecimationInput& input, Collapses kind, RunContext& context);

/// Moves vertices of `merged`, the mesh of the settled `forest`, to where it is nearest to the fine mesh in
/// the sense of least squares, as sets above those that they move (MergeForest::Node::moves). Each move is
/// proposed as a quarter, a half and the whole of its path, one set above another, so that a failing proof
/// undoes no more than necessary. A vertex stays a little less than its tolerance from the fine mesh.
/// @param sweeps number of times the fine mesh is projected onto the triangles; 0 does nothing
void propose_relaxation(MergeForest& forest, const MergedMesh& merged, const DecimationInput& input,
                        int sweeps, const RunContext& context);

/// Moves vertices of the mesh of the settled `forest` to the nearest vertex of the fine mesh that they
/// represent, if it is within a fiftieth of a voxel: sums in single precision are off by up to a thousandth
/// of a voxel at the corner of a polyhedron, where the fine vertex is exact. If that has missed its target,
/// the merged vertex moves to the target.
/// @param merged that mesh, or one before further collapses
void propose_members(MergeForest& forest, const MergedMesh& merged, const DecimationInput& input,
                     const RunContext& context);

}  // namespace hermesh
