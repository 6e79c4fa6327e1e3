#include "algorithms/extraction/certified_octree/region_polygon.h"

#include <utility>

#include "algorithms/extraction/embedded_mesh/envelope.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Distance of a segment from the border of a face's common part, in sides of that.
constexpr double kFromBorder = 1e-3;

/// Returns the smaller of region i and the next one: its face is the common part of both regions' faces.
const Region& smaller_at(const RegionPolygon& polygon, int i) {
  const Region &a = polygon.regions[i], &b = polygon.regions[polygon.next(i)];
  return a.level < b.level ? a : b;
}

/// Returns true if the segment between the vertices of region i and the next intersects the common part of
/// their faces. Between regions of one size it always does, because the union of the two cubes is convex.
bool passes_face(const CellBlocks& cells, const RegionPolygon& polygon, int i) {
  if (polygon.regions[i].level == polygon.regions[polygon.next(i)].level) return true;
  const Region& smaller = smaller_at(polygon, i);
  const int across = polygon.across[i];
  const Vector3d place = polygon.pass(i, polygon.next(i), across);
  const Vector3d lower = cells.corner(smaller.block, smaller.cell);
  const double length = smaller.side();
  for (const int axis : {(across + 1) % 3, (across + 2) % 3})
    if (std::min(place[axis] - lower[axis], lower[axis] + length - place[axis]) <= kFromBorder * length)
      return false;
  return true;
}

}  // namespace

Vector3d place_on_face(const CellBlocks& cells, const RegionPolygon& polygon, int i) {
  const Region& smaller = smaller_at(polygon, i);
  const int across = polygon.across[i];
  // The vertices are on either side of the plane of the faces, at least margin() from it.
  Vector3d place = polygon.pass(i, polygon.next(i), across);
  const Vector3d lower = cells.corner(smaller.block, smaller.cell);
  for (const int axis : {(across + 1) % 3, (across + 2) % 3})
    place[axis] = std::clamp(place[axis], lower[axis] + kFromBorder * smaller.side(),
                             lower[axis] + (1 - kFromBorder) * smaller.side());
  return place;
}

RegionRing ring_of(const CellRegions& regions, const CellBlocks::Edge& edge) {
  const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
  // The regions of the four cells, each once. The cells of one cube are consecutive around an edge.
  std::array<Region, 4> around;
  for (int i = 0; i < 4; ++i) {
    const CellBlocks::Cell cell = regions.cells().cell_around(edge, i);
    around[i] = regions.at(cell.block, cell.cell);
  }
  RegionRing ring;
  int last_across = u;
  for (int i = 0; i < 4; ++i) {
    const int before = (i + 3) % 4;  // the step from it to i crosses a plane of constant u if it is even
    if (around[i] == around[before]) continue;
    // The step to a new region belongs to the one before it; the step to the first region is the last.
    (ring.corners > 0 ? ring.across[ring.corners - 1] : last_across) = before % 2 == 0 ? u : v;
    ring.regions[ring.corners++] = around[i];
    ring.least_level = std::min(ring.least_level, int(around[i].level));
  }
  if (ring.corners > 0) ring.across[ring.corners - 1] = last_across;
  return ring;
}

RegionPolygon polygon_of(const CellRegions& regions, const CellBlocks::Edge& edge, const RegionRing& ring) {
  const CellBlocks& cells = regions.cells();
  const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
  RegionPolygon polygon;
  static_cast<RegionRing&>(polygon) = ring;
  polygon.crossing = edge;
  for (int i = 0; i < polygon.corners; ++i) polygon.points[i] = regions.point(polygon.regions[i]);
  const int along = (edge.sample >> (edge.axis == 0 ? 6 : edge.axis == 1 ? 3 : 0)) & 7;
  // The edge between the regions is that of the smallest region, with its length and alignment. Only this
  // lattice edge of it is crossed, because each edge of a cube is crossed at most once (cell_regions.h).
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
  polygon.diagonal = cut.diagonal;
  // A loose quad is cut along its shorter diagonal; contact and distance are tested with that.
  if (const auto& p = polygon.points; cut.fanned && polygon.corners == 4)
    polygon.diagonal = (p[1] - p[3]).squaredNorm() < (p[0] - p[2]).squaredNorm();
  return polygon;
}

}  // namespace hermesh
