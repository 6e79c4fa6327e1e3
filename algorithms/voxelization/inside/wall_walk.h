// Paths along the walls of a crevice of any width and shape.
#pragma once

#include <optional>
#include <unordered_set>

#include "algorithms/voxelization/inside/cell_obstacles.h"

namespace hermesh {

/// A walk over points 1e-5 voxels above the sides of triangles, each reached from the walk's start without
/// meeting a triangle: over the edges that triangles share, and straight across to the opposite wall. No path
/// leads around the boundary of a hole. Needs neither consistent normals nor a closed mesh.
class WallWalk {
 public:
  /// Keeps references; the obstacles count the walk's queries as work.
  WallWalk(const IndexSoup& soup, CellObstacles& obstacles) : soup_(soup), obstacles_(obstacles) {}

  /// Adds a start: the first point where the segment from `from` by `step` intersects a triangle, if any.
  void begin(const Eigen::Vector3d& from, const Eigen::Vector3d& step);
  /// Returns the next point, each once, in the order in which they are reached; nothing after the last one.
  std::optional<Eigen::Vector3d> next();

 private:
  /// A point above one side of a triangle.
  struct Place {
    std::uint32_t triangle = 0;
    Eigen::Vector3d up;  ///< the triangle's unit normal on that side
    Eigen::Vector3d at;
  };

  Eigen::Vector3d normal_of(std::uint32_t triangle) const;
  void add(const Place& place);
  std::optional<Place> across(const Place& from, std::size_t edge);

  const IndexSoup& soup_;
  CellObstacles& obstacles_;
  std::vector<Place> places_;
  std::size_t given_ = 0;
  /// Sides that have a point: twice the triangle, plus 1 for its front.
  std::unordered_set<std::uint64_t> known_;
};

}  // namespace hermesh
