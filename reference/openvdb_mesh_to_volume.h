// OpenVDB's own voxelizer: openvdb::tools::meshToVolume (Mihai Aldén; the production descendant of the
// thesis).
#pragma once

#include "algorithms/core/variant.h"

namespace hermesh {

/// Voxelizes by meshToVolume with default flags: the grid "sdf" of class level set. OpenVDB renormalises the
/// distances, so they are approximate everywhere. Signs do not depend on the winding; cavities are filled; an
/// open mesh comes out without an inside, which a note reports. Values outside of the band are exterior_band
/// and −interior_band voxels in world units.
/// @throws Error if check_voxelization_fits() throws; Cancelled
LevelSet openvdb_mesh_to_volume(const VoxelizationInput& input);

}  // namespace hermesh
