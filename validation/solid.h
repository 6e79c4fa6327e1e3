// Which solid the polygons of a mesh bound: tests if a point is inside.
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
/// that faces outwards, so that they are not cavities. Fills `inside_out_components` and `inside_out_places`;
/// leaves them unchanged if the report's mesh is not closed or not oriented. @throws Cancelled.
void count_inside_out(const TriangleSoup& soup, const TriangleTree& tree, MeshReport& report,
                      const RunContext& context);

/// A coarse grid of the space about a mesh: cubes of 1/128 of the longest side of the mesh's box, flooded
/// from outside through the cubes that no triangle meets (tested by the boxes of the triangle's parts).
class FreeCells {
 public:
  /// A grid without cells, for which every point is neither free nor enclosed.
  FreeCells() = default;
  explicit FreeCells(const TriangleTree& tree);

  /// Returns the side of a cube, world units.
  double cell() const { return cell_; }
  /// Returns true if the flood reached the point's cube. Points beyond the box are free.
  bool free(const Eigen::Vector3d& point) const { return state_at(point) == kFree; }
  /// Returns true if neither the flood nor a triangle reaches the point's cube, so that triangles separate
  /// the point from infinity except for gaps narrower than a cube or two.
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

/// The solid of any polygons. Points are classified by counting the polygons that rays cross, signed by the
/// side that they come from, with exact predicates; a ray that meets an edge is replaced by another one. The
/// count of a closed surface is its winding number for any ray; that of an open one is estimated by the mean
/// over all rays (Jacobson, Kavan and Sorkine-Hornung, Robust Inside-Outside Segmentation using Generalized
/// Winding Numbers, 2013).
///
/// The output of a mesher is read `by_orientation`: inside is where its winding number is positive. The
/// polygons of a soup may have any orientation, overlap and enclose voids, and its meaning is ambiguous:
/// winding numbers keep a void that a flood from infinity fills. Read `by_any_rule`, a point is inside or
/// outside only where these rules agree, with equal points of the polygons merged:
///  - closed and balanced, every edge as often in one direction as in the other: inside if the winding number
///  is
///    positive or odd; outside if it is 0 or even and negative, and the point is reachable;
///  - closed, an even number of sides at every edge: inside if a ray crosses an odd number of polygons;
///  outside
///    if an even one, and the point is reachable;
///  - open, but neighbours are consistently oriented over all edges with two sides except 1 %: inside if of
///  24
///    rays 3/4 count over 0, or if they count 3/8 on average and a straight path leads to a cell that the
///    flood does not reach (so the point is next to an inner wall without a second side); outside if 3/4 do
///    not count over 0, 3/4 cross an even number, and the point is reachable;
///  - open otherwise: inside if 3/4 cross an odd number; outside if 3/4 an even one, and the point is
///  reachable.
/// Any other point is unknown. An oriented mesh whose volume is negative about every point of its box is
/// turned as a whole first. A point is *reachable* if a straight path that crosses nothing leads from it to a
/// cell that the flood from infinity reaches (FreeCells).
class Solid {
 public:
  enum class Reading { by_orientation, by_any_rule };

  /// The solid of a soup of welded_triangles(), with the tree of that soup; keeps references to both.
  /// @throws Cancelled.
  Solid(const TriangleSoup& welded, const TriangleTree& tree, Reading reading, const RunContext& context);

  /// Returns the side of a point, by the reading.
  Side side(const Eigen::Vector3d& point) const;

  /// Returns true if every edge has an even number of sides.
  bool closed() const { return closed_; }
  /// Returns true if neighbours are consistently oriented over all edges but 1 %.
  bool oriented() const { return oriented_; }

 private:
  struct Crossings {
    int sum = 0;    ///< crossings in which the ray leaves through a front less those in which it enters
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
