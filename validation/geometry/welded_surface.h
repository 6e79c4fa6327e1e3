// Triangles with shared points, their edges, and walks from triangle to triangle.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "validation/geometry/triangle_soup.h"

namespace hermesh::validation {

/// A surface of triangles whose points are shared where all three coordinates are equal, without the
/// triangles that then have no area.
class WeldedSurface {
 public:
  struct Edge {
    std::array<std::uint32_t, 2> points;
    std::array<std::uint32_t, 2> triangles;
    /// The angle between the normals of the two triangles, in radians, positive where the surface is convex;
    /// 0 ≤ |turning| ≤ π.
    double turning;
  };

  explicit WeldedSurface(const TriangleSoup& soup);

  /// The edges in which exactly two triangles meet, by their points in increasing order.
  const std::vector<Edge>& edges() const { return edges_; }
  const Eigen::Vector3d& point(std::uint32_t p) const { return points_[p]; }
  Eigen::Vector3d direction(const Edge& e) const {
    return (points_[e.points[1]] - points_[e.points[0]]).normalized();
  }

  struct Arrival {
    std::size_t edge;
    double distance;
  };
  /// Walks from a point near the middle of an edge into its first or second triangle (`side` 0 or 1), at
  /// right angles to the edge and straight on over the unfolded surface, across edges that turn by less than
  /// `least_turning`. Returns the first edge that turns by more; nothing at a border, beyond `farthest`, or
  /// once the walk has crossed as many triangles as there are.
  std::optional<Arrival> walk(std::size_t edge, int side, double least_turning, double farthest) const;

 private:
  static constexpr std::uint32_t kNoEdge = ~std::uint32_t(0);

  void weld(const TriangleSoup& soup);
  void connect();
  double turning(const Edge& e) const;
  Eigen::Vector3d normal(std::uint32_t triangle) const;

  std::vector<Eigen::Vector3d> points_;
  std::vector<Triangle> triangles_;
  std::vector<Edge> edges_;
  std::vector<std::array<std::uint32_t, 3>>
      edge_of_;  ///< edge of each triangle's side k to k + 1; kNoEdge at a border
};

}  // namespace hermesh::validation
