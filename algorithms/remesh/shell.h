// Shells around triangles: all points within a radius of them, joined to a solid with exact Hermite data.
//
// **Why a shell has no holes.** Let every triangle have a radius of at least half a voxel. Where a lattice
// edge crosses a triangle, the crossing divides the edge, which is one voxel long, so one of its ends is
// within half a voxel of the triangle and lies inside the shell. Two samples on different sides of the
// polygons, both outside the shell, are therefore never neighbours along an edge: the shell separates them
// (compare Huang, Yagel, Filippov and Kurzion, An Accurate Method for Voxelizing Polygon Meshes, 1998). The
// same holds for a plane wall of thickness t whose two faces have the radius (1 − t) / 2, because the wall
// and its shell together are the points within half a voxel of the wall's middle plane.
//
// **Why a wire is connected.** Every point is within √3/2 voxel of the sample that is nearest to it. With at
// least that radius, the sample nearest to each point of a curve lies inside. When a point moves along the
// curve, its nearest sample changes between neighbours along an edge, so the samples form one connected path.
#pragma once

#include <array>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/solids.h"

namespace hermesh {

/// The radius of a shell around a surface, and around a wire or speck, in voxels. Each is a little more than
/// the proof above needs, because samples that lie exactly on the boundary count as outside.
inline constexpr double kShellRadius = 0.6, kWireRadius = 0.875;

/// A triangle and the radius of the shell around it.
struct ShellTriangle {
  std::array<Eigen::Vector3f, 3> corner;  ///< world units relative to the polygons' origin
  double radius;                          ///< voxels, greater than 0
};

/// Returns the union of a solid and of all points within `radius` of a triangle. Crossings and normals are
/// exact: a crossing is where the edge leaves the solid and the shell around all triangles together, seen
/// from its inside end. Radii are rounded up to multiples of 1/40 voxel.
/// @param triangles at least one
/// @param origin that the corners are relative to, world units; sample (0, 0, 0) of the solid's lattice
/// @throws Cancelled
CombinedSolid with_shell(const SampledSolid& solid, const std::vector<ShellTriangle>& triangles,
                         const Eigen::Vector3d& origin, RunContext& context);

}  // namespace hermesh
