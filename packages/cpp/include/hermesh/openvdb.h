// Volumes as OpenVDB's grids and back, for programs that use OpenVDB themselves; no other header includes
// this.
#pragma once

#include <openvdb/openvdb.h>

#include "hermesh/export.h"
#include "hermesh/volume.h"

namespace hermesh::HERMESH_V1 {

/// The grid inside a volume, which nobody may change: make a deepCopy() to do so. @throws Error for a volume
/// of nothing.
HERMESH_API openvdb::GridBase::ConstPtr to_openvdb(const Volume& volume);

/// A volume of a grid, which is shared and which nobody may change from then on. Grids of half and double
/// precision, whole numbers, bool and masks become floats. @throws Error for a null pointer.
HERMESH_API Volume from_openvdb(const openvdb::GridBase::ConstPtr& grid);

}  // namespace hermesh::HERMESH_V1
