// The surfaces between the labels of a label map, as crossings of lattice edges.
//
// **Smoothing.** Samples know nothing of the surface but its side, so the crossing of an edge between two
// labels is in its middle, give or take half a voxel, and normals have to be estimated. The faces of voxels
// between the same two labels, seen along the edge's axis, are a *height field* over the columns of samples
// around the edge. A quadric is fitted to the heights of up to 7 x 7 columns (a plane would be offset where
// the surface is curved): its slopes at the edge give the normal, and its height there the crossing, which is
// clamped to the requested distance from the middle.
//
// A column belongs to the field if it continues the surface of a column nearer to the edge with a step of at
// most one voxel, as a digital plane of slope up to 1 does. So the field ends at the edges of a box and at
// junctions of three labels: faces along the axes stay flat to the last bit, their edges sharp, and volumes
// of boxes exact. Where the surface is steeper, the edge is one of few in a staircase along another axis:
// the crossing and the normal are those of the adjacent field along that axis, if it contains the step at the
// edge and has more columns. Clamping follows Gibson, *Constrained Elastic Surface Nets*, 1998.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/fracture/cutters.h"
#include "algorithms/hermite/hermite_view.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/labels/label_map.h"

namespace hermesh {

/// The crossings of all edges between samples of different labels. As cutters, it divides the solid of all
/// labels: the code of a sample is its label.
class LabelSurface : public Cutters {
 public:
  /// @param distance largest distance of a crossing from the middle of its edge, voxels, 0 to 1/2
  /// @throws Cancelled; Error for 2³² edges or more
  LabelSurface(const LabelMap& map, double distance, RunContext& context);

  /// Returns the solid of all labels: Hermite data with all labels inside.
  FloatHermite solid(RunContext& context) const;

  void codes(const At& lower, std::span<CutCode, 512> codes) const override;
  /// Returns the crossing of an edge between two labels, whichever pieces its samples belong to.
  std::optional<CutCrossing> crossing(const At& at, int axis, CutCode first, CutCode second) const override;
  /// Returns an end of an edge within one label whose sample belongs to the piece of another.
  std::optional<CutCrossing> nearest(const At& at, int axis, CutCode first, CutCode second) const override;
  std::size_t count() const override { return 0; }
  std::string name(std::size_t) const override { return {}; }
  std::optional<Eigen::Vector3d> plane_between(CutCode, CutCode) const override { return std::nullopt; }
  std::string name_of(CutCode code) const override { return "label " + std::to_string(code); }

 private:
  std::int32_t block_at(const At& lower) const;
  std::uint32_t label(std::int32_t block, int sample, int axis) const;
  void find_edges(std::vector<std::uint64_t>& counts, RunContext& context);
  void fill_block(std::size_t block, double distance);

  const LabelMap& map_;
  HermiteView::Blocks blocks_;  ///< those of the map and those below; `leaf` is the number in the map, or −1
  std::vector<std::uint32_t> first_;  ///< number of each block's first crossing
  LargeArray<EdgeCrossing> crossings_;
};

}  // namespace hermesh
