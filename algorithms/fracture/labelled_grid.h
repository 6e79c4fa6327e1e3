// The edges at which the pieces of a solid end, with the crossing on each: the input of the joint mesh.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

/// The pieces, or the outside, on the two sides of a crossing edge.
struct EdgeSides {
  std::uint32_t back;   ///< the piece behind the edge's polygons, whose boundary they are; at least 1
  std::uint32_t front;  ///< the piece that the polygons face; 0 for the outside
  std::int32_t
      cutter;  ///< −1 for the original surface, and where no cutter's surface passes between the samples
};

/// The lattice of a labelled solid. An edge is crossed if its ends have different labels. Crossings of the
/// original surface are those of the Hermite data. The crossing of a cut is that of the cutters' surface
/// between the codes of the two samples; if there is none, that between the codes of the two pieces. If that
/// is missing, too, because a label was repaired or a sliver merged, the crossing is *made up*, and counted:
/// it is the end of the edge nearer to the surface between the two pieces or, if the cutters cannot determine
/// that, the middle of the edge with a normal along it.
class LabelledGrid : public CellGrid {
 public:
  /// Marks the crossing edges in the solid's blocks, too. The solid has to outlive the grid, and its labels
  /// must not change as long as the grid is used. @throws Error for 2³² crossing edges or more; Cancelled.
  LabelledGrid(LabelledSolid& solid, const FloatHermite& hermite, const Cutters& cutters,
               RunContext& context);

  const HermiteView::Blocks& blocks() const override { return solid_.blocks; }
  const IndexToWorld& placement() const override { return solid_.placement; }
  EdgeCrossing crossing(std::int32_t block, int sample, int axis) const override;
  std::span<const std::array<BlockMask, 3>> cuts() const override { return cuts_; }
  std::span<const SheetsOfBlock> joint_sheets() const override { return joint_sheets_; }
  bool is_of_one_piece(std::int32_t block, int cell, int face) const override;
  std::array<std::uint32_t, 2> pieces(std::int32_t block, int sample, int axis) const override;

  /// Returns the two sides of a crossing edge, by its number in the order of blocks, axes and samples.
  const EdgeSides& sides(std::size_t edge) const { return sides_[edge]; }
  std::size_t edge_count() const { return sides_.size(); }
  std::uint64_t made_up() const { return made_up_; }  ///< how many crossings are made up
  /// Returns the edges with a made-up crossing, by block and axis.
  const ByBlock<std::array<BlockMask, 3>>& made_up_edges() const { return made_up_edges_; }
  std::size_t memory_bytes() const;

 private:
  std::size_t number_of(std::int32_t block, int sample, int axis) const;
  void find_edges(RunContext& context);
  std::uint64_t fill_block(std::size_t b, const FloatHermite& hermite, const Cutters& cutters);

  LabelledSolid& solid_;
  std::vector<std::array<BlockMask, 3>> cuts_;
  std::vector<SheetsOfBlock> joint_sheets_;
  std::vector<std::uint32_t> first_;  ///< number of each block's first crossing edge
  LargeArray<EdgeCrossing> crossings_;
  LargeArray<EdgeSides> sides_;
  std::uint64_t made_up_ = 0;
  ByBlock<std::array<BlockMask, 3>> made_up_edges_;
};

/// Fills in the `joined_faces` of a solid that is as whole_solid() makes it, still of one piece.
/// @throws Error as LabelledGrid does; Cancelled
void find_joined_faces(LabelledSolid& solid, const FloatHermite& hermite, const Cutters& cutters,
                       RunContext& context);

}  // namespace hermesh
