// One group of cells: an input at one resolution through one voxelizer, for all extractors, validated and
// then timed.
#pragma once

#include <vector>

#include "experiments/harness/cell.h"

namespace hermesh {

/// Returns the rows, one for each variant, failed ones included; writes the meshes and the picture of the
/// job.
/// @throws Cancelled; Error if a mesh or the picture cannot be written.
std::vector<Json> run_group(const GroupJob& job, const LoadedCase& input, const Tables& tables,
                            const CellWatch& watch, RunContext& context);

}  // namespace hermesh
