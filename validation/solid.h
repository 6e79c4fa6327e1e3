// The solid bounded by the polygons of a mesh: tests whether a point is inside.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "algorithms/core/run_context.h"
#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Counts the components of a closed, oriented mesh that have negative volume and are not within a component
/// that faces outwards, i.e. are not cavities. Fills `inside_out_components` and `inside_out_places`; leaves
/// them unchanged if the report's mesh is not closed or not oriented. @throws Cancelled.
void count_inside_out(const TriangleSoup& soup, const TriangleTree& tree, MeshReport& report,
                      const RunContext& context);

/// A coarse grid of the space around a mesh: cubes of 1/128 of the longest side of the mesh's box, flooded
/// from outside through the cubes that no triangle intersects (tested by the boxes of the triangle's parts).
class FreeCells {
 public:
  /// Creates a grid without cells, for which every point is neither free nor enclosed.
  FreeCells() = default;
  explicit FreeCells(const TriangleTree& tree);

  /// Returns the side of a cube, world units.
  double cell() const { return cell_; }
  /// Returns true if the flood reached the point's cube. Points outside the box are free.
  bool free(const Eigen::Vector3d& point) const { return state_at(point) == kFree; }
  /// Returns true if neither the flood nor a triangle reaches the point's cube, so triangles separate the
  /// point from infinity except for gaps narrower than a cube or two.
  bool enclosed(const Eigen::Vector3d& point) const { return state_at(point) == kUnseen; }

 private:
  void block(const Corners& triangle);
  void flood();
  std::size_t index(const Eigen::Vector3i& at) const {
    return (std::size_t(at.x()) * std::size_t(size_.y()) + std::size_t(at.y())) * std::size_t(size_.z()) +
           std::size_t(at.z());
  }
  Eigen::Vector3i cell_of(const Eigen::Vector3d& point) const;

  double cell_ = 0.0;
  Eigen::Vector3d lower_ = Eigen::Vector3d::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  enum : std::uint8_t { kUnseen, kBlocked, kFree };
  std::uint8_t state_at(const Eigen::Vector3d& point) const {
    return state_.empty() ? std::uint8_t(kBlocked) : state_[index(cell_of(point))];
  }
  std::vector<std::uint8_t> state_;
};

enum class Side { outside, inside, unknown };

/// The solid bounded by arbitrary polygons. Points are classified by counting the polygons that rays
/// intersect, signed by the side from which the ray arrives, with exact predicates; a ray that intersects an
/// edge is replaced by another one. For a closed surface the count is the winding number, whichever the ray;
/// for an open one the winding number is estimated by the mean over all rays (Jacobson, Kavan and
/// Sorkine-Hornung, Robust Inside-Outside Segmentation using Generalized Winding Numbers, 2013).
///
/// The output of a mesher is read `by_orientation`: inside is where its winding number is positive. The
/// polygons of a soup may have any orientation, overlap and enclose voids, so its solid is ambiguous: winding
/// numbers preserve a void that a flood from infinity fills. Read `by_any_rule`, a point is inside or outside
/// only where these rules agree, with equal points of the polygons merged:
///  - closed and balanced, i.e. every edge occurs equally often in both directions: inside if the winding
///    number is positive or odd; outside if it is 0 or even and negative, and the point is reachable;
///  - closed, i.e. an even number of sides at every edge: inside if a ray intersects an odd number of
///    polygons; outside if it intersects an even number, and the point is reachable;
///  - open, but neighbours are consistently oriented across all but 1 % of the edges with two sides: inside
///    if the counts of at least 3/4 of 24 rays are positive, or if they average at least 3/8 and a segment
///    leads to a cell that the flood does not reach (so the point is next to an inner wall without a second
///    side); outside if at least 3/4 of the counts are not positive, 3/4 of the rays intersect an even
///    number, and the point is reachable;
///  - open otherwise: inside if 3/4 of the rays intersect an odd number; outside if 3/4 intersect an even
///    number, and the point is reachable.
/// Any other point is unknown. An oriented mesh whose volume is negative about every point of its box is
/// first reversed as a whole. A point is *reachable* if a segment that intersects no polygon leads from it to
/// a cell that the flood from infinity reaches (FreeCells).
class Solid {
 public:
  enum class Reading { by_orientation, by_any_rule };

  /// Builds the solid of a soup of welded_triangles() with the tree of that soup; keeps references to both.
  /// @throws Cancelled.
  Solid(const TriangleSoup& welded, const TriangleTree& tree, Reading reading, const RunContext& context);

  /// Returns the side of a point, by the reading.
  Side side(const Eigen::Vector3d& point) const;

  /// Returns true if every edge has an even number of sides.
  bool closed() const { return closed_; }
  /// Returns true if neighbours are consistently oriented across all but 1 % of the edges.
  bool oriented() const { return oriented_; }

 private:
  struct Crossings {
    int sum = 0;    ///< number of exits through a front side minus number of entries
    int count = 0;  ///< number of all crossings
    bool sure = true;
  };

  void classify_edges();
  void turn_outwards();
  Crossings crossings(const Eigen::Vector3d& point, int direction) const;
  Side side_of_closed(const Eigen::Vector3d& point) const;
  Side side_of_open(const Eigen::Vector3d& point) const;
  Side outside_if_reachable(const Eigen::Vector3d& point) const;
  bool leads_to(const Eigen::Vector3d& point, bool (FreeCells::*kind)(const Eigen::Vector3d&) const) const;

  const TriangleSoup& soup_;
  const TriangleTree& tree_;
  Reading reading_;
  bool closed_ = true, balanced_ = true, oriented_ = true;
  int turn_ = 1;                             ///< −1: the mesh is inside out
  std::vector<Eigen::Vector3d> directions_;  ///< long enough to leave the mesh's box from anywhere in it
  FreeCells free_cells_;
};

}  // namespace hermesh::validation
