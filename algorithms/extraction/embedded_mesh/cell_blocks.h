// The active cells of a lattice by block, with their sheets, vertices and edges.
//
// The lattice is that of Hermite data, or one whose inside is divided into several pieces
// (algorithms/fracture/). In the latter, edges whose ends are both inside, but in different pieces, also
// count as crossed; such an edge is a *cut*. A cell without a cut is as in Hermite data: the inside bits of
// its corners determine its sheets. A cell with a cut is a junction cell, or *joint*. Most joints have one
// vertex, shared by all their crossed edges, and no ambiguous face; the lattice specifies the sheets of the
// others. The code that creates such a lattice ensures that the pieces become manifold
// (fracture/label_repair.h).
#pragma once

#include <Eigen/Core>
#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/extraction/embedded_mesh/cell_sheets.h"
#include "algorithms/hermite/hermite_view.h"
#include "algorithms/lattice/active_cells.h"
#include "algorithms/lattice/part_placement.h"

namespace hermesh {

/// Values of type T for the few blocks of a lattice that have one; any other block reads as an empty value
/// and takes no memory. Threads may write different blocks concurrently, but not while another thread reads
/// them.
template <class T>
class ByBlock {
 public:
  explicit ByBlock(std::size_t blocks) : made_(blocks) {}
  std::size_t size() const { return made_.size(); }
  bool has(std::size_t block) const { return made_[block] != nullptr; }
  const T& operator[](std::size_t block) const { return made_[block] ? *made_[block] : kEmpty; }
  /// Returns the value of a block for writing; creates an empty one if there is none.
  T& at(std::size_t block) {
    if (!made_[block]) made_[block] = std::make_unique<T>();
    return *made_[block];
  }
  void clear(std::size_t block) { made_[block].reset(); }

 private:
  inline static const T kEmpty{};
  std::vector<std::unique_ptr<T>> made_;
};

inline void set_bit(BlockMask& mask, int sample, bool value = true) {
  const std::uint64_t bit = std::uint64_t{1} << (sample & 63);
  mask[sample >> 6] = value ? mask[sample >> 6] | bit : mask[sample >> 6] & ~bit;
}

/// The cells of a block whose sheets differ from kCellSheets, with their sheets; ascending by cell.
using SheetsOfBlock = std::vector<std::pair<std::uint16_t, CellSheets>>;

/// The lattice that cells are made from. The object and everything it returns must outlive the CellBlocks.
class CellGrid {
 public:
  virtual ~CellGrid() = default;
  /// Returns the blocks, with the signs of all their samples.
  virtual const HermiteView::Blocks& blocks() const = 0;
  virtual const IndexToWorld& placement() const = 0;
  /// Returns the crossing of a crossed edge; its offset is in voxels from the edge's first sample.
  virtual EdgeCrossing crossing(std::int32_t block, int sample, int axis) const = 0;
  /// Writes all crossings of a block, by axis and then by sample: at most 1536.
  virtual void crossings(std::int32_t block, EdgeCrossing* out) const {
    blocks()[block].for_each([&](int axis, int sample) { *out++ = crossing(block, sample, axis); });
  }
  /// Returns the crossed edges that are cuts, by block and axis; empty if the lattice has none.
  virtual std::span<const std::array<BlockMask, 3>> cuts() const { return {}; }
  /// Returns the joints of each block that have several sheets or an ambiguous face; empty if the lattice has
  /// none.
  virtual std::span<const SheetsOfBlock> joint_sheets() const { return {}; }
  /// Returns true if the two inside corners of an ambiguous face without a cut belong to one piece. If not,
  /// they are cut off one by one and never joined across the face.
  virtual bool is_of_one_piece(std::int32_t /*block*/, int /*cell*/, int /*face*/) const { return true; }
  /// Returns the pieces behind and in front of the polygons of a crossed edge; 0 is the outside.
  virtual std::array<std::uint32_t, 2> pieces(std::int32_t /*block*/, int /*sample*/, int /*axis*/) const {
    return {1, 0};
  }
  /// Returns false for a block, given by the index coordinates of its first sample, whose cells lack data,
  /// because the lattice is part of a larger one. They are inactive.
  virtual bool is_complete(const std::array<std::int32_t, 3>& /*lower*/) const { return true; }
  /// Returns a box that contains the blocks of the lattice that this one is part of; empty if it is whole.
  virtual SampleBox whole() const { return {}; }
};

/// Signs, sheets, vertices and edges of all active cells of a CellGrid. Lengths are in voxels, positions in
/// index space relative to the placement's base. Immutable, so any number of threads may read it.
class CellBlocks {
 public:
  /// The cells of one block. The vertices of the active cells' first sheets are numbered first, as
  /// ActiveCells specifies, followed by those of all further sheets.
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
    bool operator==(const Edge&) const = default;
  };
  struct Cell {
    std::int32_t block;
    int cell;
    bool operator==(const Cell&) const = default;
    auto operator<=>(const Cell&) const = default;
  };
  /// The four cells around an edge, counter-clockwise seen from the positive end of the edge's axis: the
  /// corners of a quad that faces along the axis. If the edge's first sample is outside, the quad must be
  /// reversed.
  struct Around {
    std::array<Cell, 4> cells;
    std::array<std::uint32_t, 4> points;  ///< each cell's vertex for the sheet that the edge belongs to
    std::array<const CellSheets*, 4> sheets;
    int axis;
  };

  /// Finds the active cells of a lattice, decides how ambiguous faces are drawn, and numbers the vertices.
  /// @param grid must outlive this
  /// @param context receives the progress and the request to cancel
  /// @throws Error if margin() would exceed a quarter of a voxel, or for more than 2³² cells or vertices;
  /// Cancelled
  CellBlocks(const CellGrid& grid, RunContext& context);

  /// Returns the least distance in voxels of vertices from the faces of their cells, and of crossings from
  /// the ends of their edges, which ensures that rounding to the file's precision moves none across. The mean
  /// of a loop's crossings may be as close to a face as a third of the margin, and rounding also moves a
  /// crossing off its edge. The margin is therefore eight times the rounding at the lattice's farthest
  /// corner, and at least 1/1024: along axes of the world, eight times the rounding at 2048 voxels from the
  /// meshes' origin (IndexToWorld::origin). Only vertices with a target may be nearer (TetrahedronCorners).
  double margin() const { return margin_; }
  /// Returns the largest rounding error of a vertex in the file along each axis of the lattice, in voxels.
  const Eigen::Vector3d& rounding() const { return rounding_; }

  std::size_t size() const { return blocks_.size(); }
  const Block& operator[](std::int32_t block) const { return blocks_[block]; }
  const CellGrid& grid() const { return grid_; }
  const HermiteView::Block& source(std::int32_t block) const { return source_[block]; }
  std::size_t point_count() const { return points_; }
  std::size_t cell_count() const { return codes_.size(); }
  /// Returns the number of an active cell, from 0, ascending by block and cell.
  std::uint32_t cell_number(std::int32_t block, int cell) const {
    return blocks_[block].first_cell + rank_of(blocks_[block], cell);
  }
  /// Returns the inside bits of all cells of a block, one mask per corner.
  std::array<BlockMask, 8> corner_signs(std::int32_t block) const;
  /// Returns the inside bits of the corners of the active cell with this cell_number().
  int corner_code(std::uint32_t number) const { return codes_[number]; }

  /// Returns the sheets of an active cell. They follow from the inside bits of its corners and the drawing of
  /// its ambiguous faces, except for joints listed in CellGrid::joint_sheets(). For any other joint they
  /// follow from the inside bits only and ignore its cuts, so its segments are valid only on faces without a
  /// cut. As its cell is simple (fracture/label_repair.h), it has one sheet (or none, if all corners are
  /// inside) and no ambiguous face, so none of its faces is explicit because of it.
  ///
  /// On an ambiguous face the corners of one sign are cut off and those of the other sign joined. The normals
  /// of its four crossings decide which, so that edges and thin walls of either sign stay connected. Without
  /// normals, at joints, between two pieces and next to cells with alternating corners, the inside corners
  /// are cut off. Each sheet of a cell without a cut thus bounds one piece. A face is *pinched* if its two
  /// segments belong to one sheet in both cells at the face: four polygons would then share the edge between
  /// the two cells' vertices. A pinched face is drawn the other way. This splits the sheet in two in each of
  /// the cells, and closes a tunnel or opens a wall thinner than a voxel.
  const CellSheets& sheets(std::int32_t block, int cell) const {
    if (const CellSheets* given = given_sheets(block, cell)) return *given;
    if (test(blocks_[block].joined, cell)) return *find(joined_sheets_[block], cell);
    return kCellSheets[codes_[cell_number(block, cell)]];
  }
  bool is_joint(std::int32_t block, int cell) const { return test(blocks_[block].joints, cell); }
  /// Returns true if a face of an active cell is pinched, see sheets(). This remains possible only for
  /// joints.
  bool is_pinched(std::int32_t block, int cell, int face) const;
  /// Returns the number of vertices of an active cell: one per sheet, and one for a joint without given
  /// sheets.
  int point_count(std::int32_t block, int cell) const {
    if (!is_joint(block, cell)) return sheets(block, cell).sheets;
    const CellSheets* given = given_sheets(block, cell);
    return given ? given->sheets : 1;
  }
  /// Returns the number of the vertex of a sheet of an active cell; `sheet` < point_count(block, cell).
  std::uint32_t point(std::int32_t block, int cell, int sheet) const;
  /// Returns the number of active cells of a block.
  std::uint32_t cells_in(std::int32_t block) const {
    const std::size_t next = block + 1, end = next < size() ? blocks_[next].first_cell : codes_.size();
    return static_cast<std::uint32_t>(end) - blocks_[block].first_cell;
  }
  /// Returns the number of vertices of a block's cells.
  std::uint32_t points_in(std::int32_t block) const {
    const std::size_t next = block + 1, end = next < size() ? blocks_[next].first_point : points_;
    return static_cast<std::uint32_t>(end) - blocks_[block].first_point;
  }
  /// Returns the position of a sample, which is the first corner of the cell of the same index.
  Eigen::Vector3d corner(std::int32_t block, int sample) const;
  /// Returns the cell at coordinates from −8 to 15 relative to the block's first sample; its `block` is −1 if
  /// no block contains it.
  Cell locate(std::int32_t block, int x, int y, int z) const {
    const LatticePlace there = hermesh::locate(source_[block].neighbours, x, y, z);
    return {there.block, there.sample};
  }
  /// Calls f(Cell) for the active cells at most `steps` (up to 8) cells from `cell` along each axis, and
  /// itself.
  template <class F>
  void for_each_about(const Cell& cell, int steps, F&& f) const {
    const int x = cell.cell >> 6, y = (cell.cell >> 3) & 7, z = cell.cell & 7;
    for (int dx = -steps; dx <= steps; ++dx)
      for (int dy = -steps; dy <= steps; ++dy)
        for (int dz = -steps; dz <= steps; ++dz)
          if (const Cell at = locate(cell.block, x + dx, y + dy, z + dz); is_active(at)) f(at);
  }
  /// Returns true if a cell that locate() or cell_around() returned exists and is active.
  bool is_active(const Cell& cell) const {
    return cell.block >= 0 && test(blocks_[cell.block].active, cell.cell);
  }
  /// Returns an edge of a cell, numbered as in cell_sheets.h; its `block` is −1 if no block has its first
  /// sample.
  Edge edge_of_cell(std::int32_t block, int cell, int edge) const;
  bool is_crossed(const Edge& edge) const {
    return edge.block >= 0 && test(source_[edge.block].crossing[edge.axis], edge.sample);
  }
  /// Calls f(Edge) for the crossed edges of an active cell, by their numbers.
  template <class F>
  void for_each_crossed_edge_of(const Cell& cell, F&& f) const {
    for (int edge = 0; edge < 12; ++edge)
      if (const Edge at = edge_of_cell(cell.block, cell.cell, edge); is_crossed(at)) f(at);
  }
  /// Returns how many of `length` (1 to 8) consecutive edges, from `first` on along its axis, are crossed.
  /// All must start in the block of `first`; if that is negative, the result is 0.
  int crossings_on(const Edge& first, int length) const;
  /// Returns the position of a crossing, at least margin() from the ends of its edge.
  Eigen::Vector3d crossing_point(const Edge& edge) const {
    return crossing_point(edge, grid_.crossing(edge.block, edge.sample, edge.axis));
  }
  Eigen::Vector3d crossing_point(const Edge& edge, const EdgeCrossing& crossing) const;
  Around around(const Edge& edge) const;
  /// Returns cell i of the four around a crossed edge, in the order of around().
  Cell cell_around(const Edge& edge, int i) const {
    int at[3] = {edge.sample >> 6, (edge.sample >> 3) & 7, edge.sample & 7};
    at[(edge.axis + 1) % 3] += kAroundEdge[i][0];
    at[(edge.axis + 2) % 3] += kAroundEdge[i][1];
    return locate(edge.block, at[0], at[1], at[2]);
  }

  /// Sets `points` to the vertices of the four cells around an edge, in the order of around(). Returns false
  /// if one of the cells is not plain; `points` is then incomplete.
  bool plain_points(const Edge& edge, std::array<std::uint32_t, 4>& points) const {
    for (int i = 0; i < 4; ++i) {
      const Cell cell = cell_around(edge, i);
      if (!is_plain(cell.block, cell.cell)) return false;
      points[i] = blocks_[cell.block].first_point + rank_of(blocks_[cell.block], cell.cell);
    }
    return true;
  }
  /// Returns true if an active cell is not a joint, has one sheet and no ambiguous face.
  bool is_plain(std::int32_t block, int cell) const { return !test(blocks_[block].special, cell); }

  /// Returns true if the surface can be constrained to the segments of the face between cells i and i + 1
  /// around an edge. EdgePolygons determines whether it is.
  bool can_be_explicit(const Around& around, int i) const {
    return around.sheets[i]->sheets > 1 || around.sheets[(i + 1) % 4]->sheets > 1 ||
           ((around.sheets[i]->ambiguous_faces >> face_after(around.axis, i)) & 1);
  }
  /// Returns the other end of the segment that starts at the edge in the face between cells i and i + 1
  /// around it. The face must have no cut, because a face where three pieces meet has no segments.
  Edge other_end(const Around& around, int i) const;
  /// Returns true if a face of the cell may be explicit, including uncrossed faces next to a cell of several
  /// sheets.
  bool has_explicit_face(std::int32_t block, int cell) const;
  /// Returns true if edge a precedes b by coordinates and axis: a strict order independent of the numbering
  /// of blocks.
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

  /// Returns the sheets that the lattice specifies for a joint, or null.
  const CellSheets* given_sheets(std::int32_t block, int cell) const {
    return is_joint(block, cell) && !given_.empty() ? find(given_[block], cell) : nullptr;
  }
  static const CellSheets* find(const SheetsOfBlock& list, int cell);
  Cell beside(std::int32_t block, int cell, int face) const;
  void draw_ambiguous_faces(RunContext& context);
  bool normals_join(std::int32_t block, int cell, int face) const;
  BlockMask cells_with_cuts(std::int32_t block) const;
  Eigen::Vector3d rounding_in_file() const;
  double margin_for_rounding() const;

  const CellGrid& grid_;
  const HermiteView::Blocks& source_;  ///< the blocks of `grid_`
  const Eigen::Vector3d rounding_;
  const double margin_;
  const std::span<const std::array<BlockMask, 3>> cuts_;
  const std::span<const SheetsOfBlock> given_;
  LargeArray<Block> blocks_;
  ByBlock<SheetsOfBlock> joined_sheets_;  ///< sheets of the cells that are `joined`
  /// The cells with several sheets, ascending, each with the number of further vertices of the block's cells
  /// before it.
  ByBlock<std::vector<std::pair<std::uint16_t, std::uint16_t>>> several_;
  std::vector<std::uint8_t> codes_;  ///< signs of the corners of each active cell
  std::size_t points_ = 0;
};

}  // namespace hermesh
