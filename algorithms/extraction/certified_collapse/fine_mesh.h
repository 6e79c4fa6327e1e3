// The mesh that a decimation started from, with its triangles by point.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/extraction/contact/triangle_contact.h"

namespace hermesh {

/// Triangles whose first corner is kNone are not there. Closed and oriented, or a complex of patches that meet in rims; only
/// at these may a neighbour not be the corner that follows a point in one of its triangles.
class FineMesh {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  FineMesh(std::vector<Eigen::Vector3d> points, std::vector<Triangle> triangles);

  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Unit length; zero of a degenerate triangle.
  const Eigen::Vector3f& normal(std::uint32_t triangle) const { return normals_[triangle]; }
  /// Numbers of the triangles with this corner.
  std::span<const std::uint32_t> around(std::uint32_t point) const {
    return std::span(around_).subspan(first_[point], first_[point + 1] - first_[point]);
  }
  /// The corner that follows `point` in a triangle around it.
  std::uint32_t next(std::uint32_t triangle, std::uint32_t point) const {
    const Triangle& t = triangles_[triangle];
    return t[0] == point ? t[1] : t[1] == point ? t[2] : t[0];
  }

  /// The triangle beyond the side that starts at corner i; kNone if none faces the same way there, as may be at the rims of
  /// a complex of patches.
  std::uint32_t across(std::uint32_t triangle, int i) const {
    const std::uint32_t a = triangles_[triangle][i], b = triangles_[triangle][(i + 1) % 3];
    for (const std::uint32_t t : around(b))
      if (next(t, b) == a) return t;
    return kNone;
  }
  Corners corners(std::uint32_t triangle) const {
    const Triangle& t = triangles_[triangle];
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }
  /// From triangle to triangle, across the side that the point lies farthest beyond, until it lies over one; stops at a
  /// ridge that it lies outside of, and after some steps.
  std::uint32_t walk(std::uint32_t triangle, const Eigen::Vector3d& p) const;
  /// From triangle to triangle that touches it, as long as there is a nearer one: the nearest if the mesh is smooth.
  std::uint32_t nearest_around(std::uint32_t triangle, const Eigen::Vector3d& p, double& squared) const;

 private:
  std::vector<Eigen::Vector3d> points_;
  std::vector<Triangle> triangles_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<std::uint32_t> first_, around_;
};

}  // namespace hermesh
