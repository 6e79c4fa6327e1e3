#include "experiments/harness/group_worker.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "experiments/harness/apart.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/command_extractor.h"
#include "experiments/harness/failures.h"
#include "experiments/harness/run_voxelizers.h"
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

/// The variants that the overrides name, those of the file first; @throws Error for a name that is nowhere.
template <class Table>
std::vector<VariantEntry> chosen(const std::vector<VariantEntry>& variants, const std::vector<std::string>& names,
                                 const Table& table) {
  if (names.empty()) return variants;
  std::vector<VariantEntry> left;
  for (const std::string& name : names) {
    const std::size_t before = left.size();
    for (const VariantEntry& variant : variants)
      if (variant.label == name || variant.name == name) left.push_back(variant);
    if (left.size() > before) continue;
    std::vector<std::string> known;
    for (const auto& each : table) known.push_back(each.name);
    if (std::ranges::find(known, name) == known.end()) {
      for (const VariantEntry& variant : variants)
        if (std::ranges::find(known, variant.label) == known.end()) known.push_back(variant.label);
      throw Error("there is no variant \"" + shown(name) + "\"; there are " + joined(likest_first(known, name)));
    }
    left.push_back({name, name, {}});
  }
  return left;
}

void override_cases(Tier& tier, const Overrides& overrides, const std::vector<std::string>& known) {
  if (!overrides.cases.empty() && !tier.cases.empty()) {
    std::vector<CaseEntry> left;
    for (const std::string& name : overrides.cases) {
      const std::size_t before = left.size();
      for (const CaseEntry& entry : tier.cases)
        if (entry.name == name) left.push_back(entry);
      if (left.size() > before) continue;
      if (std::ranges::find(known, name) == known.end() && !std::filesystem::is_regular_file(name))
        throw Error("there is no case \"" + shown(name) + "\", nor such a file; there are " + joined(likest_first(known, name)));
      CaseEntry entry;
      entry.name = name;
      entry.resolutions = tier.cases.front().resolutions;
      if (entry.resolutions.empty()) entry.resolutions = {100};
      left.push_back(std::move(entry));
    }
    tier.cases = std::move(left);
  }
  if (!overrides.resolutions.empty())
    for (CaseEntry& entry : tier.cases) {
      entry.resolutions = overrides.resolutions;
      entry.voxel_sizes.clear();
      entry.published_seconds.clear();
    }
  if (overrides.repetitions) tier.repetitions = *overrides.repetitions;
}

}  // namespace

Plan::Plan(const RunSettings& settings, const Tables& given) : tables(given) {
  experiment = read_experiment(settings.experiment,
                               {tables.extractors, tables.voxelizers, tables.cases, column_names(), tables.measurements});
  tier = find_tier(experiment, settings.tier);
  const Overrides& overrides = settings.overrides;
  if (experiment.kind == ExperimentKind::kMeasurement) {
    if (!overrides.variants.empty() || !overrides.cases.empty() || !overrides.resolutions.empty() || overrides.repetitions)
      throw Error(experiment.name + " is a measurement, which --variant, --case, --resolution and --repetitions do not change; "
                  "--filter chooses among its rows, and --set changes its parameters");
    for (const auto& [name, value] : overrides.parameters) tier.parameters[name] = value;
    const auto measurement = std::ranges::find(tables.measurements, experiment.measurement, &Measurement::name);
    Options(measurement->name, measurement->parameters, tier.parameters);  // throws for what the measurement does not know
    return;
  }
  if (!overrides.parameters.empty())
    throw Error(experiment.name + " is no measurement, and --set changes the parameters of one; --variant, --case, --resolution "
                "and --repetitions change this experiment");
  if (experiment.kind == ExperimentKind::kVoxelization)
    experiment.voxelizers = chosen(experiment.voxelizers, overrides.variants, tables.voxelizers);
  else
    experiment.variants = chosen(experiment.variants, overrides.variants, tables.extractors);
  override_cases(tier, overrides, tables.cases);
  for (const VariantEntry& variant : experiment.variants)
    if (!variant.command.empty()) tables.extractors.push_back(command_extractor(variant.name, variant.command));
}

Json to_json(const GroupId& id) { return {id.entry, id.sweep, id.size, id.voxelizer}; }
GroupId group_id(const Json& json) {
  const auto at = [&](std::size_t i) { return json.at(i).get<std::size_t>(); };
  return {at(0), at(1), at(2), at(3)};
}

GroupWorker::GroupWorker(const Plan& plan, std::filesystem::path out, std::string filter, RunContext& context)
    : plan_(plan), out_(std::move(out)), filter_(std::move(filter)), context_(context) {}

std::vector<GroupId> GroupWorker::groups() const {
  if (plan_.experiment.kind == ExperimentKind::kMeasurement) return {GroupId()};
  const bool extraction = plan_.experiment.kind == ExperimentKind::kExtraction;
  std::vector<GroupId> ids;
  for (std::size_t entry = 0; entry < plan_.tier.cases.size(); ++entry) {
    const CaseEntry& item = plan_.tier.cases[entry];
    for (std::size_t sweep = 0; sweep < (item.sweep ? item.sweep->values.size() : 1); ++sweep)
      for (std::size_t size = 0; size < item.resolutions.size() + item.voxel_sizes.size(); ++size)
        for (std::size_t voxelizer = 0; voxelizer < (extraction ? plan_.experiment.voxelizers.size() : 1); ++voxelizer)
          if (const GroupId id{entry, sweep, size, voxelizer}; !contenders(id).empty()) ids.push_back(id);
  }
  return ids;
}

std::vector<VariantEntry> GroupWorker::contenders(const GroupId& id) const {
  return filtered(plan_.experiment.contenders(), name_of(id), filter_);
}

std::string GroupWorker::name_of(const GroupId& id) const {
  if (plan_.tier.cases.empty()) return plan_.experiment.name + "/";
  const CaseEntry& entry = plan_.tier.cases[id.entry];
  return entry.name + "/" + (entry.sweep ? readable(entry.sweep->values[id.sweep]) + "/" : "") +
         (entry.voxel_sizes.empty() ? std::to_string(entry.resolutions[id.size]) : readable(entry.voxel_sizes[id.size])) + "/";
}

double GroupWorker::weight_of(const GroupId& id) const {
  const CaseEntry& entry = plan_.tier.cases[id.entry];
  double resolution = 0.0;
  if (entry.voxel_sizes.empty()) {
    resolution = entry.resolutions[id.size];
  } else {
    constexpr double kCoarsest = 100.0;
    const double longest = entry.length.value_or(kCoarsest * std::ranges::max(entry.voxel_sizes));
    resolution = longest / entry.voxel_sizes[id.size];
  }
  return double(contenders(id).size()) * resolution * resolution;
}

const LoadedCase& GroupWorker::input(const GroupId& id) { return loaded(plan_.tier.cases[id.entry].name, id, input_); }

std::vector<Json> GroupWorker::rows(const GroupId& id, const std::set<std::string>& left_out, const Json& head, const CellWatch& watch) {
  std::vector<VariantEntry> variants = contenders(id);
  std::erase_if(variants, [&](const VariantEntry& variant) { return left_out.contains(variant.label); });
  const CaseEntry& entry = plan_.tier.cases[id.entry];
  const LoadedCase& made = input(id);
  if (plan_.experiment.kind == ExperimentKind::kExtraction)
    return run_group({.experiment = plan_.experiment,
                      .tier = plan_.tier,
                      .entry = entry,
                      .input = made,
                      .resolution = entry.resolutions[id.size],
                      .voxelizer = plan_.experiment.voxelizers[id.voxelizer],
                      .variants = std::move(variants),
                      .tables = plan_.tables,
                      .out = out_,
                      .head = head,
                      .watch = watch},
                     context_);
  const bool by_size = !entry.voxel_sizes.empty();
  const double longest = bounds(made.mesh).size().maxCoeff();
  const double voxel_size = by_size ? entry.voxel_sizes[id.size] * (entry.length ? longest / *entry.length : 1.0)
                                    : longest / entry.resolutions[id.size];
  const LoadedCase& solid = entry.judged.solid.empty() ? made : loaded(entry.judged.solid, id, solid_);
  return run_voxelizers({.experiment = plan_.experiment,
                         .tier = plan_.tier,
                         .entry = entry,
                         .input = made,
                         .solid = solid,
                         .voxel_size = voxel_size,
                         .voxelizers = std::move(variants),
                         .tables = plan_.tables,
                         .head = cell_head(id, made, voxel_size, head),
                         .watch = watch},
                        context_);
}

void GroupWorker::measure(const std::set<std::string>& done, const Json& head, const std::function<void(const Json&)>& keep) {
  run_measurement(plan_.experiment, plan_.tier, plan_.tables, out_, filter_, head, context_, keep, done);
}

const LoadedCase& GroupWorker::loaded(const std::string& name, const GroupId& id, Loaded& kept) {
  const CaseEntry& entry = plan_.tier.cases[id.entry];
  const std::string key = name + (entry.sweep ? "/" + entry.sweep->parameter + "/" + std::to_string(id.sweep) : "");
  if (kept.input && kept.name == key) return *kept.input;
  kept = {};
  const auto sentence = attempt([&] {
    kept.input = entry.sweep ? plan_.tables.load_changed(name, {{entry.sweep->parameter, entry.sweep->values[id.sweep]}}, context_)
                             : plan_.tables.load(name, context_);
    // A resolution counts the voxels along the longest side, so an input without one has no voxel size.
    if (kept.input->mesh.triangle_count() == 0) throw Error("it holds no polygons");
    if (const double longest = bounds(kept.input->mesh).size().maxCoeff(); !(longest > 0.0) || !std::isfinite(longest))
      throw Error("its bounding box has no finite extent");
  });
  if (sentence) {
    kept = {};
    throw CaseUnreadable("the case " + name + " cannot be read: " + *sentence);
  }
  kept.name = key;
  return *kept.input;
}

Json GroupWorker::cell_head(const GroupId& id, const LoadedCase& made, double voxel_size, Json head) const {
  const CaseEntry& entry = plan_.tier.cases[id.entry];
  head["case"] = case_json(made);
  if (entry.voxel_sizes.empty())
    head["resolution"] = entry.resolutions[id.size];
  else
    head["nominal_voxel_size"] = entry.voxel_sizes[id.size];
  head["voxel_size"] = voxel_size;
  if (!entry.published_seconds.empty()) head["published_seconds"] = entry.published_seconds[id.size];
  if (entry.sweep) head["sweep"] = {{"parameter", entry.sweep->parameter}, {"value", entry.sweep->values[id.sweep]}};
  const JudgedBy& judged = entry.judged;
  if (judged.signs != JudgedBy::Signs::kNone)
    head["judged_by"] = {{"signs", std::array{"none", "parity", "unanimous parity",
                                              "winding number"}[std::size_t(judged.signs)]},
                         {"solid", judged.solid.empty() ? entry.name : judged.solid}};
  return head;
}

int serve_cells(const Tables& tables, RunContext& context) {
  std::string line;
  std::getline(std::cin, line);
  const Json job = Json::parse(line, nullptr, false);
  if (!job.is_object()) throw Error("this is what `hermesh run` starts for its cells; it takes a job on the standard input");
  const Answers answers(ChildProcess::kAnswers);
  auto next = std::chrono::steady_clock::now();
  context.on_progress = [&](std::string_view stage, double fraction) {
    using namespace std::chrono_literals;
    const auto now = std::chrono::steady_clock::now();
    if (now < next) return;
    next = now + 100ms;
    answers.send({{"stage", stage}, {"fraction", fraction}});
  };
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, job.at("threads").get<std::size_t>());
  try {
    require_data(job.at("require_data").get<bool>());
    RunSettings settings{job.at("experiment").get<std::string>(), job.at("tier").get<std::string>(),
                         job.at("out").get<std::string>(), job.at("filter").get<std::string>()};
    settings.overrides = {job.at("variants").get<std::vector<std::string>>(), job.at("cases").get<std::vector<std::string>>(),
                          job.at("resolutions").get<std::vector<int>>()};
    if (const int repetitions = job.at("repetitions").get<int>(); repetitions > 0) settings.overrides.repetitions = repetitions;
    settings.overrides.parameters = job.at("parameters").get<std::map<std::string, std::string>>();
    const Plan plan(settings, tables);
    GroupWorker worker(plan, settings.out, settings.filter, context);
    const auto left_out = job.at("left_out").get<std::set<std::string>>();
    const auto send = [&](const Json& row) { answers.send({{"row", row}}); };
    if (plan.experiment.kind == ExperimentKind::kMeasurement)
      worker.measure(left_out, job.at("head"), send);
    else
      for (const Json& row : worker.rows(group_id(job.at("group")), left_out, job.at("head"), answers.watch())) send(row);
    for (const std::string& note : context.notes) answers.send({{"note", note}});
    context.notes.clear();
    answers.send({{"done", true}});
  } catch (const DataMissing& error) {
    answers.send({{"error", error.what()}, {"missing", true}});
  } catch (const CaseUnreadable& error) {
    answers.send({{"error", error.what()}, {"unreadable", true}});
  } catch (const Cancelled&) {
    throw;
  } catch (const std::bad_alloc&) {
    answers.send({{"error", "there is not enough memory"}});
  } catch (const std::exception& error) {
    answers.send({{"error", error.what()}});
  }
  return 0;
}

}  // namespace hermesh
