// Collapses of edges, proposed in rounds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"
#include "algorithms/extraction/certified_collapse/merge_proof.h"
#include "algorithms/extraction/certified_collapse/quadric.h"

namespace hermesh {

inline constexpr std::uint32_t kNoTriangle = 0xffffffffu;
inline constexpr std::uint32_t kNoSample = 0xffffffffu;

/// A mesh whose edges collapse. Its points are some of those of the fine mesh, the *samples*, and have their numbers. All
/// lengths in voxels, index space.
struct DecimatedMesh {
  const FineMesh* fine = nullptr;
  std::span<const float> tolerance;          ///< by sample
  std::span<const std::uint8_t> pinned;      ///< by sample: stays as and where it is
  std::vector<Eigen::Vector3d> points;       ///< by sample, of those that are points; FilePoints::rounded()
  std::vector<PlaneQuadric> quadrics;        ///< likewise, about the point
  std::vector<float> least_tolerance;        ///< likewise: of the samples that it stands for
  std::vector<std::uint8_t> unmoved;         ///< by sample: it is a point, and where it was
  std::vector<Triangle> triangles;           ///< first corner kNoTriangle: no longer there
  std::vector<std::uint32_t> fine_triangle;  ///< by triangle: the one of the fine mesh that it began as
  std::vector<std::uint32_t> first_sample;   ///< by triangle: head of the list of samples attached to it
  std::vector<std::uint32_t> next_sample;    ///< by sample
  /// By point: whether an edge at it is worth another look in this round, and in the next. An edge that failed fails
  /// again, unless something near it has changed or it was a cube's border that forbade it.
  std::vector<std::uint8_t> stirred, stirred_next;

  bool alive(std::size_t triangle) const { return triangles[triangle][0] != kNoTriangle; }
};

/// `bold` collapses look at the quadrics alone. The others have every sample near a triangle, the new point and the new
/// edges near the fine mesh; samples are attached for them.
enum class Collapses { bold, careful };

/// Joins sets of the forest, whose merged mesh is given.
///
/// Work is divided among cubes. A triangle within one cube belongs to it, and stays within it; all others are left alone
/// for a round. So cubes do not see one another's changes, and the result is the same for every number of threads. The
/// next round has larger cubes with other borders, until one holds the whole mesh.
/// @throws Cancelled
void collapse_edges(MergeForest& forest, const MergedMesh& merged, const FineMesh& fine, std::span<const float> tolerance,
                    std::span<const std::uint8_t> pinned, Collapses kind, const FilePoints& file, RunContext& context);

}  // namespace hermesh
