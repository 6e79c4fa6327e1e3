// Collapses of edges, proposed in rounds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"
#include "algorithms/extraction/certified_collapse/merge_proof.h"
#include "algorithms/extraction/certified_collapse/quadric.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"

namespace hermesh {

inline constexpr std::uint32_t kNoTriangle = 0xffffffffu;
inline constexpr std::uint32_t kNoSample = 0xffffffffu;

/// A mesh whose edges collapse. Its points are some of those of the fine mesh, the *samples*, and have their
/// numbers. All lengths in voxels, index space.
struct DecimatedMesh {
  const FineMesh* fine = nullptr;
  // Numbered by sample; `points`, `quadrics` and `least_tolerance` are only set for samples that are points.
  std::span<const float> tolerance;      ///< how far from its place the mesh may be
  std::span<const std::uint8_t> pinned;  ///< 1 for samples that stay as and where they are
  std::vector<Eigen::Vector3d> points;   ///< places now; FilePoints::rounded()
  std::vector<PlaneQuadric> quadrics;    ///< planes that the point stands for, about the point
  std::vector<float> least_tolerance;    ///< least among the samples that the point stands for
  std::vector<std::uint8_t> unmoved;     ///< 1 for samples that are points, and where they were
  double moment = 0;                     ///< what a collapse may cost (collapse_edges()), or 0
  // Numbered by triangle, but for `next_sample`:
  std::vector<Triangle> triangles;           ///< first corner kNoTriangle: no longer there
  std::vector<std::uint32_t> fine_triangle;  ///< the one of the fine mesh that each began as
  std::vector<std::uint32_t> first_sample;   ///< head of the list of samples attached to each, or kNoSample
  std::vector<std::uint32_t> next_sample;    ///< the next sample of the same list, or kNoSample
  /// Whether an edge at a point is worth another look in this round, and in the next. An edge that failed
  /// fails again, unless something near it has changed or it was a cube's border that forbade it.
  std::vector<std::uint8_t> dirty, dirty_next;

  bool alive(std::size_t triangle) const { return triangles[triangle][0] != kNoTriangle; }
};

/// How collapses are tested. *Bold* ones look at the quadrics alone. *Careful* ones keep every sample near a
/// triangle, and the new point and the new edges near the fine mesh; samples are attached to triangles for
/// them.
enum class Collapses { bold, careful };

/// Collapses edges of the merged mesh of a forest, and joins the sets of their ends there.
///
/// Work is divided among cubes. A triangle within one cube belongs to it, and stays within it; all others are
/// left alone for a round. So cubes do not see one another's changes, and the result is the same for every
/// number of threads. The next round has larger cubes with other borders, until one holds the whole mesh.
/// @param forest whose sets are joined
/// @param merged the mesh of `forest`, as MergeProof returns it
/// @param where by point of `fine`: points of the merged mesh whose edges are looked at, 0 for those that are
/// not unless
///   something near them changes; empty for all
/// @param fine the fine mesh
/// @param tolerance by point of `fine`, voxels
/// @param pinned by point of `fine`: points that stay as and where they are
/// @param kind how collapses are tested
/// @param moment 0: collapses cost the squared distances to the planes of all that the new point stands for,
/// and go on as
///   far as the tests allow. Else the greatest cost of a collapse, voxels⁴, which is the sum of squared
///   distances of the new point to the planes of the triangles around the edge as they are now, weighted by
///   their areas: without a memory, and the cheapest first, as Lindstrom & Turk's (1998)
/// @param file rounds places to the file's precision
/// @param context told of progress, and asked whether to stop
/// @throws Cancelled
void collapse_edges(MergeForest& forest, const MergedMesh& merged, std::span<const std::uint8_t> where,
                    const FineMesh& fine, std::span<const float> tolerance,
                    std::span<const std::uint8_t> pinned, Collapses kind, double moment,
                    const FilePoints& file, RunContext& context);

}  // namespace hermesh
