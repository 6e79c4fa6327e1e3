// The cells of a lattice by block, with their sheets, points and edges by number.
//
// The lattice is that of Hermite data, or one whose inside is divided among several pieces
// (algorithms/fracture/): then an edge is crossed, too, whose ends are both inside, but in different pieces.
// Such an edge is a *cut*. A cell without a cut is as in Hermite data: the inside bits of its corners tell
// its sheets. A cell with a cut is a *joint*. Most have one point, which all their crossing edges share, and
// no ambiguous face; for the others the lattice tells the sheets. Who makes such a lattice sees to it that
// the pieces become manifold (fracture/label_repair.h).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/extraction/embedded_mesh/by_block.h"
#include "algorithms/extraction/embedded_mesh/cell_sheets.h"
#include "algorithms/hermite/hermite_view.h"
#include "algorithms/lattice/active_cells.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// Cells of one block whose sheets are not those of kCellSheets, with their sheets; ascending by cell.
using SheetsOfBlock = std::vector<std::pair<std::uint16_t, CellSheets>>;

/// The lattice that cells are made from: blocks with the signs of their samples, crossings, and cuts if it
/// has any. The object and all that it gives out must outlive the CellBlocks made from it.
class CellGrid {
 public:
  virtual ~CellGrid() = default;
  /// The blocks, with the signs of all their samples.
  virtual const HermiteView::Blocks& blocks() const = 0;
  virtual const IndexToWorld& placement() const = 0;
  /// The crossing of an edge that is crossed; its offset is in voxels from the edge's first sample.
  virtual EdgeCrossing crossing(std::int32_t block, int sample, int axis) const = 0;
  /// All crossings of a block, by axis and then by sample. `out` has room for as many, 1536 at most.
  virtual void crossings(std::int32_t block, EdgeCrossing* out) const {
    blocks()[static_cast<std::size_t>(block)].for_each(
        [&](int axis, int sample) { *out++ = crossing(block, sample, axis); });
  }
  /// The crossing edges that are cuts, by block and axis; empty where the lattice has none.
  virtual std::span<const std::array<BlockMask, 3>> cuts() const { return {}; }
  /// The joints of each block that have several sheets or an ambiguous face; empty where the lattice has
  /// none.
  virtual std::span<const SheetsOfBlock> joint_sheets() const { return {}; }
  /// Whether the two inside corners of an ambiguous face, none of whose edges is a cut, are of one piece.
  /// Where they are not, each of them is cut off on the face, and they are never joined across it.
  virtual bool is_of_one_piece(std::int32_t /*block*/, int /*cell*/, int /*face*/) const { return true; }
  /// The pieces behind and in front of the polygons of an edge that is crossed; 0 is the outside.
  virtual std::array<std::uint32_t, 2> pieces(std::int32_t /*block*/, int /*sample*/, int /*axis*/) const {
    return {1, 0};
  }
};

/// Signs, sheets, points and edges of all active cells of a CellGrid. Lengths are in voxels, places in index
/// space relative to the placement's base. Constant once it is made, so any number of threads may read it.
class CellBlocks {
 public:
  /// What is known of the cells of one block. The points of its active cells' first sheets are numbered
  /// first, as ActiveCells tells, and then those of all further sheets.
  struct Block : ActiveCells {
    BlockMask joints;          ///< active cells with a cut
    BlockMask special;         ///< active cells that are joints, or have several sheets or an ambiguous face
    BlockMask joined;          ///< active cells with a face across which inside corners are joined; no joints
    std::uint32_t first_cell;  ///< number of the first active cell, see cell_number()

    BlockMask active_mask() const { return std::to_array(active); }
  };
  struct Edge {
    std::int32_t block;
    int sample, axis;
  };
  struct Cell {
    std::int32_t block;
    int cell;
  };
  /// The four cells around an edge, counter-clockwise for a viewer whom the edge's axis points at: the
  /// corners of a quad that faces along the axis. Where the edge's first sample is outside, the quad must be
  /// turned round.
  struct Around {
    std::array<Cell, 4> cells;
    std::array<std::uint32_t, 4> points;  ///< each cell's point for the sheet that the edge belongs to
    std::array<const CellSheets*, 4> sheets;
    int axis;
  };

  /// Finds the active cells of a lattice, decides how their ambiguous faces are drawn and numbers their
  /// points. `grid` must outlive this.
  /// @throws Error if margin() would exceed a quarter of a voxel, or if there are more cells or points than
  /// 32 bits can
  ///   number; Cancelled.
  CellBlocks(const CellGrid& grid, RunContext& context);

  /// How far points stay off the faces of their cells, and crossings off the ends of their edges, in voxels,
  /// so that rounding to the file's precision moves none across. The mean of a loop's crossings may come as
  /// near to a face as a third of the margin, and rounding moves a crossing aside from its edge, too; so the
  /// margin is eight times what rounding may do at the lattice's farthest corner, and at least 1/1024: along
  /// axes of the world, eight times what it does 2048 voxels from the meshes' origin (IndexToWorld::origin).
  double margin() const { return margin_; }
  /// How far rounding to the file's precision may move a point along each axis of the lattice, in voxels.
  const Eigen::Vector3d& rounding() const { return rounding_; }

  std::size_t size() const { return blocks_.size(); }
  const Block& operator[](std::int32_t block) const { return blocks_[block]; }
  const CellGrid& grid() const { return grid_; }
  const HermiteView::Block& source(std::int32_t block) const {
    return source_[static_cast<std::size_t>(block)];
  }
  std::size_t point_count() const { return points_; }
  std::size_t cell_count() const { return codes_.size(); }
  /// The number of an active cell, from 0, ascending by block and cell.
  std::uint32_t cell_number(std::int32_t block, int cell) const {
    return blocks_[block].first_cell + rank_of(blocks_[block], cell);
  }
  /// The inside bits of all cells of a block, a mask for each of the eight corners.
  std::array<BlockMask, 8> corner_signs(std::int32_t block) const;
  /// The inside bits of the eight corners of one active cell, a bit a corner. @param number cell_number() of
  /// the cell
  int corner_code(std::uint32_t number) const { return codes_[number]; }

  /// The sheets of an active cell. They follow from the inside bits of its corners and from how its ambiguous
  /// faces are drawn, but for joints of which the lattice tells them (CellGrid::joint_sheets()). For any
  /// other joint they follow from the inside bits alone and do not tell of its cuts, so that its segments
  /// hold on faces without a cut only. As its cell is simple (fracture/label_repair.h), it then has one sheet
  /// (or none, all corners being inside) and no ambiguous face, so that no face is explicit for its own sake.
  ///
  /// On an ambiguous face the corners of one kind are cut off one by one and those of the other kind are
  /// joined. The normals of its four crossings tell which is which, so that edges and thin walls of either
  /// kind stay whole; without normals, at joints, between two pieces and beside cells of which every other
  /// corner is inside it is the inside corners that are cut off. So each sheet of a cell without a cut bounds
  /// one piece. A face is *pinched* if, in both cells beside it, its two segments belong to one sheet: then
  /// four polygons would meet in the edge between the two cells' points. Such a face is drawn the other way,
  /// its inside corners joined instead of cut off or cut off instead of joined. That parts this sheet into
  /// two in each of the two cells, and closes a tunnel or opens a wall of less than a voxel.
  const CellSheets& sheets(std::int32_t block, int cell) const {
    if (const CellSheets* told = told_sheets(block, cell)) return *told;
    if (test(blocks_[block].joined, cell)) return find(joined_sheets_[block], cell);
    return kCellSheets[codes_[cell_number(block, cell)]];
  }
  bool is_joint(std::int32_t block, int cell) const { return test(blocks_[block].joints, cell); }
  /// Whether a face of an active cell is pinched, see sheets(). Only faces of joints can be: all others that
  /// were pinched have been drawn the other way.
  bool is_pinched(std::int32_t block, int cell, int face) const;
  /// How many points an active cell has: one for each sheet, and one for a joint whose sheets the lattice
  /// does not tell.
  int point_count(std::int32_t block, int cell) const {
    return is_joint(block, cell) ? joint_points(block, cell) : sheets(block, cell).sheets;
  }
  /// The number of the point of one of an active cell's sheets, from 0 to point_count(block, cell) − 1.
  std::uint32_t point(std::int32_t block, int cell, int sheet) const;
  /// How many active cells a block has.
  std::uint32_t cells_in(std::int32_t block) const {
    const auto next = static_cast<std::size_t>(block) + 1;
    const std::size_t end = next < blocks_.size() ? blocks_[next].first_cell : codes_.size();
    return static_cast<std::uint32_t>(end) - blocks_[block].first_cell;
  }
  /// How many points the cells of a block have.
  std::uint32_t points_in(std::int32_t block) const {
    const auto next = static_cast<std::size_t>(block) + 1;
    const std::size_t end = next < blocks_.size() ? blocks_[next].first_point : points_;
    return static_cast<std::uint32_t>(end) - blocks_[block].first_point;
  }
  /// The place of a sample, the first corner of the cell of the same index in the block; relative to the
  /// placement's base.
  Eigen::Vector3d corner(std::int32_t block, int sample) const;
  /// The cell at coordinates from −8 to 15 relative to the block's first sample; `block` is −1 where there is
  /// no block.
  Cell locate(std::int32_t block, int x, int y, int z) const {
    const LatticePlace there = hermesh::locate(source_[block].neighbours, x, y, z);
    return {there.block, there.sample};
  }
  /// Calls f(Cell) for the active cells at most `steps` cells, 8 or fewer, away from `cell` along each axis,
  /// that one included.
  template <class F>
  void for_each_about(const Cell& cell, int steps, F&& f) const {
    for (int x = -steps; x <= steps; ++x)
      for (int y = -steps; y <= steps; ++y)
        for (int z = -steps; z <= steps; ++z) {
          const Cell at =
              locate(cell.block, (cell.cell >> 6) + x, ((cell.cell >> 3) & 7) + y, (cell.cell & 7) + z);
          if (at.block >= 0 && test(blocks_[at.block].active, at.cell)) f(at);
        }
  }
  /// An edge of a cell, numbered as in cell_sheets.h; `block` is −1 where no block has the edge's first
  /// sample.
  Edge edge_of_cell(std::int32_t block, int cell, int edge) const;
  bool is_crossed(const Edge& edge) const {
    return edge.block >= 0 && test(source_[edge.block].crossing[edge.axis], edge.sample);
  }
  /// How many edges are crossed among `length`, 1 to 8, that follow one another end to end from `first` on
  /// along its axis. All must start in the block of `first`; where that is negative the answer is 0.
  int crossings_on(const Edge& first, int length) const;
  /// The place of a crossing, kept off the ends of its edge by margin(); relative to the placement's base.
  Eigen::Vector3d crossing_point(const Edge& edge) const {
    return crossing_point(edge, grid_.crossing(edge.block, edge.sample, edge.axis));
  }
  Eigen::Vector3d crossing_point(const Edge& edge, const EdgeCrossing& crossing) const;
  Around around(const Edge& edge) const;
  /// Cell i of the four around a crossing edge, in the order of around().
  Cell cell_around(const Edge& edge, int i) const {
    int at[3] = {edge.sample >> 6, (edge.sample >> 3) & 7, edge.sample & 7};
    at[(edge.axis + 1) % 3] += kAroundEdge[i][0];
    at[(edge.axis + 2) % 3] += kAroundEdge[i][1];
    return locate(edge.block, at[0], at[1], at[2]);
  }

  /// Sets `points` to the points of the four cells around an edge, in the order of around(). False if one of
  /// the cells is a joint, has several sheets or an ambiguous face; `points` is then half written.
  bool plain_points(const Edge& edge, std::array<std::uint32_t, 4>& points) const {
    for (int i = 0; i < 4; ++i) {
      const Cell cell = cell_around(edge, i);
      const Block& block = blocks_[cell.block];
      if (test(block.special, cell.cell)) return false;
      points[i] = block.first_point + rank_of(block, cell.cell);
    }
    return true;
  }
  /// Whether an active cell is no joint, has one sheet and no ambiguous face.
  bool is_plain(std::int32_t block, int cell) const { return !test(blocks_[block].special, cell); }

  /// Whether the surface can be held to the segments of the face between cells i and i + 1 around an edge.
  /// Whether it is held is EdgePolygons' answer.
  bool can_be_explicit(const Around& around, int i) const {
    return around.sheets[i]->sheets > 1 || around.sheets[(i + 1) % 4]->sheets > 1 ||
           ((around.sheets[i]->ambiguous_faces >> face_after(around.axis, i)) & 1);
  }
  /// The other end of the segment that starts at the edge in the face between cells i and i + 1 around it.
  /// The face must be without a cut, for where three pieces meet a face has no segments.
  Edge other_end(const Around& around, int i) const;
  /// Whether a face of the cell may be explicit. It is also true where a cell of several sheets lies beyond
  /// an uncrossed face.
  bool has_explicit_face(std::int32_t block, int cell) const;
  /// A strict order of edges by place and axis. It does not depend on how blocks are numbered, so that one of
  /// a segment's two ends speaks for both, whichever cell asks.
  bool comes_first(const Edge& a, const Edge& b) const;

  template <class F>
  void for_each_crossing_edge(std::int32_t block, F&& f) const {
    source_[block].for_each([&](int axis, int sample) { f(Edge{block, sample, axis}); });
  }

 private:
  /// The face of cell i that leads to cell i + 1.
  static constexpr int face_after(int axis, int i) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    return i == 0 ? 2 * u + 1 : i == 1 ? 2 * v + 1 : i == 2 ? 2 * u : 2 * v;
  }
  static constexpr int edge_in(int axis, int i) {
    return 4 * axis - kAroundEdge[i][0] - 2 * kAroundEdge[i][1];
  }

  const CellSheets* told_sheets(std::int32_t block, int cell) const {
    return is_joint(block, cell) && !told_.empty() ? find_told(block, cell) : nullptr;
  }
  const CellSheets* find_told(std::int32_t block, int cell) const;
  static const CellSheets& find(const SheetsOfBlock& list, int cell);
  Cell beside(std::int32_t block, int cell, int face) const;
  void draw_ambiguous_faces(RunContext& context);
  bool normals_join(std::int32_t block, int cell, int face) const;
  int joint_points(std::int32_t block, int cell) const {
    const CellSheets* told = told_sheets(block, cell);
    return told ? told->sheets : 1;
  }
  BlockMask cells_with_cuts(std::int32_t block) const;

  static constexpr double kLargestMargin = 0.25;
  Eigen::Vector3d rounding_in_file() const;
  double margin_for_rounding() const;

  const CellGrid& grid_;
  const HermiteView::Blocks& source_;  ///< the blocks of `grid_`
  const Eigen::Vector3d rounding_;
  const double margin_;
  const std::span<const std::array<BlockMask, 3>> cuts_;
  const std::span<const SheetsOfBlock> told_;
  LargeArray<Block> blocks_;
  ByBlock<SheetsOfBlock> joined_sheets_;  ///< sheets of the cells that are `joined`
  /// Cells with several sheets, ascending, each with how many further points the cells before it in the block
  /// have.
  ByBlock<std::vector<std::pair<std::uint16_t, std::uint16_t>>> several_;
  std::vector<std::uint8_t> codes_;  ///< signs of the corners of each active cell
  std::size_t points_ = 0;
};

}  // namespace hermesh
