// The table of our own variants. A new one needs an entry in variants.cpp, or voxelizers.cpp for a voxelizer,
// and its sources in algorithms/CMakeLists.txt.
#pragma once

#include <span>
#include <string>

#include "algorithms/core/variant.h"

namespace hermesh {

struct VolumeOutputs;  // voxelization/outputs/volume_outputs.h
struct VolumeRequest;

/// Return our own extractors and voxelizers in the order of lists; the tables live as long as the program.
std::span<const Extractor> our_extractors();
std::span<const Voxelizer> our_voxelizers();

/// Returns true if the voxelizer of that name knows the triangle of each distance, which all volumes but
/// "sdf" need.
bool knows_triangles(const std::string& voxelizer);
/// Makes the requested volumes by a voxelizer that knows_triangles().
/// @throws Error as make_volume_outputs() of voxelize()'s data, and as the voxelizer; Cancelled.
VolumeOutputs make_volume_outputs(const Voxelizer& voxelizer, const VoxelizationInput& input,
                                  const VolumeRequest& request);

}  // namespace hermesh
