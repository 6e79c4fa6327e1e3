// Finds the nearest point of a surface and the side of a closed surface on which a point lies: by a CGAL tree
// over the triangles, in double precision. Slow and reliable; it shares no code with the voxelizers that are
// validated with it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <bitset>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

using Corners = std::array<Eigen::Vector3d, 3>;

/// Returns the mesh's triangles in the index coordinates of a grid whose samples lie at origin + voxel_size ·
/// (i, j, k): in voxels, relative to the mesh's origin. Triangles of no area are left out (exact predicate);
/// their edges belong to their neighbours, too.
std::vector<Corners> triangles_in_voxels(const PolygonMesh& mesh, double voxel_size);

/// Answers questions about the distance to a set of triangles, without approximation but slowly. All
/// positions and distances are in voxels.
class DistanceOracle {
 public:
  /// @throws Error if there are no triangles.
  explicit DistanceOracle(std::vector<Corners> triangles);
  ~DistanceOracle();
  DistanceOracle(const DistanceOracle&) = delete;
  DistanceOracle& operator=(const DistanceOracle&) = delete;

  const std::vector<Corners>& triangles() const;

  /// Returns the distance to the nearest triangle, or the upper bound if that is smaller. A close bound makes
  /// the search fast.
  double distance(const Eigen::Vector3d& point,
                  double upper_bound = std::numeric_limits<double>::infinity()) const;
  /// Returns true if a triangle comes within a radius of a point.
  bool any_within(const Eigen::Vector3d& point, double radius) const;
  /// Returns the point on the triangles that is nearest to the given one.
  Eigen::Vector3d nearest_point(const Eigen::Vector3d& point) const;
  /// Numbers of all triangles within a radius of a point.
  std::vector<std::uint32_t> triangles_within(const Eigen::Vector3d& point, double radius) const;

  /// The votes of a set of rays from a point for an odd or even number of intersections with the surface. A
  /// ray in general position intersects no edge, and its parity is correct. The directions are irrational
  /// multiples of one another; should a ray graze an edge even so, the others outvote it. Three rays that
  /// agree are enough; at most nine are cast.
  struct Vote {
    int odd = 0, cast = 0;
    bool inside() const { return 2 * odd > cast; }
    bool unanimous() const { return odd == 0 || odd == cast; }
  };
  /// Casts rays from a point until they agree enough.
  Vote parity(const Eigen::Vector3d& point) const;
  /// Returns the signed number of triangles that the ray from a point along one of the nine directions (0 to
  /// 8) crosses: +1 for each that it leaves by the front, the side that the triangle's normal points to, and
  /// −1 for each that it enters by the front.
  int signed_crossings(const Eigen::Vector3d& point, int direction) const;
  /// Returns direction `number`, 0 to 8, of the rays.
  static Eigen::Vector3d direction(int number);

  /// Origins, at multiples of 8, of the blocks of 8³ samples whose centre is no farther from the surface than
  /// the band (voxels) plus half a block's diagonal: all blocks that overlap the band, and a few more.
  std::vector<std::array<int, 3>> blocks_within(double band, const RunContext& context) const;

 private:
  struct Machinery;
  std::unique_ptr<Machinery> machinery_;
};

// ---- A block: the 512 samples of an OpenVDB leaf in the leaf's order, z fastest.

inline constexpr int kBlockVoxels = 512;
inline Eigen::Vector3d block_position(const std::array<int, 3>& origin, int i) {
  return {double(origin[0] + (i >> 6)), double(origin[1] + (i >> 3 & 7)), double(origin[2] + (i & 7))};
}

/// Distances of all samples of a block (voxels), each of them exact or no less than `reach`.
std::array<double, kBlockVoxels> block_distances(const DistanceOracle& oracle,
                                                 const std::array<int, 3>& origin, double reach);

/// Returns the point at which the side of sample i is evaluated: a few millionths of a voxel above the sample
/// on every axis, most on x and least on z, so that a sample on a polygon belongs to the solid on the upper
/// side of it.
Eigen::Vector3d block_side_place(const std::array<int, 3>& origin, int i);

/// Returns the samples of a block that lie inside. `is_inside` is called with block_side_place() of one
/// sample of every set that provably lies on one side: the sign can change only across the surface, so two
/// neighbours are on one side if their distances add up to more than the voxel between them.
std::bitset<kBlockVoxels> block_inside(const std::array<int, 3>& origin,
                                       const std::array<double, kBlockVoxels>& distances,
                                       const std::function<bool(const Eigen::Vector3d&)>& is_inside);

}  // namespace hermesh
