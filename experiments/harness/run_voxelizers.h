// One group of cells of an experiment on voxelization: an input at one voxel size, for all voxelizers,
// checked and then timed.
#pragma once

#include <vector>

#include "experiments/harness/cell.h"

namespace hermesh {

/// Returns the rows, one for each voxelizer, failed ones included. `solid` is what the signs are checked
/// against, mostly the input itself; `voxel_size` is in world units. @throws Cancelled.
std::vector<Json> run_voxelizers(const GroupJob& job, const LoadedCase& input, const LoadedCase& solid,
                                 double voxel_size, const Tables& tables, const CellWatch& watch,
                                 RunContext& context);

}  // namespace hermesh
