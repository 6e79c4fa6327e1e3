// The edges at which the pieces of a solid end, with the crossing on each: what the joint mesh is made from.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/fracture/labelled_solid.h"

namespace hermesh {

/// What lies on the two sides of a crossing edge.
struct EdgeSides {
  std::uint32_t back;   ///< the piece on the side that the edge's polygons are the boundary of; at least 1
  std::uint32_t front;  ///< the piece on the other side, which they face; 0 for the outside
  std::int32_t
      cutter;  ///< −1 for the original surface, and where no cutter's surface passes between the samples
};

/// An edge is crossed if its ends have different labels. The original surface's crossings are those of the
/// Hermite data. A cut's is the cutters' between the codes of the two samples; if there is none, that between
/// the codes of the two pieces. If there is none either, for a label was repaired or a sliver merged, it is
/// *made up*, and counted: the end of the edge that the surface between the two pieces is nearer to, or, if
/// the cutters cannot tell, the middle of the edge with a normal along it.
class LabelledGrid : public CellGrid {
 public:
  /// The solid has to outlive the grid. @throws Error for 2³² crossing edges or more; Cancelled.
  LabelledGrid(LabelledSolid& solid, const FloatHermite& hermite, const Cutters& cutters,
               RunContext& context);

  const HermiteView::Blocks& blocks() const override { return solid_.blocks; }
  const IndexToWorld& placement() const override { return solid_.placement; }
  EdgeCrossing crossing(std::int32_t block, int sample, int axis) const override;
  std::span<const std::array<BlockMask, 3>> cuts() const override { return cuts_; }
  std::span<const SheetsOfBlock> joint_sheets() const override { return joint_sheets_; }
  bool is_of_one_piece(std::int32_t block, int cell, int face) const override;

  /// By the number of the crossing edge: by block, axis and sample.
  const EdgeSides& sides(std::size_t edge) const { return sides_[edge]; }
  std::size_t edge_count() const { return sides_.size(); }
  std::uint64_t made_up() const { return made_up_; }  ///< crossings
  std::size_t memory_bytes() const;

 private:
  void find_edges(RunContext& context);
  std::uint64_t fill_block(std::size_t b, const FloatHermite& hermite, const Cutters& cutters);

  LabelledSolid& solid_;
  std::vector<std::array<BlockMask, 3>> cuts_;
  std::vector<SheetsOfBlock> joint_sheets_;
  std::vector<std::uint32_t> first_;  ///< by block its first crossing edge
  LargeArray<EdgeCrossing> crossings_;
  LargeArray<EdgeSides> sides_;
  std::uint64_t made_up_ = 0;
};

/// Fills in the solid's `joined_faces`. @param solid as whole_solid() makes it @throws as LabelledGrid does
void find_joined_faces(LabelledSolid& solid, const FloatHermite& hermite, const Cutters& cutters,
                       RunContext& context);

}  // namespace hermesh
