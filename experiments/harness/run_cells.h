// One group of cells: an input at one resolution through one voxelizer, for all variants, judged and then
// timed.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "experiments/cases/cases.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/experiment_file.h"
#include "experiments/harness/harness.h"
#include "experiments/measurements/measurements.h"
#include "experiments/cases/recipes.h"
#include "experiments/harness/rows.h"

namespace hermesh {

/// What an experiment may name. Tests put toys here.
struct Tables {
  std::vector<Extractor> extractors;
  std::vector<Voxelizer> voxelizers;
  std::vector<std::string> cases;
  std::function<LoadedCase(const std::string& name, RunContext& context)> load;
  /// Loads a case with some parameters of its recipe changed.
  std::function<LoadedCase(const std::string& name, const RecipeParameters& changes, RunContext& context)>
      load_changed;
  std::vector<Measurement> measurements = {};
};

/// The tables of the program.
Tables all_tables();

/// run_experiment() of harness.h with the names to choose from given.
int run_experiment(const RunSettings& settings, const Tables& tables, RunContext& context,
                   std::ostream& table);

struct GroupInput {
  const Experiment& experiment;
  const Tier& tier;
  const CaseEntry& entry;
  const LoadedCase& input;
  int resolution;
  const VariantEntry& voxelizer;
  std::vector<VariantEntry> variants;  ///< those that the filter leaves
  const Tables& tables;
  std::filesystem::path out;
  const Json& head;  ///< what all rows of the run begin with
  CellWatch watch = {};
};

/// The rows, one for each variant, failed ones included; writes the meshes under out/meshes and the picture
/// out/CASE-RESOLUTION.png. @throws Cancelled; Error if a mesh or the picture cannot be written.
std::vector<Json> run_group(const GroupInput& group, RunContext& context);

}  // namespace hermesh
