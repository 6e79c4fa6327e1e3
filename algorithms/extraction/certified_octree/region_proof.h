// Cubes whose polygons do not keep the promises are split, until all that are left do.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_octree/cell_regions.h"
#include "algorithms/extraction/certified_octree/region_polygon.h"
#include "algorithms/extraction/certified_octree/region_shell.h"
#include "algorithms/extraction/certified_octree/region_slabs.h"
#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

namespace hermesh {

/// Proves a merged mesh T beside the uniform mesh S, whose cells' points lie within their cells.
///
/// **Topology** needs no test here. The cells of a cube are a disc of S, which T shrinks to a point. That
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
/// **Distance.** For small tolerances see region_shell.h, for which all of S must be there; for large ones
/// region_slabs.h. Beyond the largest cubes' diagonal nothing is left to be shown: S passes through each
/// edge that has a polygon of T, whose corners are in regions at that edge; and each point of S is in a
/// region whose point T has.
class RegionProof {
 public:
  /// The diagonal of a cube, in sides of it, rounded up.
  static constexpr float kDiagonal = 1.7321f;

  /// The proof for tolerances beyond the largest cubes' diagonal. `uniform` makes the points of cells that
  /// are alone. All arguments must outlive this.
  RegionProof(CellRegions& regions, UniformCells& uniform, RunContext& context);
  /// The proof with slabs. `uniform` makes the points of cells that are alone.
  RegionProof(CellRegions& regions, RegionSlabs& slabs, UniformCells& uniform, RunContext& context);
  /// The proof with a shell. All points that the uniform mesh has in cells must have been made.
  RegionProof(CellRegions& regions, const RegionShell& shell, RunContext& context);

  /// Splits until all polygons keep the promises, but for whether loose ones meet others. Then all points are
  /// there.
  /// @returns how many cubes were split
  /// @throws Error as CellRegions::propose_parts() does; Cancelled
  std::size_t run();

  /// The samples, by block, whose edges may have other polygons than when this was asked last.
  LargeArray<BlockMask> take_changed();

  /// Has the largest cube around the edge split when run() is called again.
  void call_unproven(const CellBlocks::Edge& edge);

 private:
  RegionProof(CellRegions& regions, RegionSlabs* slabs, const RegionShell* shell, UniformCells* uniform,
              RunContext& context);

  void place_lone_points();
  void begin_slabs();
  void look_at_polygons();
  void look_at_polygons(std::size_t block);
  void look_at_slabs();
  std::size_t split();

  void call_unproven(const Region& region);
  bool is_unproven(const Region& region);
  template <class F>
  void for_each_touched(std::size_t block, F&& f) const;

  CellRegions& regions_;
  const CellBlocks& cells_;
  RegionSlabs* const slabs_;        ///< how distances are proved: by these slabs,
  const RegionShell* const shell_;  ///< or by this shell, or not at all if both are null
  /// Makes points as cells become alone; null with a shell, which wants all beforehand.
  UniformCells* const uniform_;
  RunContext& context_;
  std::vector<std::array<std::uint64_t, CellRegions::kLevels>>
      unproven_;                            ///< cubes to be split, for each block at level − 1
  std::vector<std::uint8_t> any_unproven_;  ///< 1 for blocks that have one of these
  LargeArray<BlockMask> changed_;           ///< cells dirty since take_changed()
  // Cells of each block:
  LargeArray<BlockMask> split_cells_;  ///< cells of cubes that were split last (all at the beginning)
  LargeArray<BlockMask> dirty_;        ///< split cells and those next to one
  bool is_new_ = true;                 ///< nothing was looked at yet
  std::vector<std::array<BlockMask, 3>>
      open_;  ///< edges whose polygons are not shown, for each block and axis; with a shell
  std::vector<std::array<BlockMask, 3>> loose_;      ///< edges of loose polygons, likewise; with slabs
  std::array<std::vector<std::uint32_t>, 8> turns_;  ///< blocks of each parity; with slabs or a shell
  tbb::enumerable_thread_specific<std::vector<Region>> split_;
};

}  // namespace hermesh
