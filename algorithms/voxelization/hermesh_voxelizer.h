// Our voxelizer as a variant: any soup of polygons to a narrow band of exact distances. See voxelize.h.
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

struct VoxelizeOptions;  // voxelize.h

/// Options that the variant declares: signs = auto | flood-fill | winding-number | unsigned.
std::vector<OptionSpec> hermesh_voxelizer_options();

/// The input's options in the form that voxelize() takes. An input without options has the defaults.
VoxelizeOptions voxelize_options(const VoxelizationInput& input);

/// The level set that voxelize() makes of the mesh with the input's options, distances only.
/// @throws Error as check_voxelization_fits(); Cancelled.
LevelSet hermesh_voxelizer(const VoxelizationInput& input);

}  // namespace hermesh
