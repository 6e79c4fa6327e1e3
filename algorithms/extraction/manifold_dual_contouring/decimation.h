// Collapses of edges, each tested before it is done: the mesh stays closed, manifold, of the same topology, free of
// self-intersection and within a distance of the one that it began as.
//
// *Propose*: first the points of a block of 2 x 2 x 2 and then of 4 x 4 x 4 cells become one, then an edge's two ends do,
// cheapest first: the minimiser of the squared distances to the planes of all triangles that they stand for (quadrics,
// Garland & Heckbert 1997).
// *Certify*, on the points as rounded for the file:
//   topology    the faces around a block's points are a disc; an edge's ends have exactly two neighbours in common (link
//               condition, Dey et al. 1999);
//   distance    every point of the first mesh keeps a triangle that it is attached to, no farther away than the tolerance;
//               of every edge of the first mesh each part is within the tolerance of one triangle; and the new point is
//               within the tolerance of a triangle of the first mesh. Over one triangle distance is convex, so nothing
//               between can be farther where both meshes are heights over a plane: the difference of two piecewise linear
//               functions is largest at a point of either or where two edges cross. (distance_certificate.h proves it
//               without this condition.)
//   embedding   the new triangles meet no other triangle and not one another, except in the corners that they share.
// What fails is not done.
// *Refine*: the distance is proved of what a round has changed, and a cube in which that fails is done again with less room.
//
// Work is divided among cubes. A triangle within one cube belongs to it, and stays within it; all others are left alone
// for a round. So cubes do not see one another's changes, and the result is the same for every number of threads. The
// next round has larger cubes with other borders.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/manifold_dual_contouring/file_points.h"
#include "algorithms/extraction/manifold_dual_contouring/fine_mesh.h"
#include "algorithms/extraction/manifold_dual_contouring/quadric.h"

namespace hermesh {

inline constexpr std::uint32_t kNoTriangle = 0xffffffffu;
inline constexpr std::uint32_t kNoSample = 0xffffffffu;

/// A mesh on its way from fine to coarse. The points of the fine mesh are *samples*; one that is no longer a point of the
/// mesh is attached to a triangle. All lengths in voxels, index space.
struct DecimatedMesh {
  const FineMesh* fine = nullptr;           ///< its points are the samples
  std::vector<Eigen::Vector3d> points;      ///< where the fine mesh's points have gone; FilePoints::rounded()
  std::vector<Triangle> triangles;          ///< first corner kNoTriangle: no longer there
  std::vector<PlaneQuadric> quadrics;       ///< by point, about it
  std::vector<std::uint32_t> below;         ///< by point: a fine triangle near it
  std::vector<std::uint32_t> fine_triangle;  ///< by triangle: the one of the fine mesh that it began as
  std::vector<std::uint8_t> pinned;         ///< by point: stays as and where it is
  std::vector<std::uint8_t> unmoved;        ///< by point: it still is its own sample
  std::vector<std::uint32_t> first_sample;  ///< by triangle: head of the list of samples attached to it
  std::vector<std::uint32_t> next_sample;   ///< by sample
  std::vector<std::uint32_t> attached_to;   ///< by sample: a triangle, or kNoTriangle if it still is a point
  std::vector<std::uint32_t> proposed;      ///< by sample: of the collapse under way
  std::vector<float> tolerance;             ///< by sample
  /// By point: whether an edge at it is worth another look in this round, and in the next. An edge that failed fails
  /// again, unless something near it has changed or it was a cube's border that forbade it.
  std::vector<std::uint8_t> stirred, stirred_next;

  bool alive(std::size_t triangle) const { return triangles[triangle][0] != kNoTriangle; }
};

/// `fine` must outlive the result. `tolerance` by sample. `pinned` by sample, or empty for none: points that neither move
/// nor go. Where more than two triangles meet in an edge its ends must be pinned; so a complex of patches keeps their rims.
DecimatedMesh begin_decimation(const FineMesh& fine, std::vector<float> tolerance, std::vector<std::uint8_t> pinned,
                               RunContext& context);

/// Rounds of collapses until the cubes hold the whole mesh. `tolerance` by sample is what has to be proved of each round.
/// @throws Cancelled
void decimate(DecimatedMesh& mesh, std::span<const float> tolerance, const FilePoints& file, RunContext& context);

}  // namespace hermesh
