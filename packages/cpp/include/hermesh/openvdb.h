// Volumes as OpenVDB's grids and back, for programs that use OpenVDB; no other header includes this one.
#pragma once

#include <openvdb/openvdb.h>

#include "hermesh/export.h"
#include "hermesh/volume.h"

namespace hermesh::HERMESH_V1 {

/// Returns the immutable grid of a volume; use deepCopy() to change it. @throws Error for an empty volume.
HERMESH_API openvdb::GridBase::ConstPtr to_openvdb(const Volume& volume);

/// Returns a volume of a grid, which is shared and must not change from then on. Grids of half and double
/// precision, integers, bool and masks become floats. @throws Error for a null pointer.
HERMESH_API Volume from_openvdb(const openvdb::GridBase::ConstPtr& grid);

}  // namespace hermesh::HERMESH_V1
