#include "algorithms/extraction/certified_octree/region_polygon.h"

#include <algorithm>
#include <utility>

#include "algorithms/extraction/embedded_mesh/envelope.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How far a segment keeps from the border of a face's common part, in sides of that.
constexpr double kFromBorder = 1e-3;

/// Whether the segment between the points of region i and the next one passes through the common part of
/// their faces, which is all of the smaller one's. Between regions of one size it does: the two cubes are
/// convex together.
bool passes_face(const CellBlocks& cells, const RegionPolygon& polygon, int i) {
  const Region &a = polygon.regions[i], &b = polygon.regions[polygon.next(i)];
  if (a.level == b.level) return true;
  const Region& smaller = a.level < b.level ? a : b;
  const int across = polygon.across[i];
  const Vector3d &p = polygon.points[i], &q = polygon.points[polygon.next(i)];
  const Vector3d place = p + (polygon.start[across] - p[across]) / (q[across] - p[across]) * (q - p);
  const Vector3d lower = cells.corner(smaller.block, smaller.cell);
  const double length = smaller.side();
  for (const int axis : {(across + 1) % 3, (across + 2) % 3})
    if (std::min(place[axis] - lower[axis], lower[axis] + length - place[axis]) <= kFromBorder * length)
      return false;
  return true;
}

/// The corner that the shorter diagonal of a quad starts from, 0 or 1.
int shorter_diagonal(const RegionPolygon& polygon) {
  const auto squared = [&](int i, int j) { return (polygon.points[i] - polygon.points[j]).squaredNorm(); };
  return squared(1, 3) < squared(0, 2);
}

}  // namespace

Vector3d place_on_face(const CellBlocks& cells, const RegionPolygon& polygon, int i) {
  const Region &a = polygon.regions[i], &b = polygon.regions[polygon.next(i)],
               &smaller = a.level < b.level ? a : b;
  const int across = polygon.across[i];
  const Vector3d &p = polygon.points[i], &q = polygon.points[polygon.next(i)];
  // Where the segment passes the plane of the faces: the points are on either side of it, off the faces by
  // margin() at least.
  Vector3d place = p + (polygon.start[across] - p[across]) / (q[across] - p[across]) * (q - p);
  const Vector3d lower = cells.corner(smaller.block, smaller.cell);
  for (const int axis : {(across + 1) % 3, (across + 2) % 3})
    place[axis] = std::clamp(place[axis], lower[axis] + kFromBorder * smaller.side(),
                             lower[axis] + (1 - kFromBorder) * smaller.side());
  return place;
}

const Region& RegionRing::largest() const {
  return *std::max_element(regions.begin(), regions.begin() + corners,
                           [](const Region& a, const Region& b) { return a.level < b.level; });
}

RegionRing ring_of(const CellRegions& regions, const CellBlocks::Edge& edge) {
  const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
  // The regions of the four cells, each once. The cells of one cube follow one another around an edge.
  std::array<Region, 4> around;
  for (std::size_t i = 0; i < 4; ++i) {
    const CellBlocks::Cell cell = regions.cells().cell_around(edge, static_cast<int>(i));
    around[i] = regions.at(cell.block, cell.cell);
  }
  RegionRing ring;
  int last_across = u;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::size_t before =
        (i + 3) % 4;  // the step from it to i crosses a plane of constant u if it is even
    if (around[i] == around[before]) continue;
    // The step to a new region belongs to the one before it; that to the first one is known last.
    (ring.corners > 0 ? ring.across[static_cast<std::size_t>(ring.corners - 1)] : last_across) =
        before % 2 == 0 ? u : v;
    ring.regions[static_cast<std::size_t>(ring.corners++)] = around[i];
    ring.least_level = std::min(ring.least_level, int(around[i].level));
  }
  if (ring.corners > 0) ring.across[static_cast<std::size_t>(ring.corners - 1)] = last_across;
  return ring;
}

RegionPolygon polygon_of(const CellRegions& regions, const CellBlocks::Edge& edge, const RegionRing& ring) {
  const CellBlocks& cells = regions.cells();
  const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
  RegionPolygon polygon;
  polygon.crossing = edge;
  polygon.corners = ring.corners;
  polygon.regions = ring.regions;
  polygon.across = ring.across;
  for (int i = 0; i < polygon.corners; ++i) polygon.points[i] = regions.point(polygon.regions[i]);
  const int along = edge.axis == 0   ? edge.sample >> 6
                    : edge.axis == 1 ? (edge.sample >> 3) & 7
                                     : edge.sample & 7;
  // The edge between the regions is the smallest region's: as long as that, and aligned as that is. It is
  // crossed once, here, for each cube's edges are (region_proposals.h).
  const int level = ring.least_level, before = along & ((1 << level) - 1);
  polygon.start = cells.corner(edge.block, edge.sample);
  polygon.start[edge.axis] -= before;
  polygon.length = 1 << level;
  polygon.outwards = test(cells.source(edge.block).inside, edge.sample);
  const double margin = cells.margin();
  const double hit =
      before + std::clamp(double(cells.grid().crossing(edge.block, edge.sample, edge.axis).offset), margin,
                          1.0 - margin);
  // The rule of envelopes of single cells, in units of this edge (envelope.h).
  std::array<EnvelopeCorner, 4> r;
  for (int i = 0; i < polygon.corners; ++i) {
    const Vector3d p = (polygon.points[i] - polygon.start) / polygon.length;
    r[i] = {p[u], p[v], p[edge.axis]};
  }
  const EnvelopeCut cut = polygon.corners == 4 ? cut_quad(r, hit / polygon.length)
                                               : cut_triangle({r[0], r[1], r[2]}, hit / polygon.length);
  polygon.loose = cut.fanned;
  for (int i = 0; i < polygon.corners; ++i) polygon.loose = polygon.loose || !passes_face(cells, polygon, i);
  // A loose polygon is cut somehow; contacts and distance are tested as it is.
  polygon.diagonal = cut.fanned && polygon.corners == 4 ? shorter_diagonal(polygon) : cut.diagonal;
  return polygon;
}

}  // namespace hermesh
