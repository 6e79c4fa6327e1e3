// Which solid the polygons of a mesh bound: whether a point lies inside.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "algorithms/core/run_context.h"
#include "validation/free_cells.h"
#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"

namespace hermesh::validation {

/// Returns vectors of that length, spread over the sphere and turned out of the axes and planes that models
/// like: the first few of them are spread, too.
std::vector<Eigen::Vector3d> ray_directions(double length);

/// Returns how a segment crosses a triangle: 1 if it leaves through the front, −1 if it enters through it, 0
/// if it misses, and nothing if it meets an edge or ends in the triangle's plane. Exact.
std::optional<int> crossing_of(const Corners& triangle, const Eigen::Vector3d& from,
                               const Eigen::Vector3d& to);

enum class Side { outside, inside, unknown };

/// The polygons of a mesh as triangles over points of which no two are equal, without triangles of no area.
MeshFile welded_triangles(const MeshFile& mesh, QuadRule rule = QuadRule::as_given);

/// The solid of any polygons. Points are told apart by counting what rays cross, signed by the side that they
/// come from, with exact predicates; a ray that meets an edge is replaced by another one. The count of a
/// closed surface is its winding number, whatever the ray; of an open one the mean over all rays is
/// (Jacobson, Kavan and Sorkine-Hornung, Robust Inside-Outside Segmentation using Generalized Winding
/// Numbers, 2013).
///
/// A mesh that some program made is read `by_orientation`: inside is what it winds around. A soup's polygons
/// may face anywhere, overlap and enclose voids, and people disagree on what it means: winding numbers keep a
/// void that a flood from infinity fills. Read `by_any_rule`, a point is inside or outside only where these
/// rules agree, with equal points of the polygons as one:
///  - closed and balanced, every edge as often one way as the other: inside if the winding number is over 0
///    or odd; outside if it is 0 or even below, and the point is reachable;
///  - closed, an even number of sides at every edge: inside if a ray crosses an odd number of polygons;
///    outside if an even one, and the point is reachable;
///  - open, but neighbours face the same way over all edges with two sides but 1 %: inside if of 24 rays 3/4
///    count over 0, or if they count 3/8 on average and a straight way leads to a cell that the flood does
///    not come to (so the point is beside an inner wall without a second side); outside if 3/4 do not count
///    over 0, 3/4 cross an even number, and the point is reachable;
///  - open, and neighbours do not: inside if 3/4 cross an odd number; outside if 3/4 an even one, and the
///    point is reachable.
/// Any other point is unknown. An oriented mesh whose volume is negative, from wherever in its box it is
/// measured, is turned as a whole first. A point is *reachable* if a straight way that crosses nothing leads
/// from it to a cell that the flood from infinity reaches (free_cells.h).
class Solid {
 public:
  enum class Reading { by_orientation, by_any_rule };

  /// The solid of a soup of welded_triangles(), with the tree of that soup; keeps references to both.
  /// @throws Cancelled.
  Solid(const TriangleSoup& welded, const TriangleTree& tree, Reading reading, const RunContext& context);

  /// The side of a point, by the reading.
  Side side(const Eigen::Vector3d& point) const;

  bool closed() const { return closed_; }  ///< whether every edge has an even number of sides
  bool oriented() const {
    return oriented_;
  }  ///< whether neighbours face the same way over all edges but 1 %

 private:
  struct Crossings {
    int sum = 0;  ///< crossings in which the ray leaves through a front less those in which it enters by one
    int count = 0;  ///< number of all crossings
    bool sure = true;
  };

  void look_at_edges();
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
