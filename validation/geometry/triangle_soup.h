// All polygons of a mesh file as triangles over the file's points, numbered the way that every judge numbers
// them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
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
  /// Squared distance to a point, zero inside.
  double squared_distance(const Eigen::Vector3d& point) const {
    return (lower - point).cwiseMax(point - upper).cwiseMax(0.0).squaredNorm();
  }
  /// Squared distance to another box, zero if the two overlap.
  double squared_distance(const Box& other) const {
    return (lower - other.upper).cwiseMax(other.lower - upper).cwiseMax(0.0).squaredNorm();
  }
  bool empty() const { return !(lower.x() <= upper.x()); }
  /// The centre of the box; the origin if the box is empty.
  Eigen::Vector3d centre() const {
    return empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : Eigen::Vector3d(0.5 * lower + 0.5 * upper);
  }
  double diagonal() const { return empty() ? 0.0 : (upper - lower).norm(); }
};

using Corners = std::array<Eigen::Vector3d, 3>;

/// A file's polygons as triangles: those of the file first, then the two of each quad, cut by the rule. The
/// soup refers to the file's points, so the file has to outlive it.
struct TriangleSoup {
  const std::vector<Eigen::Vector3d>& points;
  std::vector<Triangle> triangles;
  std::size_t undivided = 0;  ///< how many triangles come before the halves of quads

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
  /// Number of the polygon that a triangle belongs to; polygons are numbered triangles first, then quads.
  std::int64_t polygon(std::size_t t) const {
    return std::int64_t(t < undivided ? t : undivided + (t - undivided) / 2);
  }
  Corners corners(std::size_t t) const {
    const Triangle& c = triangles[t];
    return {points[c[0]], points[c[1]], points[c[2]]};
  }
};

inline Box box_of(const Corners& c) {
  return {c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2])};
}

/// The box of the points that polygons use.
inline Box box_of(const MeshFile& mesh) {
  Box box;
  for (const Triangle& t : mesh.triangles)
    for (std::uint32_t p : t) box.add(mesh.points[p]);
  for (const Quad& q : mesh.quads)
    for (std::uint32_t p : q) box.add(mesh.points[p]);
  return box;
}

}  // namespace hermesh::validation
