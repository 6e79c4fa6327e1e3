// Whether a merged polygon is near the uniform mesh, and that near it.
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

/// A shell about merged polygons T, which proves for tolerances of up to kFarthest that they are near the
/// uniform mesh S and that S is near them (after Jiang et al. 2020).
///
/// Each point of T has a pillar, a unit direction: a region's is the mean of its crossings' normals. Between
/// the corners of a triangle directions are interpolated; over each triangle stands a prism, as far up and
/// down its pillars as the tolerance, and prisms of neighbours share a wall. It is shown that
///   - pillars rise over their triangles and neither meet nor cross, so that a place in a prism lies on one
///     line of it;
///   - all triangles of S that reach into a prism (by 1e-6 voxel or more) face up along its pillars, and
///     stay between its lid and its bottom;
///   - S is there, a triangle of one of the cells that the polygon's regions are made of;
///   - at sides between two cells that are alone, beyond which T may be S, S goes on into the prism: else it
///     could bulge out between T and the place where the lines of the prism meet it.
/// Then every line of a prism meets S once. Never twice, for S would have to face down in between; and at
/// all, because the lines that do are an open and a closed set: S has no border, and leaves by the walls
/// alone. So each point of T has one of S no farther away than the tolerance. And as S comes to T's
/// neighbours' prisms through the walls, all of it is in prisms: each point of S has one of T no farther
/// away. Where no cell is merged T is S, and the point that a line meets is its own.
class RegionShell {
 public:
  /// The largest distance that can be shown, whatever the tolerance, in voxels.
  static constexpr double kFarthest = 2.0;

  /// Describes the uniform mesh for the search. All arguments by reference but `context` must outlive this,
  /// as must what `tolerance` refers to.
  /// @param regions the cubes as they are when holds() is called
  /// @param polygons of the uniform mesh
  /// @param points of the uniform mesh
  /// @param tolerance by point, those on fanned edges included; voxels
  /// @param context asked whether to stop
  /// @throws Cancelled
  RegionShell(const CellRegions& regions, const EdgePolygons& polygons, const UniformPoints& points,
              std::span<const float> tolerance, RunContext& context);
  ~RegionShell();

  /// Whether a merged polygon is proved. Safe to call for several polygons at once.
  bool holds(const RegionPolygon& polygon) const;

 private:
  class Search;
  struct Buffers;

  /// The crossing edges with a quad, a bit each, of an axis in a layer of a block.
  std::uint64_t quads_in(std::size_t block, std::size_t axis, std::size_t layer) const;
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
  LargeArray<Quad> quads_;            ///< in the order of block, sample and axis; as EdgePolygons cuts them
  LargeArray<std::uint8_t> upright_;  ///< 1 for quads that face up along their block's direction
  std::array<LargeArray<float>, 3>
      in_blocks_;  ///< coordinates of the cells' points, relative to the corners of their blocks
  const shell_kernels::Kernels& kernels_ = chosen_kernels<shell_kernels::Kernels>();
  mutable tbb::enumerable_thread_specific<std::unique_ptr<Buffers>> buffers_;
};

}  // namespace hermesh
