// The voxelizer of the thesis with its triangles, for all outputs of §5.1. Heavy (OpenVDB): include it from
// .cpp files.
#pragma once

#include "algorithms/thesis/thesis_voxelizer.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {

/// Makes the grid of thesis_voxelizer() and, if `nearest`, the triangle "that updated the voxel last" (§5.2,
/// §5.5) of each active voxel, as triangulated() numbers them: its distance is the voxel's, but it need not
/// be the nearest one. make_volume_outputs() makes closest points, fog, attributes and Hermite data from
/// these two.
/// @throws Error as thesis_voxelizer(); Cancelled.
Voxelization thesis_voxelization(const VoxelizationInput& input, const ThesisVoxelizerOptions& options,
                                 bool nearest);

}  // namespace hermesh
