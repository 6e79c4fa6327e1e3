// Cuts a triangle along its intersections with others, so that each part separates exactly two regions of
// space.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "algorithms/voxelization/distance/index_soup.h"

namespace hermesh {

/// A convex part of a triangle, in voxels, with the triangle's orientation.
struct TriangleFace {
  std::vector<Eigen::Vector3d> corners;
  bool whole = true;  ///< no other triangle intersects it

  Eigen::Vector3d middle() const;  ///< the mean of the corners, an interior point
  double area() const;             ///< voxels²
  double size() const;             ///< the largest distance between two corners
  /// Returns the distance from an interior point to the boundary.
  double room_at(const Eigen::Vector3d& place) const;
};

/// Cuts a triangle of nonzero area by others: along the segments in which they intersect, along edges that
/// lie within a thousandth of a voxel of it, and along the outlines of triangles that do so entirely; not
/// where they intersect in a point or along the triangle's own boundary. Returns no face if nothing cuts it,
/// and otherwise at most `most` faces, cutting the largest first (an autopartition: Paterson & Yao 1990);
/// faces with remaining cuts are not whole. Only faces for which `matters` returns true are cut. All lengths
/// are in voxels.
std::vector<TriangleFace> cut_triangle(const Facet& triangle, std::span<const Facet> others, std::size_t most,
                                       const std::function<bool(const TriangleFace&)>& matters);

}  // namespace hermesh
