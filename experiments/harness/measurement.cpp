#include "experiments/harness/measurement.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <sstream>

#include "experiments/harness/cell.h"
#include "experiments/harness/job.h"

namespace hermesh {
namespace {

/// @throws Error for data that the measurement did not declare, because no report would show them.
const MeasuredTable& table_of(const MeasuredRow& row, const Measurement& measurement) {
  const auto named = [](const std::string& name) {
    return [&](const auto& each) { return each.name == name; };
  };
  const std::string who = "the measurement " + measurement.name + " gave a row of ";
  const auto table = std::ranges::find_if(measurement.tables, named(row.table));
  if (table == measurement.tables.end()) throw Error(who + "an unknown table \"" + row.table + "\"");
  for (const auto& [key, value] : row.values.items())
    if (std::ranges::none_of(table->columns, named(key)))
      throw Error(who + row.table + " with an unknown column \"" + key + "\"");
  return *table;
}

const Measurement& find_measurement(std::span<const Measurement> table, const std::string& name) {
  const auto found = std::ranges::find(table, name, &Measurement::name);
  if (found == table.end()) throw Error("there is no measurement \"" + name + "\"");
  return *found;
}

/// Everything that a report needs, so that it does not depend on the program that made the row.
Json to_json(const MeasuredTable& table) {
  Json columns = Json::array();
  for (const MeasuredColumn& column : table.columns)
    columns.push_back({{"name", column.name}, {"header", column.header}, {"meaning", column.meaning}});
  Json result = {{"title", table.title},
                 {"first_column", table.first_column},
                 {"columns", columns},
                 {"printed", table.printed}};
  if (table.additive) result["additive"] = true;
  return result;
}

Json row_json(const Json& head, const std::string& table, const std::string& label) {
  Json row = head;
  row["case"] = {{"name", table}};
  row["variant"] = {{"name", label}, {"label", label}};
  return row;
}

}  // namespace

std::vector<std::string> words_in(const std::string& list, char separator) {
  std::istringstream stream(list);
  std::vector<std::string> words;
  for (std::string word; std::getline(stream, word, separator);) words.push_back(word);
  return words;
}

std::vector<double> numbers_in(const std::string& list, char separator) {
  std::vector<double> numbers;
  for (const std::string& word : words_in(list, separator)) numbers.push_back(std::stod(word));
  return numbers;
}

std::vector<std::string> case_choices() {
  std::vector<std::string> names;
  for (const CaseInfo& info : list_cases())
    if (info.kind != "volume") names.push_back(info.name);
  return names;
}

LevelSet voxelized(const PolygonMesh& mesh, VoxelizeRecipe recipe, const MeasurementInput& input) {
  recipe.chosen = choose(input.tables.voxelizers, "hermesh");
  return voxelize(mesh, recipe, input.context);
}

RepeatedExtraction extract_repeatedly(const LevelSet& level_set, const ExtractRecipe& recipe,
                                      const MeasurementInput& input) {
  RepeatedExtraction result;
  std::vector<double> seconds;
  for (int run = 0; run < int(input.parameters.number("repetitions")); ++run) {
    input.context.check();
    result.mesh = {};
    result.context = child_context(input.context, false);
    const PeakMemory memory;
    seconds.push_back(timed([&] { result.mesh = extract(level_set, nullptr, recipe, result.context).mesh; }));
    if (const auto peak = memory.bytes(); run == 0 && peak) result.peak = double(*peak) / (1 << 20);
  }
  result.seconds = median(seconds);
  return result;
}

std::vector<std::size_t> thread_counts() {
  const std::size_t most = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  std::vector<std::size_t> counts;
  for (std::size_t count = 1; count < most; count *= 2) counts.push_back(count);
  counts.push_back(most);
  return counts;
}

std::vector<Json> run_measurement(const MeasurementJob& job, const Tables& tables, RunContext& context,
                                  const std::function<void(const Json&)>& keep) {
  const Measurement& measurement = find_measurement(tables.measurements, job.name);
  const Options parameters(measurement.name, measurement.parameters, job.parameters);
  Json full_head = job.head;
  full_head["measurement"] = {
      {"name", measurement.name}, {"parameters", parameters.canonical()}, {"seed", job.seed}};
  full_head["load"] = load_averages();

  std::vector<Json> rows;
  const auto add = [&](Json row) {
    if (keep) keep(row);
    rows.push_back(std::move(row));
  };
  // Cases that the measurement loads are inputs of the rows that follow.
  Tables recorded = tables;
  const auto record = [&](LoadedCase loaded) {
    Json entry = {{"name", loaded.name}, {"origin", loaded.origin}, {"sha256", loaded.sha256}};
    Json& inputs = full_head["inputs"];
    if (std::ranges::find(inputs, entry) == inputs.end()) inputs.push_back(std::move(entry));
    return loaded;
  };
  full_head["inputs"] = Json::array();
  recorded.load = [&](const std::string& name, RunContext& loading) {
    return record(tables.load(name, loading));
  };
  recorded.load_changed = [&](const std::string& name, const RecipeParameters& changes, RunContext& loading) {
    return record(tables.load_changed(name, changes, loading));
  };
  MeasurementInput input{parameters, job.seed, recorded,         job.out, context,
                         job.filter, {},       measurement.name, job.done};
  const auto start = std::chrono::steady_clock::now();
  const auto take = [&](const std::vector<MeasuredRow>& measured) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    full_head["measurement"]["seconds"] = elapsed.count();
    for (const MeasuredRow& each : measured) {
      const MeasuredTable& table = table_of(each, measurement);
      if (!input.wants(each.table, each.label)) continue;
      Json row = row_json(full_head, each.table, each.label);
      row["table"] = to_json(table);
      row["values"] = each.values.is_null() ? Json::object() : each.values;
      if (!each.broken.empty()) row["broken"] = each.broken;
      add(std::move(row));
    }
  };
  input.emit = take;
  std::vector<MeasuredRow> measured;
  if (const auto failure = attempt([&] { measured = measurement.measure(input); })) {
    Json row = row_json(full_head, measurement.name, measurement.name);
    row["failed"] = *failure;
    add(std::move(row));
    return rows;
  }
  take(measured);
  return rows;
}

}  // namespace hermesh
