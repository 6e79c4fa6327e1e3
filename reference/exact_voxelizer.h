// The oracle among the voxelizers: distances by brute force, signs by counting crossings of rays. Slow and
// certain, for grids of up to a few million voxels.
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

/// Voxelizes by brute force: the grid "sdf" of class level set. The active voxels are exactly those whose
/// distance to the surface is less than the band of their side; their values are that distance, computed in
/// double precision and rounded once to single. Values outside of the band are exterior_band and
/// −interior_band voxels in world units.
///
/// A sample on the surface belongs to the solid on the side to which block_side_place() moves it.
///
/// With the option `signs=winding-number` a point is inside if the exact winding number is above one half,
/// and distances are those to the triangles that bound this solid (solid_boundary()): for models of parts
/// that overlap or touch.
///
/// With `signs=parity` a point is inside when most of several rays from it cross the polygons an odd number
/// of times (exact predicates). The sign can change only across the surface, so rays are cast for one voxel
/// of every set of voxels that provably lie on one side: two neighbours whose distances add up to more than
/// the voxel between them. For a closed mesh that does not intersect itself this is the true inside, with any
/// winding; nested shells alternate; for an open mesh it is a vote. Triangles of no area are skipped: their
/// edges belong to their neighbours, too.
/// @throws Error if check_voxelization_fits() throws, and for a mesh whose triangles all have no area;
/// Cancelled
LevelSet exact_voxelizer(const VoxelizationInput& input);

}  // namespace hermesh
