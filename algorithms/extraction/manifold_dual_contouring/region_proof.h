// Cubes whose polygons do not keep the promises are split, until all that are left do.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/manifold_dual_contouring/edge_polygons.h"
#include "algorithms/extraction/manifold_dual_contouring/region_polygon.h"
#include "algorithms/extraction/manifold_dual_contouring/region_shell.h"
#include "algorithms/extraction/manifold_dual_contouring/regions.h"

namespace hermesh {

/// Of a merged mesh T beside the uniform mesh S, whose cells' points lie within their cells.
///
/// **Topology.** The cells of a cube are a disc of S (regions.h), which T shrinks to a point. That keeps the
/// surface as it is if any two regions beside one another have one piece of border in common: if the border
/// of the common part of their faces is crossed twice (and never not at all, see regions.h). Then each edge
/// of T has two polygons, and as the border of a disc is one circle, so are the polygons around its point.
///
/// **No two polygons of T meet.** A region's point lies within its cube, so it sees each point of the cube's
/// faces once. The common part of two regions' faces is cut into triangles from where the segment between the
/// regions' points passes through it to the edges of its border. Each of these triangles makes two tetrahedra
/// with the regions' points. Those of one edge are its envelope; envelopes lie side by side, and a polygon
/// that is not loose stays within its own (region_polygon.h, after Ju & Udeshi 2006). Polygons of cells of
/// several sheets, or with ambiguous faces, are those of S, and too far from every cube to meet one of these
/// (kAway in regions.cpp). Loose polygons may reach farther, and have one diagonal in common; they are tested
/// against all others (loose_polygons.h).
///
/// **Distance.** See region_shell.h.
class RegionProof {
 public:
  /// @param tolerance by point, those on fanned edges included; voxels
  RegionProof(Regions& regions, const EdgePolygons& polygons, const std::vector<Eigen::Vector3d>& points,
              std::span<const float> tolerance, RunContext& context);

  /// Splits until all polygons keep the promises, but for whether loose ones meet others.
  /// @returns how many cubes were split
  /// @throws Cancelled
  std::size_t run();

  /// The largest cube around the edge is to be split when run() is called again.
  void call_bold(const CellBlocks::Edge& edge);

 private:
  void call_bold(const Region& region);
  void look_at_polygons();
  bool holds(const CellBlocks::Edge& edge);
  bool is_crossed_once(const RegionPolygon& polygon) const;
  bool is_manifold(const RegionPolygon& polygon) const;
  std::size_t split();

  Regions& regions_;
  const CellBlocks& cells_;
  const RegionShell shell_;
  RunContext& context_;
  std::vector<std::uint8_t> bold_;  ///< by cube: to be split
  /// By block and axis: edges whose polygons are not known to be near.
  std::vector<std::array<BlockMask, 3>> open_;
  std::vector<std::uint8_t> any_bold_;               ///< by block
  std::array<std::vector<std::uint32_t>, 8> turns_;  ///< blocks, by the parity of where they are
  tbb::enumerable_thread_specific<std::vector<Region>> split_;
};

}  // namespace hermesh
