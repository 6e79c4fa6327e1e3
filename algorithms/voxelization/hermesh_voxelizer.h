// Our voxelizer: any soup of polygons to a narrow band of exact distances.
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

/// What the variant takes: signs = auto | flood-fill | winding-number | unsigned.
std::vector<OptionSpec> hermesh_voxelizer_options();

/// Level set of the solid that the polygons bound, a grid named "sdf" in world units.
///
/// Every voxel nearer to the surface than the band is wide is active, no other, and its value is the distance to the
/// nearest polygon that bounds the solid, right to 1e-5 voxel. Polygons may come in any order and orientation, twice,
/// degenerate, intersecting, open. The same bytes at any thread count and any level of vector code.
///
/// @throws Error as check_voxelization_fits(); Cancelled.
LevelSet hermesh_voxelizer(const VoxelizationInput& input);

}  // namespace hermesh
