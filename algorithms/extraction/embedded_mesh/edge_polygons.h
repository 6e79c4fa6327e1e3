// The polygons of each crossing edge of a lattice: a quad of the points of its four cells, or a fan
// (uniform_mesh.h says why no two of them meet).
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/extraction/embedded_mesh/by_block.h"
#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/extraction/embedded_mesh/plain_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// Edges of a lattice as bits: for each block and axis a bit for each first sample.
using EdgeMasks = ByBlock<std::array<BlockMask, 3>>;

/// What each crossing edge becomes, a quad or a fan, and the numbers of points and polygons that follow from
/// it. Points are those of CellBlocks, and behind them one for each fanned edge, at its crossing.
class EdgePolygons {
 public:
  /// Decides for each edge what it becomes, by the places of the cells' points. Points on fanned edges get
  /// the numbers from cells.point_count() on. No cell is held yet.
  /// @param cells must outlive this
  /// @param points places of the cells' points, in index space relative to the placement's base
  /// @param only the crossing edges that have polygons here, all if null; must outlive this
  /// @param context told of progress, and asked whether to stop
  /// @throws Error if there are more points or polygons than 32 bits can number; Cancelled.
  EdgePolygons(const CellBlocks& cells, const UniformPoints& points, const EdgeMasks* only,
               RunContext& context);

  const BlockMask& edges(std::int32_t block, int axis) const {
    const auto b = static_cast<std::size_t>(block), a = static_cast<std::size_t>(axis);
    return only_ ? (*only_)[b][a] : cells_.source(block).crossing[a];
  }

  /// Whether the cell would have explicit faces of its own if it were held to them.
  bool can_be_held(const CellBlocks::Cell& cell) const;
  /// Whether more than four cells that can be held are among the 27 about this one. There, as nearly
  /// everywhere in noise, a point finds no room to move.
  bool is_crowded(const CellBlocks::Cell& cell) const;
  bool is_held(const CellBlocks::Cell& cell) const {
    return test(held_[static_cast<std::size_t>(cell.block)], cell.cell);
  }
  /// Holds cells to their segments, and decides anew for the edges around them. Throws as the constructor
  /// does.
  void hold(const std::vector<CellBlocks::Cell>& cells, const UniformPoints& points, RunContext& context);
  std::vector<CellBlocks::Cell> held_cells() const;

  bool is_centred(const CellBlocks::Cell& cell) const {
    return test(centred_[static_cast<std::size_t>(cell.block)], cell.cell);
  }
  /// Moves the crossings of cells to the middles of their edges (crossing_position()). The edges around all
  /// cells whose points move with them must then be decided again.
  void centre(const std::vector<CellBlocks::Cell>& cells);
  std::vector<CellBlocks::Cell> centred_cells() const;
  /// Decides again for the edges around cells. Throws as the constructor does.
  void decide_again(const std::vector<CellBlocks::Cell>& cells, const UniformPoints& points,
                    RunContext& context);
  /// Returns the position of a crossing before rounding: the middle of its edge if any of the four cells is
  /// centred.
  Eigen::Vector3d crossing_position(const CellBlocks::Edge& edge) const;

  std::uint64_t point_count() const { return points_; }  ///< points of cells and points on fanned edges
  std::uint64_t fanned_edges() const { return fanned_edges_; }
  std::uint64_t quad_count() const { return quads_; }
  std::uint64_t triangle_count() const { return triangles_; }
  /// How many quads, and how many triangles, the blocks before this one have.
  std::uint32_t first_quad(std::int32_t block) const { return of(block).first_quad; }
  std::uint32_t first_triangle(std::int32_t block) const { return of(block).first_triangle; }

  bool is_fanned(const CellBlocks::Edge& edge) const {
    return test(of(edge.block).fanned[edge.axis], edge.sample);
  }
  const BlockMask& fanned(std::int32_t block, int axis) const { return of(block).fanned[axis]; }
  /// The number of the point on a fanned edge.
  std::uint32_t crossing_point(const CellBlocks::Edge& edge) const;

  /// Calls quad(Quad) or triangle(Triangle) for the polygons of an edge, counter-clockwise seen from outside
  /// (at a cut from the edge's second sample). Where two fanned edges share a segment, only the one that
  /// comes first (CellBlocks::comes_first()) has the two triangles beside it. `near` has the points about the
  /// edge's block, or is null where they are not at hand.
  template <class OnQuad, class OnTriangle>
  void polygons_of(const CellBlocks::Edge& edge, OnQuad&& quad, OnTriangle&& triangle,
                   const PlainPoints* near = nullptr) const {
    const bool outwards = test(cells_.source(edge.block).inside, edge.sample);  // along the axis
    if (!is_fanned(edge)) {
      std::array<std::uint32_t, 4> p;
      if (!(near ? near->around(edge, p) : cells_.plain_points(edge, p))) p = cells_.around(edge).points;
      const std::size_t d = test(of(edge.block).second_diagonal[edge.axis], edge.sample);
      Quad q = {p[d], p[d + 1], p[d + 2], p[(d + 3) % 4]};
      if (!outwards) std::swap(q[1], q[3]);
      quad(q);
      return;
    }
    const CellBlocks::Around around = cells_.around(edge);
    const std::uint32_t x = crossing_point(edge);
    const auto add = [&](std::uint32_t b, std::uint32_t c) {
      triangle(outwards ? Triangle{x, b, c} : Triangle{x, c, b});
    };
    for (int i = 0; i < 4; ++i) {
      const std::uint32_t p = around.points[i], q = around.points[(i + 1) % 4];
      if (!is_explicit(around, i)) {
        add(p, q);
        continue;
      }
      const CellBlocks::Edge other = cells_.other_end(around, i);
      if (!cells_.comes_first(edge, other)) continue;
      const std::uint32_t y = crossing_point(other);
      add(p, y);
      add(y, q);
    }
  }

 private:
  struct BlockEdges {
    std::array<BlockMask, 3> fanned{}, second_diagonal{};
    std::uint32_t first_crossing_point = 0, first_quad = 0, first_triangle = 0;
  };

  bool is_explicit(const CellBlocks::Around& around, int i) const {
    return cells_.can_be_explicit(around, i) &&
           (is_held(around.cells[i]) || is_held(around.cells[(i + 1) % 4]));
  }
  const BlockEdges& of(std::int32_t block) const { return edges_[static_cast<std::size_t>(block)]; }
  BlockEdges& of(std::int32_t block) { return edges_.at(static_cast<std::size_t>(block)); }
  void number_all(RunContext& context);
  int fan_size(const CellBlocks::Edge& edge, const CellBlocks::Around& around) const;
  /// Notes what an edge becomes. `hit` is the offset of its crossing, in voxels.
  void decide(const CellBlocks::Edge& edge, double hit, const UniformPoints& points,
              const PlainPoints* near = nullptr);
  int safe_diagonal(const CellBlocks::Edge& edge, double hit, const std::array<std::uint32_t, 4>& corners,
                    const UniformPoints& points) const;

  const CellBlocks& cells_;
  const EdgeMasks* const only_;
  ByBlock<BlockEdges> edges_;
  ByBlock<BlockMask>
      held_;  ///< held cells; apart from `edges_`, for this is read across blocks while those are made
  std::uint64_t points_ = 0, fanned_edges_ = 0, quads_ = 0, triangles_ = 0;
  ByBlock<BlockMask> centred_;  ///< centred cells
};

}  // namespace hermesh
