// One group of cells of an experiment on voxelization: an input at one voxel size, for all voxelizers, judged
// and then timed.
#pragma once

#include <string>
#include <vector>

#include "experiments/harness/run_cells.h"

namespace hermesh {

struct VoxelizerGroupInput {
  const Experiment& experiment;
  const Tier& tier;
  const CaseEntry& entry;
  const LoadedCase& input;
  const LoadedCase& solid;               ///< what the signs are judged by; the input itself, mostly
  double voxel_size;                     ///< world units
  std::vector<VariantEntry> voxelizers;  ///< those that the filter leaves
  const Tables& tables;
  const Json& head;  ///< what all rows of the group begin with
  CellWatch watch = {};
};

/// The rows, one for each voxelizer, failed ones included. @throws Cancelled.
std::vector<Json> run_voxelizers(const VoxelizerGroupInput& group, RunContext& context);

}  // namespace hermesh
