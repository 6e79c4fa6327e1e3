// Whether a merged mesh is near the uniform mesh, and that near it.
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

/// Proves for tolerances beyond kLeast, as long as there are larger cubes, that the merged mesh T and the
/// uniform mesh S are near each other. Nothing of S need be made for it but the points that T has in common
/// with it.
///
/// A cube X has a *slab*: its places between two planes at right angles to the mean of its crossings'
/// normals. They are as far apart as it takes for the slab to contain
/// - S ∩ X: a polygon of S is in the hull of its cells' points and its crossing (or, where a fan's point had
/// to move, 1/2048 voxel from that: uniform_mesh.h), and in mean placement these are in the hull of the
/// crossings. So all crossings of X and of the cells around it count, and in other placements their points as
/// well;
/// - T ∩ X: a polygon that keeps to its envelope passes from region to region through their faces, so what it
/// has in X is in the hull of X's point and of where its sides and its diagonal pass the faces. A loose
/// polygon counts as a whole, in every cube that its box touches.
///
/// Let A be the corner of X that is farthest up, and B the one farthest down. If A is above the slab and
/// outside, and B below it and inside, then so is all of X above it, and all below: these parts are convex
/// and neither S nor T reaches them; and S and T have the corners of regions on the sides that their signs
/// say. (T, because each edge's envelope has one polygon, which crosses that edge once and no other. A loose
/// polygon is as good as a fan in its envelope: what lies between the two is in the hull of its points, of
/// its crossing and of places on its faces, and the slabs contain it, too.) A segment from one part to the
/// other meets both S and T. So if a place of the slab is no farther than the tolerance from either part,
/// both S and T come within the tolerance of it: the segment lies in the ball about it. The distance to a
/// convex part is convex, so all places of the slab are that near if its corners are. Or else no two of the
/// slab's places are farther apart than the tolerance, and both S and T are there.
///
/// A cell that is alone and has a polygon with a cube is no larger than the tolerance, and both meshes are
/// there. Elsewhere T is S, but that a loose polygon may leave its regions: S must be near it, which is asked
/// of the box of lattice cubes about it in the same way, with a slab for it and S, which crosses the
/// polygon's edge there.
class RegionSlabs {
 public:
  /// Slabs are for tolerances beyond this, in voxels: it is above the diagonal of a cell.
  static constexpr float kLeast = 2.0f;

  /// Lists the crossings. `points` are those of S, if they may be out of the hull of their cells' crossings;
  /// else null. `regions` and `points` must outlive this. @throws Error if there are more places than 32 bits
  /// can number; Cancelled
  RegionSlabs(const CellRegions& regions, const UniformPoints* points, RunContext& context);

  /// Makes room for cubes that were proposed meanwhile; before the next begin().
  void make_room();
  /// Begins the slab of a cube with what S has there. Safe to call for several at once.
  void begin(const Region& cube);
  /// Widens the slabs of a polygon's cubes by what it has there, and if it is loose, those of all that it may
  /// touch. Safe to call for several at once, in any order.
  void add(const RegionPolygon& polygon);
  /// Whether both meshes are near all of a cube's slab, to which all polygons were added.
  bool holds(const Region& cube) const;
  /// Whether S is near a loose polygon, wherever that is. Safe to call for several at once.
  bool holds(const RegionPolygon& loose) const;

 private:
  /// The planes of a slab, by their heights along its direction.
  struct Slab {
    float low, high;
  };
  struct Part;
  struct Corners;
  struct Fan;

  void widen(const Region& cube, std::span<const Eigen::Vector3d> places);
  Fan fan_of(const RegionPolygon& loose) const;
  bool is_inside(std::int32_t block, std::array<int, 3> from, const std::array<int, 3>& to) const;
  bool are_near_parts(std::int32_t block, const BoundsOf<int>& box, const std::array<int, 3>& known,
                      const Eigen::Vector3d& up, const Slab& slab, std::span<const Eigen::Vector3d> corners,
                      double tolerance) const;
  template <class F>
  void for_each_cube(std::int32_t block, const BoundsOf<int>& box, F&& f) const;
  template <class F>
  void for_each_near(std::int32_t block, const BoundsOf<int>& box, F&& f) const;

  const CellRegions& regions_;
  const CellBlocks& cells_;
  std::vector<std::array<std::uint16_t, 65>> bins_;  ///< where the places of each 2³ samples of a block begin
  std::vector<std::uint32_t> first_;                 ///< first place of each block
  using Place = std::array<std::uint16_t, 3>;
  LargeArray<Place> places_;  ///< crossings and points in their block, in parts of a voxel
  std::vector<Slab> slabs_;   ///< one for each cube, heights over its point
};

}  // namespace hermesh
