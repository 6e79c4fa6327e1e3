// The polygons of each crossed edge of a lattice: a quad of the vertices of its four cells, or a fan
// (uniform_mesh.h explains why no two of them intersect).
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/extraction/embedded_mesh/tetrahedron_corners.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// A set of edges of a lattice: by block and axis, one bit per first sample.
using EdgeMasks = ByBlock<std::array<BlockMask, 3>>;

/// The vertices of the plain cells in and just below a block, looked up once for all of its edges. One object
/// serves many blocks in turn.
class PlainPoints {
 public:
  /// Looks up the vertices for the edges of a block.
  void read(const CellBlocks& cells, std::int32_t block);
  /// Does the same as CellBlocks::plain_points(), for a crossed edge of the block that was read.
  bool around(const CellBlocks::Edge& edge, std::array<std::uint32_t, 4>& points) const {
    constexpr int kStep[3] = {81, 9, 1};
    const int first = at(edge.sample >> 6, (edge.sample >> 3) & 7, edge.sample & 7);
    const int u = kStep[(edge.axis + 1) % 3], v = kStep[(edge.axis + 2) % 3];
    points = {point_[first - u - v], point_[first - v], point_[first], point_[first - u]};
    return points[0] != kNone && points[1] != kNone && points[2] != kNone && points[3] != kNone;
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  static int at(int x, int y, int z) { return 81 * (x + 1) + 9 * (y + 1) + z + 1; }
  std::array<std::uint32_t, 729>
      point_;  ///< of cells −1 to 7 along each axis; valid around crossed edges only
};

/// The form of each crossed edge, a quad or a fan, and the resulting numbers of vertices and polygons.
/// Vertices are those of CellBlocks, followed by one for each fanned edge, at its crossing.
class EdgePolygons {
 public:
  /// Decides the form of each edge by the positions of the cells' vertices. No cell is held yet.
  /// @param cells must outlive this, as must `corners`
  /// @param corners of the tetrahedra
  /// @param points positions of the cells' vertices
  /// @param only the crossed edges that get polygons, all if null; must outlive this
  /// @param context receives the progress and the request to cancel
  /// @throws Error for more than 2³² vertices or polygons; Cancelled
  EdgePolygons(const CellBlocks& cells, const TetrahedronCorners& corners, const UniformPoints& points,
               const EdgeMasks* only, RunContext& context);

  const TetrahedronCorners& corners() const { return corners_; }

  const BlockMask& edges(std::int32_t block, int axis) const {
    return only_ ? (*only_)[block][axis] : cells_.source(block).crossing[axis];
  }

  /// Returns true if the cell would have explicit faces if it were held, i.e. constrained to them.
  bool can_be_held(const CellBlocks::Cell& cell) const;
  /// Returns true if more than four of the 27 cells around this one can be held. In such a neighbourhood, as
  /// in most of a noise field, a vertex has no room to move.
  bool is_crowded(const CellBlocks::Cell& cell) const;
  bool is_held(const CellBlocks::Cell& cell) const { return test(held_[cell.block], cell.cell); }
  /// Holds cells to their segments, and decides the edges around them again. Throws as the constructor does.
  void hold(const std::vector<CellBlocks::Cell>& cells, const UniformPoints& points, RunContext& context);
  std::vector<CellBlocks::Cell> held_cells() const;

  bool is_centred(const CellBlocks::Cell& cell) const { return test(centred_[cell.block], cell.cell); }
  /// Moves the crossings of cells to the middles of their edges (crossing_position()). The edges around all
  /// cells whose vertices move with them must then be decided again.
  void centre(const std::vector<CellBlocks::Cell>& cells);
  std::vector<CellBlocks::Cell> centred_cells() const;
  /// Decides the edges around cells again. Throws as the constructor does.
  void decide_again(const std::vector<CellBlocks::Cell>& cells, const UniformPoints& points,
                    RunContext& context);
  /// Returns the position of a crossing before rounding: the middle of its edge if any of the four cells is
  /// centred.
  Eigen::Vector3d crossing_position(const CellBlocks::Edge& edge) const;

  /// Cuts the quad of an edge along its other diagonal.
  void turn_quad(const CellBlocks::Edge& edge) {
    BlockMask& second = edges_.at(edge.block).second_diagonal[edge.axis];
    set_bit(second, edge.sample, !test(second, edge.sample));
  }

  std::uint64_t point_count() const { return points_; }  ///< vertices of cells and of fanned edges
  std::uint64_t fanned_edges() const { return fanned_edges_; }
  std::uint64_t quad_count() const { return quads_; }
  std::uint64_t triangle_count() const { return triangles_; }
  /// Returns the number of quads, and of triangles, of the blocks before this one.
  std::uint32_t first_quad(std::int32_t block) const { return edges_[block].first_quad; }
  std::uint32_t first_triangle(std::int32_t block) const { return edges_[block].first_triangle; }

  bool is_fanned(const CellBlocks::Edge& edge) const {
    return test(fanned(edge.block, edge.axis), edge.sample);
  }
  const BlockMask& fanned(std::int32_t block, int axis) const { return edges_[block].fanned[axis]; }
  /// Returns the number of the vertex on a fanned edge.
  std::uint32_t crossing_point(const CellBlocks::Edge& edge) const;

  /// Calls quad(Quad) or triangle(Triangle) for the polygons of an edge, counter-clockwise seen from outside
  /// (at a cut: from the edge's second sample). If two fanned edges share a segment, the first of them
  /// (CellBlocks::comes_first()) has the two triangles at it. `near`, if not null, has read the edge's block.
  template <class OnQuad, class OnTriangle>
  void polygons_of(const CellBlocks::Edge& edge, OnQuad&& quad, OnTriangle&& triangle,
                   const PlainPoints* near = nullptr) const {
    const bool outwards = test(cells_.source(edge.block).inside, edge.sample);  // along the axis
    if (!is_fanned(edge)) {
      std::array<std::uint32_t, 4> p;
      if (!(near ? near->around(edge, p) : cells_.plain_points(edge, p))) p = cells_.around(edge).points;
      const int d = test(edges_[edge.block].second_diagonal[edge.axis], edge.sample);
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
      } else if (const CellBlocks::Edge other = cells_.other_end(around, i);
                 cells_.comes_first(edge, other)) {
        const std::uint32_t y = crossing_point(other);
        add(p, y);
        add(y, q);
      }
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
  void number_all(RunContext& context);
  /// Decides the form of an edge. `hit` is the offset of its crossing, in voxels.
  void decide(const CellBlocks::Edge& edge, double hit, const UniformPoints& points,
              const PlainPoints* near = nullptr);

  const CellBlocks& cells_;
  const TetrahedronCorners& corners_;
  const EdgeMasks* const only_;
  ByBlock<BlockEdges> edges_;
  ByBlock<BlockMask> held_, centred_;  ///< cells; not in `edges_`, as they are read across blocks meanwhile
  std::uint64_t points_ = 0, fanned_edges_ = 0, quads_ = 0, triangles_ = 0;
};

}  // namespace hermesh
