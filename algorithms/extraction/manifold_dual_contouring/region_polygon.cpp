#include "algorithms/extraction/manifold_dual_contouring/region_polygon.h"

#include <algorithm>
#include <utility>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Cells around an edge, as steps along the two other axes, counter-clockwise.
constexpr int kSteps[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};

bool is_same(const CellBlocks::Edge& a, const CellBlocks::Edge& b) {
  return a.block == b.block && a.sample == b.sample && a.axis == b.axis;
}

/// Calls f(edge) for those that are crossed of so many edges of a block that follow one another in a line.
template <class F>
void for_each_crossing_on(const CellBlocks::Edge& first, int length, const CellBlocks& cells, F&& f) {
  if (first.block < 0) return;
  constexpr int kStep[3] = {64, 8, 1};
  const BlockMask& crossing = cells.source(first.block).crossing[static_cast<std::size_t>(first.axis)];
  for (int k = 0, sample = first.sample; k < length; ++k, sample += kStep[first.axis])
    if (test(crossing, sample)) f(CellBlocks::Edge{first.block, sample, first.axis});
}

/// What a segment keeps from the border of a face's common part, and how far a point that takes its place is
/// from that at least; in sides of it.
constexpr double kFromBorder = 1e-3, kFarFromBorder = 0.02;

/// Segments between regions of one size stay in the two cubes, which are convex together.
void hold_if_needed(const Regions& regions, RegionPolygon& polygon, int i) {
  const Region &a = polygon.regions[i], &b = polygon.regions[polygon.next(i)];
  if (a.level == b.level) return;
  const CellBlocks& cells = regions.cells();
  const Region& smaller = a.level < b.level ? a : b;
  RegionPolygon::Side& side = polygon.sides[i];
  const int f = side.across, p = (f + 1) % 3, q = (f + 2) % 3;
  const double length = smaller.side();
  const Vector3d lower = cells.corner(smaller.block, smaller.cell);
  const auto off_border = [&](int axis) {
    return std::min(side.place[axis] - lower[axis], lower[axis] + length - side.place[axis]);
  };
  if (std::min(off_border(p), off_border(q)) > kFromBorder * length) return;
  side.held = true;
  polygon.cut.fanned = true;
  // The surface crosses the face's border here and once more: the middle between the two.
  const FaceBorder border = face_border(regions, polygon, i);
  Vector3d sum = Vector3d::Zero();
  const int found = std::min(border.count, 2);
  for (int k = 0; k < found; ++k) {
    const CellBlocks::Edge& edge = border.edges[static_cast<std::size_t>(k)];
    sum += cells.crossing_point(edge);
    if (!is_same(edge, polygon.crossing)) side.partner = edge;
  }
  side.place = sum / found;
  for (const int axis : {p, q})
    side.place[axis] = std::clamp(side.place[axis], lower[axis] + kFarFromBorder * length,
                                  lower[axis] + (1.0 - kFarFromBorder) * length);
  side.place = regions.file().rounded(side.place);
}

}  // namespace

FaceBorder face_border(const Regions& regions, const RegionPolygon& polygon, int i) {
  const Region &a = polygon.regions[i], &b = polygon.regions[polygon.next(i)],
               &smaller = a.level < b.level ? a : b;
  const CellBlocks& cells = regions.cells();
  const int f = polygon.sides[i].across, p = (f + 1) % 3, q = (f + 2) % 3;
  int at[3] = {smaller.cell >> 6, (smaller.cell >> 3) & 7, smaller.cell & 7};
  if (polygon.start[f] > cells.corner(smaller.block, smaller.cell)[f]) at[f] += smaller.side();
  FaceBorder border;
  for (const auto& [along, other] : {std::pair{p, q}, std::pair{q, p}})
    for (const int step : {0, smaller.side()}) {
      int first[3] = {at[0], at[1], at[2]};
      first[other] += step;
      const CellBlocks::Cell cell = cells.locate(smaller.block, first[0], first[1], first[2]);
      for_each_crossing_on({cell.block, cell.cell, along}, smaller.side(), cells,
                           [&](const CellBlocks::Edge& edge) {
                             if (border.count < 2)
                               border.edges[static_cast<std::size_t>(border.count)] = edge;
                             ++border.count;
                           });
    }
  return border;
}

int crossings_on(const CellBlocks::Edge& first, int length, const CellBlocks& cells) {
  int found = 0;
  for_each_crossing_on(first, length, cells, [&](const CellBlocks::Edge&) { ++found; });
  return found;
}

RegionRing ring_of(const Regions& regions, const CellBlocks::Edge& edge) {
  const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
  std::array<Region, 4> around;
  for (std::size_t i = 0; i < 4; ++i) {
    int at[3] = {edge.sample >> 6, (edge.sample >> 3) & 7, edge.sample & 7};
    at[u] += kSteps[i][0];
    at[v] += kSteps[i][1];
    const CellBlocks::Cell cell = regions.cells().locate(edge.block, at[0], at[1], at[2]);
    around[i] = regions.at(cell.block, cell.cell);
  }
  RegionRing ring;
  int last_across = u;
  for (std::size_t i = 0; i < 4; ++i) {
    ring.any_merged = ring.any_merged || around[i].merged();
    const std::size_t before =
        (i + 3) % 4;  // the step from it to i crosses a plane of constant u if it is even
    if (around[i] == around[before]) continue;
    (ring.corners > 0 ? ring.across[static_cast<std::size_t>(ring.corners - 1)] : last_across) =
        before % 2 == 0 ? u : v;
    ring.regions[static_cast<std::size_t>(ring.corners++)] = around[i];
    ring.least_level = std::min(ring.least_level, int(around[i].level));
  }
  if (ring.corners > 0) ring.across[static_cast<std::size_t>(ring.corners - 1)] = last_across;
  return ring;
}

std::optional<RegionPolygon> polygon_of(const Regions& regions, const CellBlocks::Edge& edge,
                                        const RegionRing& ring) {
  if (!ring.has_polygon()) return std::nullopt;
  const CellBlocks& cells = regions.cells();
  const int u = (edge.axis + 1) % 3, v = (edge.axis + 2) % 3;
  RegionPolygon polygon;
  polygon.crossing = edge;
  polygon.corners = ring.corners;
  polygon.regions = ring.regions;
  for (std::size_t i = 0; i < 4; ++i) polygon.sides[i].across = ring.across[i];
  for (int i = 0; i < polygon.corners; ++i) {
    const Region& region = polygon.regions[i];
    if (!region.merged() && cells.sheets(region.block, region.cell).sheets != 1) return std::nullopt;
    polygon.points[i] = regions.point(region);
  }
  const int along = edge.axis == 0   ? edge.sample >> 6
                    : edge.axis == 1 ? (edge.sample >> 3) & 7
                                     : edge.sample & 7;
  const int level = ring.least_level, before = along & ((1 << level) - 1);
  polygon.start = cells.corner(edge.block, edge.sample);
  polygon.start[edge.axis] -= before;
  polygon.length = 1 << level;
  polygon.outwards = test(cells[edge.block].inside, edge.sample);
  const double margin = cells.margin();
  const double hit =
      before + std::clamp(double(cells.grid().crossing(edge.block, edge.sample, edge.axis).offset), margin,
                          1.0 - margin);
  std::array<EnvelopeCorner, 4> r;
  for (int i = 0; i < polygon.corners; ++i) {
    const Vector3d p = (polygon.points[i] - polygon.start) / polygon.length;
    r[i] = {p[u], p[v], p[edge.axis]};
  }
  polygon.cut = polygon.corners == 4 ? cut_quad(r, hit / polygon.length)
                                     : cut_triangle({r[0], r[1], r[2]}, hit / polygon.length);
  for (int i = 0; i < polygon.corners; ++i) {
    RegionPolygon::Side& side = polygon.sides[i];
    // From below the plane to above, so that the polygon on the other side of the face finds the same bits.
    const Vector3d *a = &polygon.points[i], *b = &polygon.points[polygon.next(i)];
    if ((*a)[side.across] > (*b)[side.across]) std::swap(a, b);
    side.place = *a + (polygon.start[side.across] - (*a)[side.across]) /
                          ((*b)[side.across] - (*a)[side.across]) * (*b - *a);
    hold_if_needed(regions, polygon, i);
  }
  if (polygon.cut.fanned) polygon.cut.height = hit / polygon.length;
  polygon.middle = polygon.start;
  polygon.middle[edge.axis] += polygon.cut.height * polygon.length;
  if (polygon.cut.fanned) polygon.middle = regions.file().rounded(polygon.middle);
  return polygon;
}

}  // namespace hermesh
