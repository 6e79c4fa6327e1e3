// The mesh that a decimation started from, with its triangles by point.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/contact/triangle_contact.h"

namespace hermesh {

/// A mesh with its triangles by point. Triangles whose first corner is kNone are not there. It is closed and
/// oriented, or a complex of patches that meet in rims; only at rims may an adjacent point not be the corner
/// that follows a point in one of its triangles.
class FineMesh {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// Finds the normals of the triangles, those around each point and those beyond each side.
  /// @throws Error if three times the triangles are more than 32 bits can number; Cancelled.
  FineMesh(std::vector<Eigen::Vector3d> points, std::vector<Triangle> triangles,
           const RunContext& context = RunContext());

  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// The unit normal of a triangle; zero if it is degenerate.
  const Eigen::Vector3f& normal(std::uint32_t triangle) const { return normals_[triangle]; }
  /// Numbers of the triangles with this corner, ascending.
  std::span<const std::uint32_t> around(std::uint32_t point) const {
    return std::span(around_).subspan(first_[point], first_[point + 1] - first_[point]);
  }
  /// The corner that follows `point` in a triangle around it.
  std::uint32_t next(std::uint32_t triangle, std::uint32_t point) const {
    const Triangle& t = triangles_[triangle];
    return t[0] == point ? t[1] : t[1] == point ? t[2] : t[0];
  }

  /// The side of another triangle that the side from corner i on has in common, as three times that triangle
  /// and the corner that it starts at; kNone if no triangle faces the same way there, as may be at the rims
  /// of a complex of patches.
  std::uint32_t side_across(std::uint32_t triangle, int i) const { return across_[triangle][i]; }
  /// The triangle beyond the side that starts at corner i, or kNone.
  std::uint32_t across(std::uint32_t triangle, int i) const {
    const std::uint32_t side = across_[triangle][i];
    return side == kNone ? kNone : side / 3;
  }
  Corners corners(std::uint32_t triangle) const {
    const Triangle& t = triangles_[triangle];
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }
  /// Walks from triangle to triangle, across the side that the point lies farthest beyond, until it lies over
  /// one, and returns that one. The walk stops at a ridge that the point lies outside of, and after some
  /// steps; so what it returns is a good start, and proves nothing.
  std::uint32_t walk(std::uint32_t triangle, const Eigen::Vector3d& p) const;
  /// Goes from triangle to triangle that touches it, as long as there is one nearer to p, and returns the
  /// last: the nearest if the mesh is smooth. `squared` becomes its squared distance, voxels².
  std::uint32_t nearest_around(std::uint32_t triangle, const Eigen::Vector3d& p, double& squared) const;

 private:
  /// A triangle around a point: its side from there on, and its other corners.
  struct Fan {
    std::uint32_t side, next, before;
  };
  void find_across(std::uint32_t point, std::vector<Fan>& fan);

  std::vector<Eigen::Vector3d> points_;
  std::vector<Triangle> triangles_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<std::uint32_t> first_, around_;
  std::vector<std::array<std::uint32_t, 3>> across_;  ///< side_across(), for walks ask for it at every step
};

}  // namespace hermesh
