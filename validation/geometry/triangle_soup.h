// All polygons of a mesh file as triangles over the file's points, in the numbering that all of validation
// uses.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "algorithms/io/mesh_file.h"
#include "validation/geometry/quad_cut.h"

namespace hermesh::validation {

/// A closed axis-aligned box.
struct Box {
  Eigen::Vector3d lower = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d upper = Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity());

  void add(const Eigen::Vector3d& point) {
    lower = lower.cwiseMin(point);
    upper = upper.cwiseMax(point);
  }
  void add(const Box& other) {
    lower = lower.cwiseMin(other.lower);
    upper = upper.cwiseMax(other.upper);
  }
  bool overlaps(const Box& other) const {
    return lower.x() <= other.upper.x() && other.lower.x() <= upper.x() && lower.y() <= other.upper.y() &&
           other.lower.y() <= upper.y() && lower.z() <= other.upper.z() && other.lower.z() <= upper.z();
  }
  /// Returns the squared distance to a point, zero inside.
  double squared_distance(const Eigen::Vector3d& point) const {
    return (lower - point).cwiseMax(point - upper).cwiseMax(0.0).squaredNorm();
  }
  /// Returns the squared distance to another box, zero if the two overlap.
  double squared_distance(const Box& other) const {
    return (lower - other.upper).cwiseMax(other.lower - upper).cwiseMax(0.0).squaredNorm();
  }
  bool empty() const { return !(lower.x() <= upper.x()); }
  /// Returns the centre of the box; the origin if the box is empty.
  Eigen::Vector3d centre() const {
    return empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(0.5 * lower + 0.5 * upper);
  }
  double diagonal() const { return empty() ? 0.0 : (upper - lower).norm(); }
};

using Corners = std::array<Eigen::Vector3d, 3>;

inline Box box_of(const Corners& c) {
  return {c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2])};
}
/// Returns the normal of a triangle with twice its area as length.
inline Eigen::Vector3d area_vector(const Corners& c) { return (c[1] - c[0]).cross(c[2] - c[0]); }

/// A file's polygons as triangles: those of the file first, then the two of each quad, cut by the rule. The
/// soup refers to the file's points, so the file has to outlive it.
struct TriangleSoup {
  const std::vector<Eigen::Vector3d>& points;
  std::vector<Triangle> triangles;
  std::size_t undivided = 0;  ///< number of triangles before the halves of quads

  explicit TriangleSoup(const MeshFile& mesh, QuadRule rule = QuadRule::as_given)
      : points(mesh.points), undivided(mesh.triangles.size()) {
    triangles.reserve(mesh.triangle_count());
    triangles = mesh.triangles;
    for (const Quad& quad : mesh.quads) {
      const Quad q = cut_from_first(points, quad, rule);
      triangles.push_back({q[0], q[1], q[2]});
      triangles.push_back({q[0], q[2], q[3]});
    }
  }
  /// Returns the number of the polygon that a triangle belongs to: triangles first, then quads.
  std::int64_t polygon(std::size_t t) const {
    return std::int64_t(t < undivided ? t : undivided + (t - undivided) / 2);
  }
  Corners corners(std::size_t t) const {
    const Triangle& c = triangles[t];
    return {points[c[0]], points[c[1]], points[c[2]]};
  }
  double area() const {
    double sum = 0.0;
    for (std::size_t t = 0; t < triangles.size(); ++t) sum += 0.5 * area_vector(corners(t)).norm();
    return sum;
  }
  /// Returns the box of the used points.
  Box box() const {
    Box result;
    for (const Triangle& t : triangles)
      for (std::uint32_t p : t) result.add(points[p]);
    return result;
  }
};

/// Returns the box of the points that polygons use.
inline Box box_of(const MeshFile& mesh) {
  Box box;
  for (const Triangle& t : mesh.triangles)
    for (std::uint32_t p : t) box.add(mesh.points[p]);
  for (const Quad& q : mesh.quads)
    for (std::uint32_t p : q) box.add(mesh.points[p]);
  return box;
}

/// One side of a triangle, from its corner `corner` to the next.
struct TriangleSide {
  std::uint32_t low, high, triangle;  ///< the two points in ascending order
  std::int8_t corner, direction;      ///< direction: 1 from low to high, −1 from high to low
  auto operator<=>(const TriangleSide&) const = default;
};
/// Returns the sides of all triangles, sorted: those of one edge follow one another.
std::vector<TriangleSide> sorted_sides(const std::vector<Triangle>& triangles);
/// Calls f(sides) with the span of sides of each edge, in ascending order.
template <class F>
void for_each_edge(const std::vector<TriangleSide>& sides, const F& f) {
  for (std::size_t i = 0, end; i < sides.size(); i = end) {
    for (end = i; end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high;)
      ++end;
    f(std::span(sides).subspan(i, end - i));
  }
}

/// Points without duplicates, in lexicographic order, and the number of each given point among them.
struct WeldedPoints {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::uint32_t> number;
};
/// Merges points whose three coordinates are equal.
WeldedPoints weld(const std::vector<Eigen::Vector3d>& points);
/// Returns the triangles over welded points, without those of no area.
MeshFile welded_triangles(const TriangleSoup& soup);

}  // namespace hermesh::validation
