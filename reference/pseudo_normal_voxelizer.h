// The voxelizer that the thesis started from (Aldén 2011, chapter 5): signs from angle-weighted
// pseudo-normals (Bærentzen and Aanæs, Signed Distance Computation Using the Angle Weighted Pseudonormal,
// TVCG 2005), instead of a flood fill.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/core/variant.h"

namespace hermesh {

/// The part of a triangle that a point is nearest to: its face, the edge from corner i to the next, or corner
/// i.
enum class TrianglePart { kFace, kEdge0, kEdge1, kEdge2, kCorner0, kCorner1, kCorner2 };
struct NearestPart {
  Eigen::Vector3d point;
  TrianglePart part;
};
/// Returns the point of a triangle nearest to p, and the part that it lies on. A triangle without area has
/// only edges and corners.
NearestPart nearest_part(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& corners);

/// The normals of all parts of a mesh, none of them of unit length. Points with the same coordinates are one.
///   - that of a face is its own;
///   - that of an edge the sum of the unit normals of all faces at it, two or not;
///   - that of a corner the sum of the unit normals of all faces there, each times its angle at the corner.
/// Where a mesh is closed, oriented and free of self-intersection the vector from a surface's nearest point
/// to any point outside makes an acute angle with the normal of the part that the nearest point lies on, and
/// an obtuse one inside; otherwise the normal is the same sum, but without this guarantee.
class PseudoNormals {
 public:
  PseudoNormals(const std::vector<Eigen::Vector3f>& points, const std::vector<Triangle>& triangles);
  Eigen::Vector3d of(std::uint32_t triangle, TrianglePart part) const;

 private:
  std::vector<Triangle> welded_;  ///< corners as indices of positions
  std::vector<Eigen::Vector3d> faces_, corners_;
  struct Edge {
    std::uint32_t low, high;
    Eigen::Vector3d normal;
  };
  std::vector<Edge> edges_;  ///< in the order of their ends
};

/// Returns the grid "sdf" of class level set: in each voxel the distance to the nearest triangle, exact
/// except for rounding, with the sign that the pseudo-normal of its nearest part gives; negative inside. The
/// voxels nearer than the band of their side are active. The signs are correct for closed, oriented polygons
/// without self-intersection and unspecified for others. The bytes do not depend on the number of threads.
/// @throws Error if check_voxelization_fits() throws, and for a mesh whose triangles all have no area;
/// Cancelled
LevelSet pseudo_normal_voxelizer(const VoxelizationInput& input);

}  // namespace hermesh
