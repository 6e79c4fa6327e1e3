// The polygon that a crossing edge has where cells share points.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "algorithms/extraction/manifold_dual_contouring/envelope.h"
#include "algorithms/extraction/manifold_dual_contouring/regions.h"

namespace hermesh {

/// Of three or four regions around an edge that is the common part of the regions' edges there. Its envelope is made of a
/// tetrahedron for each two regions that follow one another, of the edge and their points, as on an octree (Ju & Udeshi 2006):
/// that one is cut in two by the common part of the regions' faces, which the segment between the points passes through. Where
/// it does not, the polygon is held to a point of that face instead, and fanned.
struct RegionPolygon {
  /// Between region i and the next one.
  struct Side {
    int across;                           ///< axis
    bool held = false;                    ///< to a point of the face
    Eigen::Vector3d place;                ///< where it passes from one to the other; rounded if held
    CellBlocks::Edge partner = {-1, 0, 0};  ///< if held: the crossing edge of the other polygon on this side
  };
  CellBlocks::Edge crossing;  ///< the lattice edge that is crossed
  int corners = 0;            ///< 3 or 4, counter-clockwise seen against the edge's axis
  std::array<Region, 4> regions{};
  std::array<Eigen::Vector3d, 4> points;
  std::array<Side, 4> sides;
  Eigen::Vector3d start;  ///< of the edge, as it is between the regions
  double length = 0;      ///< of it
  bool outwards = false;  ///< the outside is where the axis points to
  EnvelopeCut cut;
  Eigen::Vector3d middle;  ///< where the surface passes through the edge; rounded for the file where it is a point of a fan

  int next(int i) const { return i + 1 < corners ? i + 1 : 0; }
  int axis() const { return crossing.axis; }
  static constexpr int kMiddle = 4, kFirstSide = 5;
  /// By a number that for_each_triangle() gives.
  Eigen::Vector3d place(int corner) const {
    return corner < kMiddle ? points[corner] : corner == kMiddle ? middle : sides[corner - kFirstSide].place;
  }

  /// Calls f(corner, corner, corner), counter-clockwise seen from outside; kMiddle is the crossing of a fanned polygon,
  /// kFirstSide + i the point that side i is held to.
  template <class F>
  void for_each_triangle(F&& f) const {
    const auto add = [&](int a, int b, int c) { outwards ? f(a, b, c) : f(a, c, b); };
    if (cut.fanned) {
      for (int i = 0; i < corners; ++i)
        if (!sides[i].held) {
          add(kMiddle, i, next(i));
        } else {
          add(kMiddle, i, kFirstSide + i);
          add(kMiddle, kFirstSide + i, next(i));
        }
    } else if (corners == 3) {
      add(0, 1, 2);
    } else {
      const int d = cut.diagonal;
      add(d, d + 1, d + 2);
      add(d, d + 2, (d + 3) % 4);
    }
  }
};

/// The crossing edges on the border of the common part of two regions' faces.
struct FaceBorder {
  int count = 0;
  std::array<CellBlocks::Edge, 2> edges;  ///< the first two
};
FaceBorder face_border(const Regions& regions, const RegionPolygon& polygon, int side);

/// How many are crossed of so many edges of a block that follow one another in a line.
int crossings_on(const CellBlocks::Edge& first, int length, const CellBlocks& cells);

/// The regions around an edge, from corner to corner: fewer than three if there is no polygon.
struct RegionRing {
  int corners = 0;
  std::array<Region, 4> regions{};
  std::array<int, 4> across{};  ///< axis of the step from each to the next
  int least_level = Regions::kLevels;
  bool any_merged = false;
  bool has_polygon() const { return corners >= 3; }
};
RegionRing ring_of(const Regions& regions, const CellBlocks::Edge& edge);

/// None where fewer than three regions are around the edge, or where one of them is a cell of several sheets.
std::optional<RegionPolygon> polygon_of(const Regions& regions, const CellBlocks::Edge& edge, const RegionRing& ring);
inline std::optional<RegionPolygon> polygon_of(const Regions& regions, const CellBlocks::Edge& edge) {
  return polygon_of(regions, edge, ring_of(regions, edge));
}

}  // namespace hermesh
