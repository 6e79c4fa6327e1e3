#include "reference/openvdb_mesher.h"

namespace hermesh {

void run_mesher(openvdb::tools::VolumeToMesh& mesher, const openvdb::FloatGrid& grid) { mesher(grid); }

}  // namespace hermesh
