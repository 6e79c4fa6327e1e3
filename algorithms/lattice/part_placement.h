// Placement of a lattice that is made part by part, the same for every part.
#pragma once

#include <cstdint>

#include "algorithms/core/bounds.h"
#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// A box of samples, in index coordinates: from the lower corner to below the upper one, both multiples of 8.
using SampleBox = BoundsOf<std::int32_t>;

/// Returns the extent of polygons on the lattice of voxelizers: it contains all blocks with an edge that is
/// crossed at the polygons, and with a cell of such an edge. @param voxel_size world units
SampleBox extent_of(const PolygonMesh& mesh, double voxel_size);

/// Returns the volume with its extent, which placement_of() uses instead of the active voxels.
LevelSet with_extent(const LevelSet& level_set, const SampleBox& extent);
/// Returns such a volume on the lattice of voxelizers for a mesh with this origin, which has no active
/// samples except the corners of the extent, for its placement_of() and check_written_precision().
LevelSet outline_of(const Eigen::Vector3d& origin, double voxel_size, const SampleBox& extent);

}  // namespace hermesh
