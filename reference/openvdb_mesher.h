// OpenVDB's mesher on a level set, compiled once for all that use it: it takes more than half a minute.
#pragma once

#include <openvdb/tools/VolumeToMesh.h>

#include "algorithms/core/openvdb_trees.h"

namespace hermesh {

void run_mesher(openvdb::tools::VolumeToMesh& mesher, const openvdb::FloatGrid& grid);

}  // namespace hermesh
