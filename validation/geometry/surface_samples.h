// Points spread evenly over the area of a mesh.
#pragma once

#include <cstdint>
#include <vector>

#include "validation/geometry/triangle_soup.h"

namespace hermesh::validation {

/// `count` stratified points of a surface: the surface, triangle after triangle, is cut into `count` pieces
/// of equal area, and the middle of each piece says which triangle gets a point. The place in the triangle is
/// read off a plane sequence of low discrepancy (Roberts, The Unreasonable Effectiveness of Quasirandom
/// Sequences, 2018), so that a large triangle is covered evenly, too. Every point stands for the same area:
/// plain means over them are means over the surface.
class SurfaceSamples {
 public:
  SurfaceSamples(const TriangleSoup& soup, std::int64_t count);

  /// The number of points; 0 if the surface has no area.
  std::int64_t size() const { return count_; }
  Eigen::Vector3d operator[](std::int64_t i) const;
  std::size_t triangle(std::int64_t i) const;  ///< number of the triangle that sample i lies on

 private:
  const TriangleSoup& soup_;
  std::int64_t count_;
  std::vector<double> area_up_to_;  ///< area of the triangles up to and with this one
};

}  // namespace hermesh::validation
