// The polygon of a crossed edge between regions.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>

#include "algorithms/extraction/certified_octree/cell_regions.h"

namespace hermesh {

/// The regions around a crossed edge, in order; the edge has no polygon if there are fewer than three.
struct RegionRing {
  int corners = 0;
  std::array<Region, 4> regions{};
  std::array<int, 4> across{};  ///< axis of the step from each region to the next
  int least_level = CellRegions::kLevels;
  const Region& largest() const {
    return *std::max_element(regions.begin(), regions.begin() + corners,
                             [](const Region& a, const Region& b) { return a.level < b.level; });
  }
};

/// The polygon of an edge with three or four regions around it. The edge between the regions is the common
/// part of their edges there. Its envelope consists of a tetrahedron for each two consecutive regions, of the
/// edge and their vertices, as on an octree (Ju & Udeshi 2006): the common part of the regions' faces divides
/// it in two, if the segment between the vertices intersects that part. If it does not, or no division keeps
/// the polygon in its envelope, the polygon is *loose*.
struct RegionPolygon : RegionRing {
  CellBlocks::Edge crossing;              ///< the crossed lattice edge
  std::array<Eigen::Vector3d, 4> points;  ///< corners, counter-clockwise seen against the edge's axis
  Eigen::Vector3d start;                  ///< of the edge between the regions
  double length = 0;                      ///< of the edge between the regions, voxels
  bool outwards = false;                  ///< the outside is in the direction of the axis
  int diagonal = 0;                       ///< a quad is cut from this corner to the one after the next
  bool loose = false;

  int next(int i) const { return i + 1 < corners ? i + 1 : 0; }
  /// Returns where the segment between corners i and j intersects the plane through the edge across an axis.
  Eigen::Vector3d pass(int i, int j, int axis) const {
    const Eigen::Vector3d &p = points[i], &q = points[j];
    return p + (start[axis] - p[axis]) / (q[axis] - p[axis]) * (q - p);
  }
  /// Calls f(corner, corner, corner) for each triangle, counter-clockwise seen from outside.
  template <class F>
  void for_each_triangle(F&& f) const {
    const auto add = [&](int a, int b, int c) { outwards ? f(a, b, c) : f(a, c, b); };
    if (corners == 3) return add(0, 1, 2);
    add(diagonal, diagonal + 1, diagonal + 2);
    add(diagonal, diagonal + 2, (diagonal + 3) % 4);
  }
};

/// Returns a point of the common part of the faces of the regions of corner i and the next: the intersection
/// with the segment between their vertices, moved into the interior if necessary.
Eigen::Vector3d place_on_face(const CellBlocks& cells, const RegionPolygon& polygon, int i);

/// Returns the regions around a crossed edge.
RegionRing ring_of(const CellRegions& regions, const CellBlocks::Edge& edge);

/// Returns the polygon of an edge. `ring` has at least three regions, one of them a cube, so none is a cell
/// of several sheets.
RegionPolygon polygon_of(const CellRegions& regions, const CellBlocks::Edge& edge, const RegionRing& ring);

}  // namespace hermesh
