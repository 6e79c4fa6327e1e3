// A triangle cut along the lines in which others cross it, so that each part has one space above it and one
// below.
#pragma once

#include <functional>
#include <span>
#include <vector>

#include "algorithms/voxelization/distance/index_soup.h"

namespace hermesh {

/// A convex part of a triangle, in voxels, wound as the triangle is.
struct TriangleFace {
  std::vector<Eigen::Vector3d> corners;
  bool whole = true;  ///< no other triangle crosses it

  Eigen::Vector3d middle() const;  ///< the mean of the corners, which is within
  double area() const;             ///< voxels²
  double size() const;             ///< the largest distance between two corners
  /// Returns the distance of a point within from the border.
  double room_at(const Eigen::Vector3d& place) const;
};

/// Cuts a triangle, which must have an area, by others: along the lines in which they cross, along edges
/// within a thousandth of a voxel of it, and along the outlines of triangles that lie that near as a whole;
/// not where they meet in a point or along the triangle's own border. Returns no face if nothing cuts it.
/// Makes at most `most` faces, the largest first (an autopartition: Paterson & Yao 1990); those with
/// remaining cuts are not whole. Only faces for which `matters` returns true are cut. All in voxels.
std::vector<TriangleFace> cut_triangle(const Facet& triangle, std::span<const Facet> others, std::size_t most,
                                       const std::function<bool(const TriangleFace&)>& matters);

}  // namespace hermesh
