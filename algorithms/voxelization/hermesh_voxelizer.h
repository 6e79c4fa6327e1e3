// Our voxelizer as a variant: any soup of polygons to a narrow band of exact distances. See voxelize.h.
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

struct VoxelizeOptions;  // voxelize.h

/// What the variant takes: signs = auto | flood-fill | winding-number | unsigned.
std::vector<OptionSpec> hermesh_voxelizer_options();

/// What they ask of voxelize(). An input without options has the defaults.
VoxelizeOptions voxelize_options(const VoxelizationInput& input);

/// voxelize() with its options. @throws Error as check_voxelization_fits(); Cancelled.
LevelSet hermesh_voxelizer(const VoxelizationInput& input);

}  // namespace hermesh
