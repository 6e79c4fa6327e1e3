// Splits cubes whose polygons violate a guarantee until none is left.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_octree/cell_regions.h"
#include "algorithms/extraction/certified_octree/region_layers.h"
#include "algorithms/extraction/certified_octree/region_polygon.h"
#include "algorithms/extraction/certified_octree/region_shell.h"
#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/uniform_mesh.h"

namespace hermesh {

/// The proof that a merged mesh T is correct and near the uniform mesh S, whose vertices lie in their cells.
///
/// **Topology** needs no test here. The cells of a cube are a disc of S, which T contracts to a vertex. This
/// preserves the surface if any two adjacent regions have one piece of border in common, and each crossed
/// edge between regions has one polygon. Both hold, because the common part of two regions' faces is the
/// whole face of the smaller one, the common part of several regions' edges is the whole edge of the smallest
/// one, and the border of a cube is simple (cell_regions.h), as is that of a cell without ambiguous faces. So
/// each edge of T has two polygons and, since the border of a disc is one circle, the polygons around its
/// vertex form one cycle.
///
/// **No two polygons of T intersect.** The vertex of a region lies within its cube, so each ray from it
/// intersects the cube's boundary once. The common part of two regions' faces is divided into triangles, from
/// its intersection with the segment between the regions' vertices to the edges of its border. Each of these
/// triangles forms two tetrahedra with the regions' vertices. Those of one edge are its envelope. Envelopes
/// do not overlap, and a polygon that is not loose lies in its own (region_polygon.h, after Ju & Udeshi
/// 2006). Polygons of cells with several sheets or ambiguous faces are those of S, and too far from every
/// cube to intersect its polygons (kAway in cell_regions.cpp). Loose polygons may extend farther, and may
/// have a common diagonal; they are tested against all others (loose_polygons.h), except around vertices of
/// cubes with a plain star (PolygonStars).
///
/// **Distance.** Small tolerances use region_shell.h, which requires all of S, and large ones
/// region_layers.h. Beyond the diagonal of the largest cubes nothing needs a proof: S intersects each edge
/// that has a polygon of T, whose corners are in regions at that edge; and each point of S is in a region
/// with a vertex of T.
class RegionProof {
 public:
  /// The diagonal of a cube, in sides of it, rounded up.
  static constexpr float kDiagonal = 1.7321f;

  /// All arguments must outlive this.
  /// @param regions are split
  /// @param layers prove the distance; null for another proof
  /// @param shell proves the distance; null for another proof. If both are null, the tolerance must exceed
  ///   the diagonal of the largest cubes.
  /// @param uniform places the vertices of cells that become single; null with a shell, which requires all
  ///   vertices of the uniform mesh beforehand
  /// @param context receives the progress and the request to cancel
  RegionProof(CellRegions& regions, RegionLayers* layers, const RegionShell* shell, UniformCells* uniform,
              RunContext& context);

  /// Splits cubes until all polygons fulfil the guarantees, except for the contact of loose ones, and places
  /// all vertices of single cells.
  /// @returns the number of cubes split
  /// @throws Error as CellRegions::propose_parts() does; Cancelled
  std::size_t run();

  /// Returns the samples, by block, whose edges may have other polygons than at the previous call.
  LargeArray<BlockMask> take_changed();

  /// Marks the largest cube around the edge to be split by the next run().
  void call_unproven(const CellBlocks::Edge& edge);

 private:
  void place_lone_points();
  void begin_layers();
  void look_at_polygons(std::size_t block);
  void look_at_layers();
  std::size_t split();

  void call_unproven(const Region& region);
  bool is_unproven(const Region& region);
  template <class F>
  void for_each_touched(std::size_t block, F&& f) const;

  CellRegions& regions_;
  const CellBlocks& cells_;
  RegionLayers* const layers_;
  const RegionShell* const shell_;
  UniformCells* const uniform_;
  RunContext& context_;
  /// Cubes to be split, by block and at level − 1.
  std::vector<std::array<std::uint64_t, CellRegions::kLevels>> unproven_;
  std::vector<std::uint8_t> any_unproven_;  ///< 1 for blocks that have one of these
  LargeArray<BlockMask> changed_;           ///< cells dirty since take_changed()
  LargeArray<BlockMask> split_cells_;       ///< cells of cubes that were split last (all at the beginning)
  LargeArray<BlockMask> dirty_;             ///< split cells and those next to one
  bool is_new_ = true;
  // Edges by block and axis:
  std::vector<std::array<BlockMask, 3>> open_;       ///< whose polygons are not proved; with a shell
  std::vector<std::array<BlockMask, 3>> loose_;      ///< whose polygons are loose; with layers
  std::array<std::vector<std::uint32_t>, 8> turns_;  ///< blocks of each parity; with layers or a shell
  tbb::enumerable_thread_specific<std::vector<Region>> split_;
};

}  // namespace hermesh
