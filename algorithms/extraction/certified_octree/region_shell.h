// The distance between a merged mesh and the uniform mesh for small tolerances.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_octree/cell_regions.h"
#include "algorithms/extraction/certified_octree/kernels/shell_kernels.h"
#include "algorithms/extraction/certified_octree/region_polygon.h"
#include "algorithms/extraction/contact/triangle_contact.h"
#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// A shell around merged polygons T, which proves for tolerances of up to kFarthest that T and the uniform
/// mesh S are near each other (after Jiang et al. 2020).
///
/// Each vertex of T has a pillar, a unit direction: the mean of the normals of its region's crossings. Within
/// a triangle, directions are interpolated between the corners. Over each triangle there is a prism, which
/// extends up and down along its pillars by the tolerance; prisms of adjacent triangles share a wall. The
/// proof establishes that
///   - pillars rise over their triangles and do not intersect, so each point of a prism lies on one line of
///     it;
///   - all triangles of S that extend into a prism (by 1e-6 voxel or more) face up along its pillars, and
///     stay between its lid and its bottom;
///   - S is in it, with a triangle of one of the cells of the polygon's regions;
///   - at sides between two single cells, beyond which T may be S, S continues into the prism: otherwise it
///     could bulge out between T and its intersection with the lines of the prism.
/// Then every line of a prism intersects S exactly once. Not twice, because S would have to face down in
/// between; and at least once, because the lines that do form an open and closed set: S has no boundary, and
/// leaves through the walls only. So each point of T has a point of S within the tolerance. As S enters the
/// adjacent prisms through the walls, all of it is in prisms, and each point of S has one of T within the
/// tolerance. Where no cell is merged, T is S, and the point on a line is its own.
class RegionShell {
 public:
  /// The largest distance that can be proved, whatever the tolerance, in voxels.
  static constexpr double kFarthest = 2.0;

  /// Prepares the uniform mesh for the search. All arguments by reference except `context`, and the data of
  /// `tolerance`, must outlive this.
  /// @param regions the cubes at the time of each call of holds()
  /// @param polygons of the uniform mesh
  /// @param points of the uniform mesh
  /// @param tolerance by vertex, including those of fanned edges; voxels
  /// @param context receives the request to cancel
  /// @throws Cancelled
  RegionShell(const CellRegions& regions, const EdgePolygons& polygons, const UniformPoints& points,
              std::span<const float> tolerance, RunContext& context);
  ~RegionShell();

  /// Returns true if a merged polygon is proved. Safe to call concurrently.
  bool holds(const RegionPolygon& polygon) const;

 private:
  class Search;
  struct Buffers;

  /// Returns the crossed edges with a quad of an axis in one word of a block.
  std::uint64_t quads_in(std::size_t block, std::size_t axis, std::size_t word) const;
  void describe(std::size_t block, std::uint32_t first_quad);
  void find_upright(std::size_t block, std::uint32_t first_quad, std::uint32_t end);

  const CellRegions& regions_;
  const CellBlocks& cells_;
  const EdgePolygons& polygons_;
  const UniformPoints& points_;
  const std::span<const float> tolerance_;
  float least_tolerance_;
  std::vector<shell_kernels::Block> blocks_;
  std::vector<Eigen::Vector3d> up_;   ///< mean normal of each block's quads
  LargeArray<Quad> quads_;            ///< by block, sample and axis; as cut by EdgePolygons
  LargeArray<std::uint8_t> upright_;  ///< 1 for quads that face up along their block's direction
  std::array<LargeArray<float>, 3>
      in_blocks_;  ///< the cells' vertices, relative to the corners of their blocks
  const shell_kernels::Kernels& kernels_ = chosen_kernels<shell_kernels::Kernels>();
  mutable tbb::enumerable_thread_specific<std::unique_ptr<Buffers>> buffers_;
};

}  // namespace hermesh
