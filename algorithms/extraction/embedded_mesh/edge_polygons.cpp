#include "algorithms/extraction/embedded_mesh/edge_polygons.h"

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/embedded_mesh/envelope.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

std::vector<CellBlocks::Cell> listed(const ByBlock<BlockMask>& masks) {
  std::vector<CellBlocks::Cell> cells;
  for (std::size_t b = 0; b < masks.size(); ++b)
    for_each_bit(masks[b], [&](int cell) { cells.push_back({static_cast<std::int32_t>(b), cell}); });
  return cells;
}

}  // namespace

void PlainPoints::read(const CellBlocks& cells, std::int32_t block) {
  for (int slot = 0; slot < 8; ++slot) {
    const int d[3] = {slot & 1, (slot >> 1) & 1, slot >> 2};  // downwards
    const std::int32_t there = cells.source(block).neighbours[neighbour_slot(-d[0], -d[1], -d[2])];
    if (there < 0) continue;
    const std::uint64_t rows = last_layers(d[1], d[2]);
    const CellBlocks::Block& own = cells[there];
    for (int x = d[0] ? 7 : 0; x < 8; ++x)
      for (std::uint64_t word = own.active[x] & rows; word != 0; word &= word - 1) {
        const int bit = std::countr_zero(word), cell = 64 * x + bit;
        point_[at(x - 8 * d[0], (bit >> 3) - 8 * d[1], (bit & 7) - 8 * d[2])] =
            cells.is_plain(there, cell) ? own.first_point + rank_of(own, cell) : kNone;
      }
  }
}

EdgePolygons::EdgePolygons(const CellBlocks& cells, const TetrahedronCorners& corners,
                           const UniformPoints& points, const EdgeMasks* only, RunContext& context)
    : cells_(cells),
      corners_(corners),
      only_(only),
      edges_(cells.size()),
      held_(cells.size()),
      centred_(cells.size()) {
  parallel_blocks(cells_.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    if (only_ && !only_->has(b)) return;
    // Nearly all edges lie among plain cells, whose vertices are looked up once for the block. Crossings are
    // read at once, too, in the order of edges.
    PlainPoints near;
    near.read(cells_, block);
    std::array<EdgeCrossing, 3 * 512> crossings;
    cells_.grid().crossings(block, crossings.data());
    const EdgeCrossing* next = crossings.data();
    cells_.for_each_crossing_edge(block, [&](const CellBlocks::Edge& edge) {
      const double offset = (next++)->offset;
      if (test(edges(block, edge.axis), edge.sample)) decide(edge, offset, points, &near);
    });
  });
  number_all(context);
}

bool EdgePolygons::can_be_held(const CellBlocks::Cell& cell) const {
  if (cells_.is_joint(cell.block, cell.cell)) return false;
  const CellSheets& sheets = cells_.sheets(cell.block, cell.cell);
  return sheets.sheets > 1 || sheets.ambiguous_faces != 0;
}

bool EdgePolygons::is_crowded(const CellBlocks::Cell& cell) const {
  int sum = 0;
  cells_.for_each_about(cell, 1, [&](const CellBlocks::Cell& at) { sum += can_be_held(at); });
  return sum > 4;
}

void EdgePolygons::hold(const std::vector<CellBlocks::Cell>& cells, const UniformPoints& points,
                        RunContext& context) {
  // All are marked before any edge is decided, as that depends on all four cells around it. Sequential,
  // because the edges of a cell may be in several blocks; there are few such cells.
  for (const auto& [block, cell] : cells) set_bit(held_.at(block), cell);
  decide_again(cells, points, context);
}

void EdgePolygons::decide_again(const std::vector<CellBlocks::Cell>& cells, const UniformPoints& points,
                                RunContext& context) {
  for (const CellBlocks::Cell& cell : cells)
    cells_.for_each_crossed_edge_of(cell, [&](const CellBlocks::Edge& at) {
      if (!test(edges(at.block, at.axis), at.sample)) return;
      decide(at, cells_.grid().crossing(at.block, at.sample, at.axis).offset, points);
    });
  number_all(context);
}

std::vector<CellBlocks::Cell> EdgePolygons::held_cells() const { return listed(held_); }

void EdgePolygons::centre(const std::vector<CellBlocks::Cell>& cells) {
  for (const auto& [block, cell] : cells) set_bit(centred_.at(block), cell);
}

std::vector<CellBlocks::Cell> EdgePolygons::centred_cells() const { return listed(centred_); }

Vector3d EdgePolygons::crossing_position(const CellBlocks::Edge& edge) const {
  for (int i = 0; i < 4; ++i)
    if (is_centred(cells_.cell_around(edge, i)))
      return cells_.corner(edge.block, edge.sample) + 0.5 * Vector3d::Unit(edge.axis);
  return cells_.crossing_point(edge);
}

void EdgePolygons::number_all(RunContext& context) {
  const std::size_t blocks = cells_.size();
  std::vector<std::uint64_t> crossing_points(blocks), quads(blocks), triangles(blocks);
  parallel_blocks(blocks, context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    for (int axis = 0; axis < 3; ++axis) {
      const int fans = count(fanned(block, axis));
      crossing_points[b] += fans;
      quads[b] += count(edges(block, axis)) - fans;
      // A fan has a triangle for each of its four faces; at an explicit face two or none.
      for_each_bit(fanned(block, axis), [&](int sample) {
        const CellBlocks::Edge edge{block, sample, axis};
        const CellBlocks::Around around = cells_.around(edge);
        for (int i = 0; i < 4; ++i)
          triangles[b] += !is_explicit(around, i)                                 ? 1
                          : cells_.comes_first(edge, cells_.other_end(around, i)) ? 2
                                                                                  : 0;
      });
    }
  });
  fanned_edges_ = exclusive_scan(crossing_points, "points");
  points_ = cells_.point_count() + fanned_edges_;
  check_indices(points_, "points");
  quads_ = exclusive_scan(quads, "quads");
  triangles_ = exclusive_scan(triangles, "triangles");
  for (std::size_t b = 0; b < blocks; ++b) {
    if (!edges_.has(b)) continue;
    BlockEdges& edges = edges_.at(b);
    edges.first_crossing_point = static_cast<std::uint32_t>(cells_.point_count() + crossing_points[b]);
    edges.first_quad = static_cast<std::uint32_t>(quads[b]);
    edges.first_triangle = static_cast<std::uint32_t>(triangles[b]);
  }
}

void EdgePolygons::decide(const CellBlocks::Edge& edge, double hit, const UniformPoints& points,
                          const PlainPoints* near) {
  BlockEdges& edges = edges_.at(edge.block);
  std::array<std::uint32_t, 4> corners;
  bool any_explicit = false;
  // Only cells that are not plain have explicit faces.
  if (!(near ? near->around(edge, corners) : cells_.plain_points(edge, corners))) {
    const CellBlocks::Around around = cells_.around(edge);
    for (int i = 0; i < 4; ++i) any_explicit = any_explicit || is_explicit(around, i);
    corners = around.points;
  }
  EnvelopeCut cut;
  if (!any_explicit) {
    const auto [start, along] = corners_.ends(edge);
    const int axis = edge.axis, u = (axis + 1) % 3, v = (axis + 2) % 3;
    // A shear makes the edge parallel to its axis, and preserves tetrahedra.
    std::array<EnvelopeCorner, 4> r;
    for (int i = 0; i < 4; ++i) {
      const Vector3d p = points[corners[i]] - start;
      const double h = p[axis] / along[axis];
      r[i] = {p[u] - h * along[u], p[v] - h * along[v], h};
    }
    hit = (cells_.corner(edge.block, edge.sample)[axis] + hit - start[axis]) / along[axis];
    cut = cut_quad(r, hit);
  }
  // Both bits are written, so that the result does not depend on earlier decisions.
  set_bit(edges.fanned[edge.axis], edge.sample, cut.fanned);
  set_bit(edges.second_diagonal[edge.axis], edge.sample, !cut.fanned && cut.diagonal == 1);
}

std::uint32_t EdgePolygons::crossing_point(const CellBlocks::Edge& edge) const {
  // Numbered by block, axis and sample.
  std::uint32_t number = edges_[edge.block].first_crossing_point;
  for (int axis = 0; axis < edge.axis; ++axis) number += count(fanned(edge.block, axis));
  return number + rank_in(fanned(edge.block, edge.axis), edge.sample);
}

}  // namespace hermesh
