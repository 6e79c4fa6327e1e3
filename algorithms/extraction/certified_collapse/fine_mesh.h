// A mesh with its triangles by vertex, for walks over it.
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

/// A mesh with its triangles by vertex. Triangles whose first corner is kNone are absent. It is closed and
/// oriented, or a complex of patches that meet in their boundaries; only there may an adjacent vertex not be
/// the corner that follows a vertex in one of its triangles.
class FineMesh {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  /// @throws Error if three times the triangles exceed 32 bits; Cancelled
  FineMesh(std::vector<Eigen::Vector3d> points, std::vector<Triangle> triangles,
           const RunContext& context = RunContext());

  const std::vector<Eigen::Vector3d>& points() const { return points_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  /// Returns the unit normal of a triangle; zero if it is degenerate.
  const Eigen::Vector3f& normal(std::uint32_t triangle) const { return normals_[triangle]; }
  /// Returns the triangles with this corner, ascending.
  std::span<const std::uint32_t> around(std::uint32_t point) const {
    return std::span(around_).subspan(first_[point], first_[point + 1] - first_[point]);
  }
  /// Returns the corner that follows `point` in a triangle around it.
  std::uint32_t next(std::uint32_t triangle, std::uint32_t point) const {
    const Triangle& t = triangles_[triangle];
    return t[0] == point ? t[1] : t[1] == point ? t[2] : t[0];
  }
  /// Returns the side of the triangle beyond the side from corner i on, as three times that triangle plus the
  /// corner that it starts at; kNone if no triangle is oriented alike there, as at the boundaries of patches.
  std::uint32_t side_across(std::uint32_t triangle, int i) const { return across_[triangle][i]; }
  /// Returns the triangle beyond the side that starts at corner i, or kNone.
  std::uint32_t across(std::uint32_t triangle, int i) const {
    const std::uint32_t side = across_[triangle][i];
    return side == kNone ? kNone : side / 3;
  }
  Corners corners(std::uint32_t triangle) const {
    const Triangle& t = triangles_[triangle];
    return {points_[t[0]], points_[t[1]], points_[t[2]]};
  }
  /// Walks from triangle to triangle, across the side that p lies farthest beyond, and returns the triangle
  /// that p lies over. The walk also stops at a ridge that p lies outside of, and after some steps; so the
  /// result is a good start for a search, but proves nothing.
  std::uint32_t walk(std::uint32_t triangle, const Eigen::Vector3d& p) const;
  /// Moves to a touching triangle as long as one is nearer to p, and returns the last: the nearest if the
  /// mesh is smooth. `squared` becomes its squared distance.
  std::uint32_t nearest_around(std::uint32_t triangle, const Eigen::Vector3d& p, double& squared) const;

 private:
  std::vector<Eigen::Vector3d> points_;
  std::vector<Triangle> triangles_;
  std::vector<Eigen::Vector3f> normals_;
  std::vector<std::uint32_t> first_, around_;
  std::vector<std::array<std::uint32_t, 3>> across_;  ///< side_across()
};

}  // namespace hermesh
