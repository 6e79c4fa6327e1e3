// Hermite data of any representation as extraction reads them: blocks with their neighbours, and a crossing
// for each crossing edge.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/lattice/crossing_edges.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// Hermite data as blocks: one for every cell with a crossing edge and for every owner of one. The view
/// refers to its data, which must outlive it.
class HermiteView {
 public:
  struct Block : CrossingEdges {
    std::array<std::int32_t, 3> lower;  ///< index coordinates of the first sample
    std::int32_t leaf;                  ///< number among the leaves that own crossings; −1 for none
    BlockMask inside;                   ///< valid also without a leaf: then all samples are of one sign
    /// Numbers of the blocks around, by neighbour_slot(); −1 for none.
    std::array<std::int32_t, 27> neighbours;
  };

  using Blocks = LargeArray<Block>;  ///< members of a new block are undefined until they are written

  virtual ~HermiteView() = default;
  const Blocks& blocks() const { return blocks_; }
  const IndexToWorld& placement() const { return placement_; }

  /// Returns the crossing of an edge, which must be crossed.
  virtual EdgeCrossing crossing(std::int32_t block, int sample, int axis) const = 0;
  /// Writes all crossings of a block, in the order of CrossingEdges::rank(), to `out`, which has room for at
  /// most 1536.
  virtual void crossings(std::int32_t block, EdgeCrossing* out) const = 0;

 protected:
  /// Makes the blocks of `leaves`, which are in ascending order and all own a crossing edge. @throws
  /// Cancelled.
  HermiteView(std::span<const SignLeaf> leaves, const IndexToWorld& placement, RunContext& context);

 private:
  IndexToWorld placement_;
  Blocks blocks_;
};

/// Returns the directions of the lower blocks that hold a cell with one of a leaf's edges, given by axis and
/// first sample: bit `down` = |dx| + 2|dy| + 4|dz|. The cells around an edge begin at its own sample and one
/// step down each axis that is not the edge's, so at most two axes are involved.
unsigned blocks_below(const std::array<BlockMask, 3>& edges);
/// Returns the first sample of the block in such a direction.
std::array<std::int32_t, 3> block_below(const std::array<std::int32_t, 3>& lower, int down);

/// Sets `neighbours` of blocks in ascending order of (x, y, z).
void find_neighbours(HermiteView::Blocks& blocks, RunContext& context);

/// Returns the cells of a block that have an edge of a mask, by their first corners. `edges(block)` returns
/// the masks of an existing block, by axis.
template <class Edges>
BlockMask cells_with_edges(const HermiteView::Blocks& blocks, std::size_t block, Edges&& edges);
/// Returns the cells of a block with a crossing edge, by their first corners.
BlockMask cells_with_crossings(const HermiteView::Blocks& blocks, std::size_t block);

/// The four cells around an edge as steps along the two axes after its own, counter-clockwise if the edge's
/// axis points at the viewer.
inline constexpr int kAroundEdge[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};

/// The cells around the edges along one axis that start in a block, whose neighbours are looked up once in
/// the constructor.
class CellsAroundEdges {
 public:
  CellsAroundEdges(const HermiteView::Blocks& blocks, std::size_t block, int axis)
      : u_(kStep[(axis + 1) % 3]), v_(kStep[(axis + 2) % 3]) {
    for (int side = 0; side < 4; ++side) {
      int d[3] = {0, 0, 0};
      d[(axis + 1) % 3] = -(side & 1);
      d[(axis + 2) % 3] = -(side >> 1);
      block_[side] = blocks[block].neighbours[neighbour_slot(d[0], d[1], d[2])];
      // Coordinate −1 is 7 in the neighbour.
      shift_[side] = 8 * ((side & 1) * u_ + (side >> 1) * v_);
    }
  }

  /// Returns the cells around the edge that starts at a sample, in the order of kAroundEdge. Around a
  /// crossing edge each has a block.
  std::array<LatticePlace, 4> operator()(int sample) const {
    // A cell below in u or v is in the neighbour where the sample's own coordinate is 0.
    const int low_u = (sample & (7 * u_)) == 0, low_v = (sample & (7 * v_)) == 0 ? 2 : 0;
    const auto cell = [&](int side, int down) {
      return LatticePlace{block_[side], sample - down + shift_[side]};
    };
    return {cell(low_u + low_v, u_ + v_), cell(low_v, v_), cell(0, 0), cell(low_u, u_)};
  }

 private:
  static constexpr int kStep[3] = {64, 8, 1};
  const int u_, v_;
  std::int32_t block_[4];
  int shift_[4];
};

template <class Edges>
BlockMask cells_with_edges(const HermiteView::Blocks& blocks, std::size_t block, Edges&& edges) {
  static constexpr BlockMask kNone{};
  BlockMask result{};
  for (int axis = 0; axis < 3; ++axis)
    for (const auto& [u, v] : kAroundEdge) {
      // The four edges of a cell along an axis start at its corners of the face across that axis: shifted
      // masks of edges.
      int d[3] = {0, 0, 0};
      d[(axis + 1) % 3] = -u;
      d[(axis + 2) % 3] = -v;
      const BlockMask shifted =
          shifted_mask(d[0], d[1], d[2], [&](int ax, int ay, int az) -> const BlockMask& {
            const std::int32_t there = blocks[block].neighbours[neighbour_slot(ax, ay, az)];
            return there >= 0 ? edges(there)[axis] : kNone;
          });
      for (int word = 0; word < 8; ++word) result[word] |= shifted[word];
    }
  return result;
}

/// Loops over the edges of a block for dual contouring. Calls f(axis, sample, cells) for each crossing edge,
/// in the order of CrossingEdges::rank(); `cells` are the four around it, in the order of kAroundEdge.
template <class F>
void for_each_edge_with_cells(const HermiteView::Blocks& blocks, std::size_t block, F&& f) {
  if (blocks[block].crossing_count() == 0) return;  // most blocks that exist only for their cells
  const CellsAroundEdges around[3] = {{blocks, block, 0}, {blocks, block, 1}, {blocks, block, 2}};
  blocks[block].for_each([&](int axis, int sample) { f(axis, sample, around[axis](sample)); });
}

/// View of sparse data. `Read` turns a crossing of the data into an EdgeCrossing.
template <class Crossing, class Read>
class SparseView : public HermiteView {
 public:
  SparseView(const SparseHermite<Crossing>& hermite, Read read, RunContext& context)
      : HermiteView(hermite.leaves, hermite.placement, context), hermite_(hermite), read_(read) {}

  EdgeCrossing crossing(std::int32_t number, int sample, int axis) const override {
    const Block& block = blocks()[number];
    return read_(hermite_.crossings[hermite_.leaves[block.leaf].first + block.rank(axis, sample)]);
  }
  void crossings(std::int32_t number, EdgeCrossing* out) const override {
    const Block& block = blocks()[number];
    if (block.leaf < 0) return;
    const Crossing* first = hermite_.crossings.data() + hermite_.leaves[block.leaf].first;
    std::transform(first, first + block.crossing_count(), out, read_);
  }

 private:
  const SparseHermite<Crossing>& hermite_;
  const Read read_;
};

inline auto view_of(const FloatHermite& hermite, RunContext& context) {
  constexpr auto read = [](const EdgeCrossing& crossing) { return crossing; };
  return SparseView<EdgeCrossing, decltype(read)>(hermite, read, context);
}
template <NormalCode Code>
auto view_of(const PackedHermite& hermite, Code, RunContext& context) {
  constexpr auto read = [](PackedCrossing crossing) { return unpack<Code>(crossing); };
  return SparseView<PackedCrossing, decltype(read)>(hermite, read, context);
}

}  // namespace hermesh
