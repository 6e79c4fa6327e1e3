// The polygon that a crossing edge has where cells share points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "algorithms/extraction/certified_octree/cell_regions.h"

namespace hermesh {

/// The polygon of an edge that has three or four regions around it. The edge between the regions is the
/// common part of their edges there. Its envelope is made of a tetrahedron for each two regions that follow
/// one another, of the edge and their points, as on an octree (Ju & Udeshi 2006): that one is cut in two by
/// the common part of the regions' faces, which the segment between the points passes through. Where it does
/// not, or the polygon does not keep to its envelope, however it is cut, the polygon is *loose*.
struct RegionPolygon {
  CellBlocks::Edge crossing;  ///< the lattice edge that is crossed
  int corners = 0;            ///< 3 or 4, counter-clockwise seen against the edge's axis
  std::array<Region, 4> regions{};
  std::array<Eigen::Vector3d, 4> points;
  std::array<int, 4> across{};  ///< axis of the step from each region to the next
  Eigen::Vector3d start;        ///< where the edge between the regions begins
  double length = 0;            ///< how long that edge is, voxels
  bool outwards = false;        ///< the outside is where the axis points to
  int diagonal = 0;             ///< a quad is cut from this corner to the one after the next
  bool loose = false;

  /// The corner that follows corner i.
  int next(int i) const { return i + 1 < corners ? i + 1 : 0; }
  int axis() const { return crossing.axis; }

  /// Calls f(corner, corner, corner) for each triangle, counter-clockwise seen from outside.
  template <class F>
  void for_each_triangle(F&& f) const {
    const auto add = [&](int a, int b, int c) { outwards ? f(a, b, c) : f(a, c, b); };
    if (corners == 3) return add(0, 1, 2);
    add(diagonal, diagonal + 1, diagonal + 2);
    add(diagonal, diagonal + 2, (diagonal + 3) % 4);
  }
};

/// A place on the common part of the faces of two regions, that of corner `side` and the next: where the
/// segment between their points passes it, or a place beside that, off its border.
Eigen::Vector3d place_on_face(const CellBlocks& cells, const RegionPolygon& polygon, int side);

/// The regions around an edge, from corner to corner: fewer than three if there is no polygon.
struct RegionRing {
  int corners = 0;
  std::array<Region, 4> regions{};
  std::array<int, 4> across{};  ///< axis of the step from each to the next
  int least_level = CellRegions::kLevels;
  const Region& largest() const;
};
/// The regions around a crossing edge.
RegionRing ring_of(const CellRegions& regions, const CellBlocks::Edge& edge);

/// The polygon of an edge. `ring` has three regions at least, one of them a cube, so that none is a cell of
/// several sheets.
RegionPolygon polygon_of(const CellRegions& regions, const CellBlocks::Edge& edge, const RegionRing& ring);

}  // namespace hermesh
