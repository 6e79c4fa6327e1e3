// Cubes whose polygons do not keep the promises are split, until all that are left do.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/certified_octree/region_polygon.h"
#include "algorithms/extraction/certified_octree/region_shell.h"
#include "algorithms/extraction/certified_octree/region_slabs.h"
#include "algorithms/extraction/certified_octree/cell_regions.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

namespace hermesh {

/// Of a merged mesh T beside the uniform mesh S, whose cells' points lie within their cells.
///
/// **Topology.** Needs no proof here. The cells of a cube are a disc of S, which T shrinks to a point. That
/// keeps the surface as it is if any two regions beside one another have one piece of border in common, and
/// each edge between regions, crossed, one polygon. So it is, for the common part of two regions' faces is
/// all of the smaller one's, the common part of several regions' edges all of the smallest one's, and a
/// cube's border is simple (region_proposals.h), and so is that of a cell without ambiguous faces. Then each
/// edge of T has two polygons, and as the border of a disc is one circle, so are the polygons around its
/// point.
///
/// **No two polygons of T meet.** A region's point lies within its cube, so it sees each point of the cube's
/// faces once. The common part of two regions' faces is cut into triangles from where the segment between the
/// regions' points passes through it to the edges of its border. Each of these triangles makes two tetrahedra
/// with the regions' points. Those of one edge are its envelope; envelopes lie side by side, and a polygon
/// that is not loose stays within its own (region_polygon.h, after Ju & Udeshi 2006). Polygons of cells of
/// several sheets, or with ambiguous faces, are those of S, and too far from every cube to meet one of these
/// (kAway in region_proposals.cpp). Loose polygons may reach farther, and have one diagonal in common; they
/// are tested against all others (loose_polygons.h), but for those around a cube's point of which one look
/// tells (polygon_stars.h).
///
/// **Distance.** Of tolerances that are small, see region_shell.h, for which all of S must be there; of large
/// ones region_slabs.h. Beyond the largest cubes' diagonal nothing is left to be shown: S passes through each
/// edge that has a polygon of T, whose corners are in regions at that edge; and each point of S is in a
/// region whose point T has.
class RegionProof {
 public:
  /// Times the side of the largest cubes: their diagonal, rounded up.
  static constexpr float kDiagonal = 1.7321f;

  /// For tolerances beyond the largest cubes' diagonal. @param uniform makes the points of cells that are
  /// alone
  RegionProof(CellRegions& regions, UniformCells& uniform, RunContext& context);
  /// With slabs, and such points.
  RegionProof(CellRegions& regions, RegionSlabs& slabs, UniformCells& uniform, RunContext& context);
  /// With a shell. All points that the uniform mesh has in cells have been made.
  RegionProof(CellRegions& regions, const RegionShell& shell, RunContext& context);

  /// Splits until all polygons keep the promises, but for whether loose ones meet others. Then all points are
  /// there.
  /// @returns how many cubes were split
  /// @throws Cancelled
  std::size_t run();

  /// By block the samples whose edges may have other polygons than when this was asked last.
  LargeArray<BlockMask> take_changed();

  /// The largest cube around the edge is to be split when run() is called again.
  void call_bold(const CellBlocks::Edge& edge);

 private:
  RegionProof(CellRegions& regions, RegionSlabs* slabs, const RegionShell* shell, UniformCells* uniform,
              RunContext& context);

  void place_lone_points();
  void begin_slabs();
  void look_at_polygons();
  void look_at_polygons(std::size_t block);
  void look_at_slabs();
  std::size_t split();

  void call_bold(const Region& region);
  bool is_bold(const Region& region);
  template <class F>
  void for_each_touched(std::size_t block, F&& f) const;

  CellRegions& regions_;
  const CellBlocks& cells_;
  RegionSlabs* const slabs_;        ///< either these
  const RegionShell* const shell_;  ///< or this, or neither;
  UniformCells* const uniform_;     ///< null with the second, which wants all points beforehand
  RunContext& context_;
  std::vector<std::array<std::uint64_t, CellRegions::kLevels>>
      bold_;                            ///< by block and level, less 1: cubes to be split
  std::vector<std::uint8_t> any_bold_;  ///< by block
  LargeArray<BlockMask> changed_;       ///< by block: stirred since take_changed()
  // Cells by block:
  LargeArray<BlockMask> fresh_;     ///< of cubes that were split (all at the beginning),
  LargeArray<BlockMask> stirred_;   ///< or next to one
  bool is_fresh_ = true;            ///< nothing was looked at yet
  std::vector<std::array<BlockMask, 3>>
      open_;  ///< by block and axis: edges whose polygons are not shown; with a shell
  std::vector<std::array<BlockMask, 3>> loose_;  ///< by block and axis: edges of loose polygons; with slabs
  std::array<std::vector<std::uint32_t>, 8> turns_;  ///< blocks, by the parity of where they are; with slabs or a shell
  tbb::enumerable_thread_specific<std::vector<Region>> split_;
};

}  // namespace hermesh
