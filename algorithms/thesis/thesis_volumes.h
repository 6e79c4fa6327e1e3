// The voxelizer of the thesis with its triangles, for all outputs of §5.1. Heavy (OpenVDB): include it from
// .cpp files.
#pragma once

#include "algorithms/thesis/thesis_voxelizer.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {

/// The grid of thesis_voxelizer() and, if `nearest`, the triangle "that updated the voxel last" (§5.2, §5.5)
/// of each active voxel, as triangulated() numbers them: its distance is the voxel's, but it need not be the
/// nearest one. Closest points, fog, attributes and Hermite data are made from these two by
/// make_volume_outputs().
/// @throws Error as thesis_voxelizer(); Cancelled.
Voxelization thesis_voxelization(const VoxelizationInput& input, const ThesisVoxelizerOptions& options,
                                 bool nearest);

}  // namespace hermesh
