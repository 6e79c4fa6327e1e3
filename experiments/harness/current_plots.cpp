#include "experiments/harness/current_plots.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "experiments/cases/cases.h"
#include "experiments/harness/experiment_file.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/provenance.h"
#include "experiments/harness/run_cells.h"

namespace hermesh {

std::vector<Json> with_current_plots(std::vector<Json> rows, const std::filesystem::path& folder) {
  if (!is_kept(folder, experiments_folder().parent_path())) return rows;
  const std::vector<ExperimentInfo> experiments = list_experiments();
  std::map<std::string, Json> plots;  // null where there is no file
  for (Json& row : rows) {
    const std::string name = text_at(row, "/experiment");
    if (!plots.contains(name)) {
      const auto info = std::ranges::find(experiments, name, &ExperimentInfo::name);
      Json own;
      if (info != experiments.end()) {
        const Tables tables = all_tables();
        const Experiment experiment = read_experiment(
            info->file, {tables.extractors, tables.voxelizers, tables.cases, column_names(), tables.measurements});
        own = Json::array();
        for (const Plot& plot : experiment.plots) own.push_back(to_json(plot));
      }
      plots[name] = std::move(own);
    }
    if (!plots[name].is_null()) row["plots"] = plots[name];
  }
  return rows;
}

}  // namespace hermesh
