// Ways along the walls of a crevice, which may be as narrow as it likes and bend as it likes.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <unordered_set>
#include <vector>

#include "algorithms/voxelization/inside/cell_obstacles.h"

namespace hermesh {

/// The cell that a place is in, by its lowest corner; in voxels.
CellObstacles::Voxel cell_of(const Eigen::Vector3d& place);

/// A walk over places a hair's breadth above the sides of triangles, in voxels, each reached from where the
/// walk began without meeting a triangle: over the edges that triangles have in common, and straight across
/// to the opposite wall. No way leads around the border of a hole. Needs no normals that agree, and no closed
/// mesh.
class WallWalk {
 public:
  /// Keeps references; the obstacles count the walk's questions as work.
  WallWalk(const IndexSoup& soup, CellObstacles& obstacles) : soup_(soup), obstacles_(obstacles) {}

  /// Adds the place where the way from `from` by `way` first meets a triangle, if it does, to those that the
  /// walk begins at.
  void begin(const Eigen::Vector3d& from, const Eigen::Vector3d& way);
  /// Gives the next place, each once, in the order in which they are reached; nothing when all have been
  /// given.
  std::optional<Eigen::Vector3d> next();

 private:
  /// A place above one side of a triangle.
  struct Place {
    std::uint32_t triangle = 0;
    Eigen::Vector3d up;  ///< the triangle's unit normal on that side
    Eigen::Vector3d at;
  };

  Eigen::Vector3d normal_of(std::uint32_t triangle) const;
  void add(const Place& place);
  void go_on_from(const Place& place);
  std::optional<Place> across(const Place& from, std::size_t edge);

  const IndexSoup& soup_;
  CellObstacles& obstacles_;
  std::vector<Place> places_;
  std::size_t given_ = 0;
  std::unordered_set<std::uint64_t>
      known_;  ///< sides that have a place: twice the triangle, plus 1 for its front
};

}  // namespace hermesh
