// Distances and angles from one surface to another, measured at samples.
#pragma once

#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// `count` stratified points of a surface: the surface, triangle after triangle, is cut into `count` pieces
/// of equal area, and the triangle with the middle of a piece gets a point. Its position within the triangle
/// comes from a planar low-discrepancy sequence (Roberts, The Unreasonable Effectiveness of Quasirandom
/// Sequences, 2018), which also covers a large triangle evenly. All points represent equal areas, so plain
/// means over them are means over the surface.
class SurfaceSamples {
 public:
  SurfaceSamples(const TriangleSoup& soup, std::int64_t count);

  /// Returns the number of points; 0 if the surface has no area.
  std::int64_t size() const { return count_; }
  Eigen::Vector3d operator[](std::int64_t i) const;
  std::size_t triangle(std::int64_t i) const;  ///< returns the triangle that sample i lies on

 private:
  const TriangleSoup& soup_;
  std::int64_t count_;
  std::vector<double> area_up_to_;  ///< area of the triangles up to and including this one
};

/// Returns one-sided distances from the surface `from` to the surface `to`: the maximum over all used
/// vertices of `from` and over `samples` points spread over its area, mean and rms over the latter only. A
/// mesh of no area has its vertices as samples. The maximum is a lower bound of the true one; hausdorff.h
/// brackets it.
/// @throws Cancelled.
Distances sampled_distances(const TriangleSoup& from, const TriangleTree& to, std::int64_t samples,
                            RunContext& context);

/// A point that represents a part of a surface or of its edges, with the size of that part.
struct WeightedPoint {
  Eigen::Vector3d point;
  double weight;
};
/// Returns distances from points to the surface `to`, with weighted mean and rms; zeros for no points.
/// @throws Cancelled.
Distances point_distances(const std::vector<WeightedPoint>& points, const TriangleTree& to,
                          RunContext& context);

/// Returns the angles between the normals of `from` at `samples` points spread over its area and those of
/// `to` at the nearest points, with normals by the winding of triangles. Skips triangles of no area. Next to
/// a crease of `to` the nearest point may lie on the other side of it; such samples count. @throws Cancelled.
NormalAngles sampled_normal_angles(const TriangleSoup& from, const TriangleTree& to, std::int64_t samples,
                                   RunContext& context);

}  // namespace hermesh::validation
