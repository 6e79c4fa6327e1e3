#include "algorithms/extraction/embedded_mesh/edge_polygons.h"

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/embedded_mesh/envelope.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

void set(BlockMask& mask, int sample, bool value = true) {
  const std::uint64_t bit = std::uint64_t{1} << (sample & 63);
  mask[sample >> 6] = value ? mask[sample >> 6] | bit : mask[sample >> 6] & ~bit;
}

std::vector<CellBlocks::Cell> listed(const ByBlock<BlockMask>& masks) {
  std::vector<CellBlocks::Cell> cells;
  for (std::size_t b = 0; b < masks.size(); ++b)
    for_each_bit(masks[b], [&](int cell) { cells.push_back({static_cast<std::int32_t>(b), cell}); });
  return cells;
}

}  // namespace

EdgePolygons::EdgePolygons(const CellBlocks& cells, const UniformPoints& points, const EdgeMasks* only,
                           RunContext& context)
    : cells_(cells), only_(only), edges_(cells.size()), held_(cells.size()), centred_(cells.size()) {
  // Each block decides for its own edges and writes nothing else, by points of cells that are all there: so
  // the result does not depend on threads.
  parallel_blocks(cells_.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    if (only_ && !only_->has(b)) return;
    // Nearly all edges lie among plain cells. Their points are looked up once for the block, and crossings
    // are read in one go: both are asked for by the order of edges.
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
  // All are marked before any edge decides: an edge looks at all four cells around it. Edges of one cell may
  // be in several blocks, so this runs in one thread; there are few such cells.
  for (const CellBlocks::Cell& cell : cells) set(held_.at(static_cast<std::size_t>(cell.block)), cell.cell);
  decide_again(cells, points, context);
}

void EdgePolygons::decide_again(const std::vector<CellBlocks::Cell>& cells, const UniformPoints& points,
                                RunContext& context) {
  for (const CellBlocks::Cell& cell : cells)
    for (int edge = 0; edge < 12; ++edge)
      if (const CellBlocks::Edge at = cells_.edge_of_cell(cell.block, cell.cell, edge); cells_.is_crossed(at))
        decide(at, cells_.grid().crossing(at.block, at.sample, at.axis).offset, points);
  number_all(context);
}

std::vector<CellBlocks::Cell> EdgePolygons::held_cells() const { return listed(held_); }

void EdgePolygons::centre(const std::vector<CellBlocks::Cell>& cells) {
  for (const auto& [block, cell] : cells) set(centred_.at(static_cast<std::size_t>(block)), cell);
}

std::vector<CellBlocks::Cell> EdgePolygons::centred_cells() const { return listed(centred_); }

Vector3d EdgePolygons::crossing_position(const CellBlocks::Edge& edge) const {
  for (int i = 0; i < 4; ++i)
    if (is_centred(cells_.cell_around(edge, i)))
      return cells_.corner(edge.block, edge.sample) + 0.5 * Vector3d::Unit(edge.axis);
  return cells_.crossing_point(edge);
}

void EdgePolygons::number_all(RunContext& context) {
  // Count, scan: each block's first numbers follow from how many the blocks before it have.
  const std::size_t blocks = cells_.size();
  std::vector<std::uint64_t> crossing_points(blocks), quads(blocks), triangles(blocks);
  parallel_blocks(blocks, context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    for (int axis = 0; axis < 3; ++axis) {
      const BlockMask& fanned = edges_[b].fanned[static_cast<std::size_t>(axis)];
      const int fans = count(fanned), all = count(edges(block, axis));
      crossing_points[b] += static_cast<std::uint64_t>(fans);
      quads[b] += static_cast<std::uint64_t>(all - fans);
      // An edge without explicit faces has four triangles, one that speaks for its segments more, others
      // fewer.
      for_each_bit(fanned, [&](int sample) {
        const CellBlocks::Edge edge{block, sample, axis};
        triangles[b] += static_cast<std::uint64_t>(fan_size(edge, cells_.around(edge)));
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

/// How many triangles polygons_of() makes of a fanned edge: 0 where the other ends of its segments speak for
/// all of them.
int EdgePolygons::fan_size(const CellBlocks::Edge& edge, const CellBlocks::Around& around) const {
  int made = 0;
  for (int i = 0; i < 4; ++i) {
    if (!is_explicit(around, i))
      ++made;
    else if (cells_.comes_first(edge, cells_.other_end(around, i)))
      made += 2;
  }
  return made;
}

void EdgePolygons::decide(const CellBlocks::Edge& edge, double hit, const UniformPoints& points,
                          const PlainPoints* near) {
  BlockEdges& edges = of(edge.block);
  std::array<std::uint32_t, 4> corners;
  bool any_explicit = false;
  // Explicit faces are only found beside cells that are not plain.
  if (!(near ? near->around(edge, corners) : cells_.plain_points(edge, corners))) {
    const CellBlocks::Around around = cells_.around(edge);
    for (int i = 0; i < 4; ++i) any_explicit = any_explicit || is_explicit(around, i);
    corners = around.points;
  }
  const int diagonal = any_explicit ? -1 : safe_diagonal(edge, hit, corners, points);
  // Both bits are written, so that the answer depends on points and held cells only, not on earlier answers.
  set(edges.fanned[edge.axis], edge.sample, diagonal < 0);
  set(edges.second_diagonal[edge.axis], edge.sample, diagonal == 1);
}

/// The diagonal to cut a quad along, 0 or 1; −1 if neither keeps the triangles in the envelope.
int EdgePolygons::safe_diagonal(const CellBlocks::Edge& edge, double hit,
                                const std::array<std::uint32_t, 4>& corners,
                                const UniformPoints& points) const {
  // The edge is one voxel long, so its own frame needs no scaling.
  const Vector3d start = cells_.corner(edge.block, edge.sample);
  std::array<EnvelopeCorner, 4> r;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vector3d p = points[corners[i]] - start;
    r[i] = {p[(edge.axis + 1) % 3], p[(edge.axis + 2) % 3], p[edge.axis]};
  }
  const EnvelopeCut cut = cut_quad(r, hit);
  return cut.fanned ? -1 : cut.diagonal;
}

std::uint32_t EdgePolygons::crossing_point(const CellBlocks::Edge& edge) const {
  const BlockEdges& edges = of(edge.block);
  // Points on fanned edges are numbered by block, axis and sample.
  std::uint32_t number = edges.first_crossing_point;
  for (int axis = 0; axis < edge.axis; ++axis)
    number += static_cast<std::uint32_t>(count(edges.fanned[axis]));
  return number + rank_in(edges.fanned[edge.axis], edge.sample);
}

}  // namespace hermesh
