// The distance between a merged mesh and the uniform mesh for large tolerances.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/bounds.h"
#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_octree/cell_regions.h"
#include "algorithms/extraction/certified_octree/region_polygon.h"

namespace hermesh {

/// The proof, for tolerances beyond kLeast and below the diagonal of the largest cubes, that the merged mesh
/// T and the uniform mesh S are near each other. It needs only the vertices of S that T shares.
///
/// A cube X has a *layer*: its points between two planes perpendicular to the mean of its crossings' normals,
/// whose distance is such that the layer contains
/// - S ∩ X: a polygon of S is in the hull of its cells' vertices and its crossing (or, if a fan's vertex had
/// to move,
///   1/2048 voxel from that: uniform_mesh.h), and in mean placement these are in the hull of the crossings.
///   So all crossings of X and of the cells around it count and, in other placements, their vertices as well;
/// - T ∩ X: a polygon in its envelope passes from region to region through their faces, so its part in X is
/// in the hull
///   of X's vertex and of the points where its sides and its diagonal intersect the faces. A loose polygon
///   counts as a whole, in every cube that its box touches.
///
/// Let A be the corner of X that is farthest up, and B the one farthest down. If A is above the layer and
/// outside, and B below it and inside, then so is all of X above it, and all below, because these parts are
/// convex, neither S nor T intersects them, and the corners of regions are on the sides of S and T that their
/// signs indicate. (For T, because the envelope of each edge has one polygon, which intersects that edge once
/// and no other. A loose polygon is equivalent to a fan in its envelope: the space between the two is in the
/// hull of its corners, of its crossing and of points on its faces, and the layers contain that, too.) A
/// segment from one part to the other intersects both S and T. So if a point of the layer is within the
/// tolerance of either part, both S and T are within the tolerance of it, as the segment lies in the ball
/// around it. The distance to a convex part is a convex function, so all points of the layer are that near if
/// its corners are. Otherwise the proof requires that no two points of the layer are farther apart than the
/// tolerance, and both S and T are in it.
///
/// A single cell with a polygon at a cube has a diagonal within the tolerance, and contains both meshes.
/// Elsewhere T is S, except that a loose polygon may leave its regions. S must be near it, which is proved in
/// in the same way for the box of lattice cells around it, with a layer for it and S, which intersects the
/// polygon's edge there.
class RegionLayers {
 public:
  /// Layers are for tolerances beyond this, in voxels; it exceeds the diagonal of a cell.
  static constexpr float kLeast = 2.0f;

  /// Lists the crossings. `points` are the vertices of S if they may be outside the hull of their cells'
  /// crossings, and null otherwise. `regions` and `points` must outlive this. @throws Error for more than 2³²
  /// positions; Cancelled
  RegionLayers(const CellRegions& regions, const UniformPoints* points, RunContext& context);

  /// Makes room for newly proposed cubes, before the next begin().
  void make_room() { layers_.resize(regions_.cube_count()); }
  /// Begins the layer of a cube with its part of S. Safe to call concurrently.
  void begin(const Region& cube);
  /// Widens the layers of a polygon's cubes by its parts there; if it is loose, those of all cubes that it
  /// may touch. Safe to call concurrently, in any order.
  void add(const RegionPolygon& polygon);
  /// Returns true if both meshes are near all of a cube's layer, to which all polygons were added.
  bool holds(const Region& cube) const;
  /// Returns true if S is near a loose polygon, wherever that is. Safe to call concurrently.
  bool holds(const RegionPolygon& loose) const;

 private:
  /// The planes of a layer, by their heights along its direction.
  struct Layer {
    float low, high;
    void add(float height) {
      low = std::min(low, height);
      high = std::max(high, height);
    }
  };
  struct Part;
  struct Corners;
  struct Fan;

  void widen(const Region& cube, std::span<const Eigen::Vector3d> places);
  Fan fan_of(const RegionPolygon& loose) const;
  bool is_inside(std::int32_t block, std::array<int, 3> from, const std::array<int, 3>& to) const;
  bool are_near_parts(std::int32_t block, const BoundsOf<int>& box, const std::array<int, 3>& known,
                      const Eigen::Vector3d& up, const Layer& layer, std::span<const Eigen::Vector3d> corners,
                      double tolerance) const;
  template <class F>
  void for_each_block_at(std::int32_t block, const BoundsOf<int>& box, F&& f) const;
  template <class F>
  void for_each_cube(std::int32_t block, const BoundsOf<int>& box, F&& f) const;
  template <class F>
  void for_each_near(std::int32_t block, const BoundsOf<int>& box, F&& f) const;

  const CellRegions& regions_;
  const CellBlocks& cells_;
  std::vector<std::array<std::uint16_t, 65>> bins_;  ///< first position of each 2³ samples of a block
  std::vector<std::uint32_t> first_;                 ///< first position of each block
  using Place = std::array<std::uint16_t, 3>;
  LargeArray<Place> places_;   ///< crossings and vertices in their block, in units of 1/4096 voxel
  std::vector<Layer> layers_;  ///< by cube, heights relative to its vertex
};

}  // namespace hermesh
