// The triangles of the finest mesh near a place, found through the lattice, and whether two of them meet.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "algorithms/extraction/manifold_dual_contouring/edge_polygons.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_contact.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_grid.h"

namespace hermesh {

/// How far any point may be from its cell along an axis, in voxels: so the polygons near a place are known.
inline constexpr double kFarthestFromCell = 1.0;

class PolygonNeighbourhood {
 public:
  /// `points` by number, those on fanned edges included.
  PolygonNeighbourhood(const CellBlocks& cells, const EdgePolygons& polygons, const std::vector<Eigen::Vector3d>& points)
      : cells_(cells), polygons_(polygons), points_(points) {}

  template <class F>
  void for_each_triangle(const CellBlocks::Edge& edge, F&& f) const {
    polygons_.polygons_of(
        edge,
        [&](const Quad& q) {
          f(Triangle{q[0], q[1], q[2]});
          f(Triangle{q[0], q[2], q[3]});
        },
        f);
  }

  /// Calls f(edge, triangle) for all triangles whose boxes overlap this one, which must not reach more than three voxels out
  /// of the block. The triangles of an edge lie in the box of its four cells and kFarthestFromCell around it, so their edges
  /// begin at most six samples outside the block.
  template <class F>
  void for_each_near(std::int32_t block, const Box3& box, F&& f) const {
    const Eigen::Vector3d origin = cells_.corner(block, 0);
    int first[3], last[3];
    for (int a = 0; a < 3; ++a) {
      first[a] = static_cast<int>(std::floor(box.lower[a] - origin[a] - 2.0 - kFarthestFromCell));
      last[a] = static_cast<int>(std::ceil(box.upper[a] - origin[a] + 1.0 + kFarthestFromCell));
    }
    for_each_crossing_within(block, first, last, [&](const CellBlocks::Edge& edge) {
      for_each_triangle(edge, [&](const Triangle& t) {
        if (box.overlaps(box_of(t))) f(edge, t);
      });
    });
  }

  Box3 box_of(const Triangle& t) const {
    Box3 box;
    for (const std::uint32_t p : t) box.add(points_[p]);
    return box;
  }

  /// Whether it is certain that two triangles meet in nothing but the corners that they share.
  bool apart(const Triangle& a, const Triangle& b) const { return certainly_apart(a, b, points_); }

 private:
  /// Crossing edges that begin at samples between two, seen from a block; row by row, of which a mask has eight bits.
  template <class F>
  void for_each_crossing_within(std::int32_t block, const int (&first)[3], const int (&last)[3], F&& f) const {
    for (int x = first[0]; x <= last[0]; ++x)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int z = first[2]; z <= last[2]; z = (z | 7) + 1) {
          const CellBlocks::Cell row = cells_.locate(block, x, y, z & ~7);
          if (row.block < 0) continue;
          const int end = std::min(last[2], z | 7) & 7;
          const unsigned wanted = (2u << end) - (1u << (z & 7));
          for (int axis = 0; axis < 3; ++axis) {
            const BlockMask& crossing = cells_.grid().blocks()[row.block].crossing[axis];
            auto bits = static_cast<unsigned>(crossing[row.cell >> 6] >> (row.cell & 63)) & wanted;
            for (; bits != 0; bits &= bits - 1) f(CellBlocks::Edge{row.block, row.cell + std::countr_zero(bits), axis});
          }
        }
  }

  const CellBlocks& cells_;
  const EdgePolygons& polygons_;
  const std::vector<Eigen::Vector3d>& points_;
};

}  // namespace hermesh
