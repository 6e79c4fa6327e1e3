#include "experiments/harness/harness.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <nlohmann/json.hpp>
#include <ostream>

#include "experiments/cases/cases.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/provenance.h"
#include "experiments/harness/run_cells.h"
#include "experiments/harness/run_voxelizers.h"
#include "experiments/harness/table.h"
#include "experiments/harness/toml_section.h"

namespace hermesh {
namespace {

const Tier& find_tier(const Experiment& experiment, const std::string& name) {
  const auto tier = experiment.tiers.find(name);
  if (tier == experiment.tiers.end())
    throw Error("the experiment " + experiment.name + " has no tier \"" + name + "\"");
  return tier->second;
}

/// The variants whose cell "case/resolution/variant" contains the text; the label and the name both count as
/// variant.
std::vector<VariantEntry> filtered(const std::vector<VariantEntry>& variants, const std::string& cell,
                                   const std::string& text) {
  std::vector<VariantEntry> left;
  for (const VariantEntry& variant : variants)
    if ((cell + variant.label).find(text) != std::string::npos ||
        (cell + variant.name).find(text) != std::string::npos)
      left.push_back(variant);
  return left;
}

Json run_head(const Experiment& experiment, const RunSettings& settings) {
  Json head = {{"experiment", experiment.name}, {"tier", settings.tier}, {"question", experiment.question}};
  const Json origin = provenance(experiments_folder());
  head["run"] = origin.at("date").get<std::string>() + "-" + std::to_string(getpid());
  head.update(origin);
  if (!experiment.columns.empty()) head["columns"] = experiment.columns;
  if (!experiment.plots.empty()) head["plots"] = Json::array();
  for (const Plot& plot : experiment.plots) head["plots"].push_back(to_json(plot));
  if (experiment.kind == ExperimentKind::kExtraction) return head;
  const bool voxelization = experiment.kind == ExperimentKind::kVoxelization;
  head["kind"] = voxelization ? "voxelization" : "measurement";
  if (voxelization)
    head["band"] = {{"exterior", experiment.exterior_band}, {"interior", experiment.interior_band}};
  return head;
}

/// 3 for a broken promise or for judges that contradict one another, 1 for a variant that failed.
int exit_code(const std::vector<Json>& rows) {
  int code = 0;
  for (const Json& row : rows) {
    const auto any = [&](const char* key) { return row.contains(key) && !row.at(key).empty(); };
    if (any("broken") || any("disagreements")) return 3;
    if (row.contains("failed")) code = 1;
  }
  return code;
}

/// A folder for results. If nothing came into it, the destructor removes it again with those above that were made for it.
class ResultFolder {
 public:
  explicit ResultFolder(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::error_code error;
    for (std::filesystem::path at = std::filesystem::absolute(folder_).lexically_normal(); !at.empty() && !exists(at, error);
         at = at.parent_path())
      if (at.has_filename()) made_.push_back(at);
    std::filesystem::create_directories(folder_, error);
    if (!error) return;
    remove_empty();
    throw Error("cannot make the folder " + folder_.string() + ": " + error.message());
  }
  ~ResultFolder() { remove_empty(); }
  ResultFolder(const ResultFolder&) = delete;
  ResultFolder& operator=(const ResultFolder&) = delete;
  const std::filesystem::path& path() const { return folder_; }

 private:
  void remove_empty() const {
    std::error_code not_empty;
    for (const std::filesystem::path& made : made_) std::filesystem::remove(made, not_empty);
  }
  std::filesystem::path folder_;
  std::vector<std::filesystem::path> made_;  ///< the innermost first
};

/// The folder, if rows may go there.
std::filesystem::path kept_folder(const std::filesystem::path& out) {
  check_may_be_kept(out, experiments_folder().parent_path(), source_state());
  return out;
}

/// Runs the cells of a tier, one group after the other; every group's rows are on disk before the next one
/// starts.
class Run {
 public:
  Run(const RunSettings& settings, const Tables& tables, RunContext& context, std::ostream& table)
      : settings_(settings),
        tables_(tables),
        context_(context),
        table_(table),
        experiment_(read_experiment(settings.experiment, {tables.extractors, tables.voxelizers, tables.cases,
                                                          column_names(), tables.measurements})),
        tier_(find_tier(experiment_, settings.tier)),
        folder_(kept_folder(settings.out)),
        out_(folder_.path()),
        head_(run_head(experiment_, settings)) {}

  int run() {
    table_ << "## " << experiment_.name << " (" << settings_.tier << "): " << experiment_.question << "\n\n";
    const bool extraction = experiment_.kind == ExperimentKind::kExtraction;
    for (const CaseEntry& entry : tier_.cases) extraction ? run_case(entry) : voxelize_case(entry);
    if (experiment_.kind == ExperimentKind::kMeasurement) measure();
    if (rows_.empty())
      throw Error("no cell of " + experiment_.name + " contains \"" + settings_.filter +
                  "\" in its case/resolution/variant");
    if (experiment_.kind != ExperimentKind::kMeasurement) write_legend(rows_, table_);
    table_ << "\nRows: " << (out_ / "rows.jsonl").string() << "; pictures: " << (out_ / "*.png").string()
           << "\n";
    // Of all rows in the folder: earlier runs with another filter belong to the same picture.
    write_plots(read_rows(out_), out_, table_);
    return exit_code(rows_);
  }

 private:
  /// Every table of a measurement has columns of its own.
  void measure() {
    rows_ = run_measurement(experiment_, tier_, tables_, out_, settings_.filter, head_, context_,
                            [&](const Json& row) { append_row(out_ / "rows.jsonl", row); });
    for (const RowGroup& group : latest_groups(rows_)) {
      write_markdown(group, table_);
      write_legend(group.rows, table_);
      table_ << '\n';
    }
  }

  void run_case(const CaseEntry& entry) {
    std::optional<LoadedCase> input;
    for (const int resolution : entry.resolutions) {
      const std::string cell = entry.name + "/" + std::to_string(resolution) + "/";
      const std::vector<VariantEntry> variants = filtered(experiment_.variants, cell, settings_.filter);
      if (variants.empty()) continue;
      if (!input) input = tables_.load(entry.name, context_);
      for (const VariantEntry& voxelizer : experiment_.voxelizers)
        finish_group(run_group({.experiment = experiment_,
                                .tier = tier_,
                                .entry = entry,
                                .input = *input,
                                .resolution = resolution,
                                .voxelizer = voxelizer,
                                .variants = variants,
                                .tables = tables_,
                                .out = out_,
                                .head = head_},
                               context_));
    }
  }

  /// The rows of a sweep, and those of several voxel sizes, make one table.
  void voxelize_case(const CaseEntry& entry) {
    std::vector<Json> rows;
    const Sweep none{"", {0.0}};
    const Sweep& sweep = entry.sweep ? *entry.sweep : none;
    for (const double value : sweep.values) {
      const std::string cell = entry.name + "/" + (entry.sweep ? readable(value) + "/" : "");
      std::optional<LoadedCase> input, solid;
      const std::size_t sizes = entry.resolutions.size() + entry.voxel_sizes.size();
      for (std::size_t i = 0; i < sizes; ++i) {
        const bool by_size = !entry.voxel_sizes.empty();
        const std::vector<VariantEntry> left = filtered(
            experiment_.voxelizers,
            cell + (by_size ? readable(entry.voxel_sizes[i]) : std::to_string(entry.resolutions[i])) + "/",
            settings_.filter);
        if (left.empty()) continue;
        if (!input) input = load(entry.name, sweep, value);
        if (!solid && !entry.judged.solid.empty()) solid = load(entry.judged.solid, sweep, value);
        const double longest = bounds(input->mesh).size().maxCoeff();
        const double voxel_size = by_size
                                      ? entry.voxel_sizes[i] * (entry.length ? longest / *entry.length : 1.0)
                                      : longest / entry.resolutions[i];
        const Json head = cell_head(entry, *input, voxel_size, i, value);
        std::vector<Json> cells = run_voxelizers({.experiment = experiment_,
                                                  .tier = tier_,
                                                  .entry = entry,
                                                  .input = *input,
                                                  .solid = solid ? *solid : *input,
                                                  .voxel_size = voxel_size,
                                                  .voxelizers = left,
                                                  .tables = tables_,
                                                  .head = head},
                                                 context_);
        for (const Json& row : cells) append_row(out_ / "rows.jsonl", row);
        std::move(cells.begin(), cells.end(), std::back_inserter(rows));
      }
    }
    for (const RowGroup& group : latest_groups(rows)) write_markdown(group, table_);
    std::move(rows.begin(), rows.end(), std::back_inserter(rows_));
  }

  LoadedCase load(const std::string& name, const Sweep& sweep, double value) {
    return sweep.parameter.empty() ? tables_.load(name, context_)
                                   : tables_.load_changed(name, {{sweep.parameter, value}}, context_);
  }

  Json cell_head(const CaseEntry& entry, const LoadedCase& input, double voxel_size, std::size_t i,
                 double value) const {
    Json head = head_;
    head["case"] = case_json(input);
    if (entry.voxel_sizes.empty())
      head["resolution"] = entry.resolutions[i];
    else
      head["nominal_voxel_size"] = entry.voxel_sizes[i];
    head["voxel_size"] = voxel_size;
    if (!entry.published_seconds.empty()) head["published_seconds"] = entry.published_seconds[i];
    if (entry.sweep) head["sweep"] = {{"parameter", entry.sweep->parameter}, {"value", value}};
    const JudgedBy& judged = entry.judged;
    if (judged.signs != JudgedBy::Signs::kNone)
      head["judged_by"] = {{"signs", std::array{"none", "parity", "unanimous parity",
                                                "winding number"}[std::size_t(judged.signs)]},
                           {"solid", judged.solid.empty() ? entry.name : judged.solid}};
    return head;
  }

  void finish_group(std::vector<Json> rows) {
    for (const Json& row : rows) append_row(out_ / "rows.jsonl", row);
    write_markdown({rows, 0}, table_);
    table_.flush();
    rows_.insert(rows_.end(), std::make_move_iterator(rows.begin()), std::make_move_iterator(rows.end()));
  }

  const RunSettings& settings_;
  const Tables& tables_;
  RunContext& context_;
  std::ostream& table_;
  Experiment experiment_;
  const Tier& tier_;
  ResultFolder folder_;
  const std::filesystem::path& out_;
  Json head_;
  std::vector<Json> rows_;
};

}  // namespace

std::vector<ExperimentInfo> list_experiments() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(experiments_folder()))
    if (entry.path().extension() == ".toml" && entry.path().filename() != "cases.toml")
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::vector<ExperimentInfo> experiments;
  for (const auto& file : files) {
    ExperimentHead head = read_head(file);
    experiments.push_back({file.stem().string(), std::move(head.question), file, std::move(head.shows)});
  }
  return experiments;
}

std::filesystem::path experiment_file(const std::string& name) {
  if (const std::filesystem::path path = name; path.extension() == ".toml" || path.has_parent_path()) return path;
  std::vector<std::string> known;
  for (const ExperimentInfo& experiment : list_experiments()) {
    if (experiment.name == name || std::ranges::find(experiment.shows, name) != experiment.shows.end())
      return experiment.file;
    known.push_back(experiment.name);
    known.insert(known.end(), experiment.shows.begin(), experiment.shows.end());
  }
  throw Error("there is no experiment \"" + shown(name) + "\"; there are " + joined(likest_first(known, name)));
}

int run_experiment(const RunSettings& settings, const Tables& tables, RunContext& context,
                   std::ostream& table) {
  return Run(settings, tables, context, table).run();
}

Tables all_tables() {
  Tables tables{all_extractors(), all_voxelizers(), {}, load_case, load_changed_case};
  for (const CaseInfo& info : list_cases())
    if (info.kind != "volume") tables.cases.push_back(info.name);
  tables.measurements = {all_measurements().begin(), all_measurements().end()};
  return tables;
}

int run_experiment(const RunSettings& settings, RunContext& context, std::ostream& table) {
  return run_experiment(settings, all_tables(), context, table);
}

}  // namespace hermesh
