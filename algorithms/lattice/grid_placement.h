// Positions of the samples of an OpenVDB grid.
#pragma once

#include <memory>

#include "algorithms/core/level_set.h"
#include "algorithms/core/openvdb_forward.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// Returns the bounding box of the active voxels in index coordinates. The same as
/// FloatTree::evalActiveVoxelBoundingBox(), which accesses every leaf and its memory latency: most leaves lie
/// within the box of those before them, which the node above shows.
openvdb::CoordBBox active_box(const openvdb::FloatTree& tree);

/// Returns the placement of a grid: its affine map, with the origin of single precision chosen near its
/// active voxels.
/// @throws Error for a grid with perspective.
IndexToWorld placement_of(const openvdb::FloatGrid& grid);
IndexToWorld placement_of(const LevelSet& level_set);

/// Returns the map of a grid of cubic voxels of `voxel_size` whose sample (0, 0, 0) is at `origin`, both in
/// world units.
std::shared_ptr<openvdb::math::Transform> transform_at(const Eigen::Vector3d& origin, double voxel_size);

}  // namespace hermesh
