#include "experiments/ledger/stale.h"

#include <unistd.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "experiments/harness/cell.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/run_voxelizers.h"
#include "experiments/harness/table.h"
#include "experiments/ledger/value_class.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

/// Without what the declarations refuse. A row names all options, also those that have no effect beside the others, and those
/// that there were once; whether it mattered shows in what comes out.
std::map<std::string, std::string> accepted(const std::string& name, const std::vector<OptionSpec>& declared,
                                            std::map<std::string, std::string> options) {
  for (std::size_t tries = options.size(); tries > 0; --tries) {
    try {
      Options(name, declared, options);
      break;
    } catch (const Error& error) {
      const std::string sentence = error.what();
      const auto refused = std::ranges::find_if(
          options, [&](const auto& option) { return sentence.find("option '" + option.first + "'") != std::string::npos; });
      if (refused == options.end()) break;
      options.erase(refused);
    }
  }
  return options;
}

/// What was an option is a name now: the octree has been a variant of its own since it is not `merging=regions` any more.
std::string renamed(const std::string& name, std::map<std::string, std::string>& options, const char* option_now) {
  const auto merging = options.find("merging");
  if (merging == options.end()) return name;
  const std::string now = merging->second == "regions" ? "certified-octree" : "manifold-dual-contouring";
  options.erase(merging);
  if (!option_now) return now;
  options[option_now] = now;
  return name;
}

/// The variant of a row.
template <class Entry>
VariantEntry variant_of(const Json& json, const std::vector<Entry>& table) {
  VariantEntry variant{json.value("name", ""), json.value("label", ""), options_in(json.value("options", ""))};
  variant.name = renamed(variant.name, variant.options, nullptr);
  const auto known = std::ranges::find(table, variant.name, &Entry::name);
  if (known != table.end()) variant.options = accepted(variant.name, known->options, std::move(variant.options));
  return variant;
}

bool is_measurement(const Json& row) { return row.contains("measurement"); }
bool is_voxelization(const Json& row) { return row.value("kind", "") == "voxelization"; }

double seconds_of(const Json& row) {
  return number_at(row, "/seconds/median") + number_at(row, "/voxelization/seconds/median") +
         number_at(row, "/judge_seconds");
}

std::string name_of_cell(const Json& row) {
  std::string name = text_at(row, "/case/name");
  for (const char* part : {"/resolution", "/values/resolution", "/nominal_voxel_size", "/sweep/value", "/voxelization/label", "/variant/label"})
    if (const std::string text = text_at(row, part); !text.empty()) name += "/" + text;
  return name;
}

/// What is compared of a row, by its place: the digests, or the counts where it has none.
std::map<std::string, Json> outcome(const Json& row) {
  std::map<std::string, Json> values;
  const auto take = [&](const char* place) {
    if (const Json* value = find(row, place)) values[place] = *value;
  };
  if (row.contains("failed")) values["/failed"] = true;
  take("/digest");
  take("/values/digest");
  if (!values.empty()) return values;
  for (const char* place : {"/triangle_count", "/report/points", "/report/quads", "/report/boundary_edges",
                            "/report/non_manifold_edges", "/report/non_manifold_vertices", "/voxelization/active_voxels"})
    take(place);
  for (const Column& column : own_columns(row))
    if (const Json* value = find(row, column.pointer);
        value && (value->is_number_integer() || value->is_boolean()) && class_of(column, *value, row) == ValueClass::kExact)
      values[column.pointer] = *value;
  return values;
}

/// What differs between two rows of a cell, as a sentence; empty if nothing does.
std::string difference_of(const Json& row, const Json& made) {
  if (made.contains("failed") && !row.contains("failed")) return "fails: " + text_at(made, "/failed");
  for (const auto& [place, value] : outcome(row)) {
    const Json* const now = find(made, place);
    if (!now || *now != value) return place.substr(1) + " was " + value.dump() + ", now " + (now ? now->dump() : "nothing");
  }
  return {};
}

/// Compares rows of old with those made anew, matched by the names of their cells. Where several rows of a measurement have
/// one name (of one model at several angles, say), one that is the same is enough.
void compare(const std::vector<Json>& old, const std::vector<Json>& made, FolderCheck& check) {
  for (const Json& row : old) {
    ++check.tried;
    if (find(row, "/digest") || find(row, "/values/digest")) ++check.by_digest;
    std::string difference = "is no longer made";
    bool first = true;
    for (const Json& other : made) {
      if (name_of_cell(other) != name_of_cell(row)) continue;
      const std::string found = difference_of(row, other);
      if (first || found.empty()) difference = found;
      first = false;
      if (found.empty()) break;
    }
    if (difference.empty()) continue;
    ++check.differing;
    if (check.difference.empty()) check.difference = name_of_cell(row) + ": " + difference;
  }
}

/// Rows that are made together.
struct CellGroup {
  std::vector<Json> rows;
  double seconds = 0.0;
};

std::vector<CellGroup> groups_of(const std::vector<Json>& rows) {
  std::map<std::string, CellGroup> groups;
  for (const Json& row : rows) {
    if (text_at(row, "/variant/name").starts_with("command ")) continue;  // an outside program is not ours to make again
    std::string key = text_at(row, "/tier");
    const bool voxelization = is_voxelization(row);
    for (const char* part : {"/case/name", "/resolution", "/voxel_size", "/sweep/value"}) key += "/" + text_at(row, part);
    if (!voxelization) key += "/" + text_at(row, "/voxelization/label");
    groups[key].rows.push_back(row);
    groups[key].seconds += seconds_of(row);
  }
  std::vector<CellGroup> list;
  for (auto& [key, group] : groups) list.push_back(std::move(group));
  std::ranges::stable_sort(list, {}, &CellGroup::seconds);
  return list;
}

/// The input as the rows have it; nothing where it is not at hand, and then `skipped` says so.
std::optional<LoadedCase> input_of(const Json& row, const Tables& tables, RunContext& context, std::string& skipped) {
  const std::string name = text_at(row, "/case/name");
  if (text_at(row, "/case/origin").starts_with("stand-in")) {
    skipped = "stand-ins";
    return std::nullopt;
  }
  RunContext child = child_context(context, false);
  std::optional<LoadedCase> input;
  const auto failed = attempt([&] {
    input = find(row, "/sweep") ? tables.load_changed(name, {{text_at(row, "/sweep/parameter"), number_at(row, "/sweep/value")}}, child)
                                : tables.load(name, child);
  });
  if (!failed && input->sha256 == text_at(row, "/case/sha256")) return input;
  skipped = name + (failed ? ": " + *failed : " is not at hand as the rows have it");
  return std::nullopt;
}

/// The rows of a group made anew, without being judged more than a cell cannot do without.
std::vector<Json> made_again(const CellGroup& group, const LoadedCase& input, const Tables& tables,
                             const std::filesystem::path& scratch, RunContext& context) {
  const Json& first = group.rows.front();
  Experiment experiment;
  experiment.name = text_at(first, "/experiment");
  Tier tier;
  tier.repetitions = 1;
  tier.seconds_per_variant = 0.0;
  tier.samples = 1000;
  tier.pixels = 0;
  tier.self_intersections = false;
  CaseEntry entry;
  entry.name = input.name;
  std::vector<VariantEntry> variants;
  const bool voxelization = is_voxelization(first);
  for (const Json& row : group.rows)
    variants.push_back(voxelization ? variant_of(row.at("variant"), tables.voxelizers)
                                    : variant_of(row.at("variant"), tables.extractors));
  Json head = Json::object();
  if (!voxelization) {
    const auto resolution = static_cast<int>(number_at(first, "/resolution"));
    const VariantEntry voxelizer = variant_of(first.at("voxelization"), tables.voxelizers);
    return run_group({experiment, tier, entry, input, resolution, voxelizer, variants, tables, scratch, head}, context);
  }
  experiment.kind = ExperimentKind::kVoxelization;
  experiment.exterior_band = number_at(first, "/band/exterior");
  experiment.interior_band = number_at(first, "/band/interior");
  for (const char* key : {"case", "resolution", "nominal_voxel_size", "sweep"})
    if (first.contains(key)) head[key] = first.at(key);
  return run_voxelizers(
      {experiment, tier, entry, input, input, number_at(first, "/voxel_size"), variants, tables, head}, context);
}

void check_cells(const std::vector<Json>& rows, std::size_t groups, const Tables& tables,
                 const std::filesystem::path& scratch, RunContext& context, FolderCheck& check) {
  std::size_t done = 0;
  for (const CellGroup& group : groups_of(rows)) {
    if (done == groups) break;
    std::string why;
    const auto input = input_of(group.rows.front(), tables, context, why);
    if (!input) {
      check.skipped = why;
      continue;
    }
    ++done;
    Json named = group.rows.front();
    named.erase("variant");
    check.sample += (check.sample.empty() ? "" : ", ") + name_of_cell(named);
    std::vector<Json> made;
    // A variant or option that is gone makes the whole group fail, and each of its rows differ.
    const auto failed = attempt([&] { made = made_again(group, *input, tables, scratch, context); });
    if (failed && check.difference.empty()) check.difference = name_of_cell(named) + ": " + *failed;
    compare(group.rows, made, check);
  }
  if (done > 0) check.skipped.clear();
}

/// One row of each table, the one of least resolution.
std::vector<Json> sampled(const std::vector<Json>& rows) {
  std::map<std::string, Json> chosen;
  for (const Json& row : rows) {
    const std::string key = text_at(row, "/tier") + "/" + text_at(row, "/case/name");
    const auto place = chosen.find(key);
    if (place == chosen.end())
      chosen[key] = row;
    else if (number_at(row, "/values/resolution") < number_at(place->second, "/values/resolution"))
      place->second = row;
  }
  std::vector<Json> list;
  for (auto& [key, row] : chosen) list.push_back(std::move(row));
  return list;
}

bool same_inputs(const Json& row, const Json& made) {
  const Json *before = find(row, "/inputs"), *now = find(made, "/inputs");
  if (!before || !now) return true;  // rows of older programs do not name them
  return std::ranges::all_of(*now, [&](const Json& input) {
    return std::ranges::any_of(*before, [&](const Json& other) {
      return other.value("name", "") != input.value("name", "") || other.value("sha256", "") == input.value("sha256", "");
    });
  });
}

void check_measured(const std::vector<Json>& rows, const Tables& tables, const std::filesystem::path& scratch,
                    RunContext& context, FolderCheck& check) {
  for (const Json& row : sampled(rows)) {
    if (row.contains("failed")) continue;
    Experiment experiment;
    experiment.name = text_at(row, "/experiment");
    experiment.kind = ExperimentKind::kMeasurement;
    experiment.measurement = text_at(row, "/measurement/name");
    experiment.seed = static_cast<std::uint64_t>(number_at(row, "/measurement/seed"));
    Tier tier;
    tier.parameters = options_in(text_at(row, "/measurement/parameters"));
    renamed("", tier.parameters, "extractor");
    if (const auto known = std::ranges::find(tables.measurements, experiment.measurement, &Measurement::name);
        known != tables.measurements.end())
      tier.parameters = accepted(experiment.measurement, known->parameters, std::move(tier.parameters));
    std::vector<Json> made;
    const auto failed = attempt([&] {
      made = run_measurement(experiment, tier, tables, scratch,
                             experiment.measurement + "/" + text_at(row, "/case/name") + "/" + text_at(row, "/variant/label"),
                             Json::object(), context);
    });
    if (!made.empty() && !same_inputs(row, made.front())) {
      check.skipped = name_of_cell(row) + ": its input is not at hand as the rows have it";
      continue;
    }
    if (!failed && made.empty()) {
      // A row that follows from others, or whose label has changed, is not made when it is asked for alone.
      check.skipped = name_of_cell(row) + ": not made when asked for alone";
      continue;
    }
    check.sample += (check.sample.empty() ? "" : ", ") + name_of_cell(row);
    if (failed && check.difference.empty()) check.difference = name_of_cell(row) + ": " + *failed;
    compare({row}, made, check);
  }
  if (check.tried > 0) check.skipped.clear();
}

}  // namespace

FolderCheck check_folder(const std::vector<Json>& rows, std::size_t groups, const Tables& tables,
                         const std::filesystem::path& scratch, RunContext& context) {
  std::vector<Json> shown;
  for (const RowGroup& group : latest_groups(rows)) shown.insert(shown.end(), group.rows.begin(), group.rows.end());
  FolderCheck check;
  check.rows = shown.size();
  if (shown.empty())
    check.skipped = "no rows";
  else if (is_measurement(shown.front()))
    check_measured(shown, tables, scratch, context, check);
  else
    check_cells(shown, groups, tables, scratch, context, check);
  return check;
}

// ---- The measurement.

namespace {

/// Folders whose rows are about the program rather than made by it: what this measurement writes, and times alone.
bool is_about_rows(const std::string& experiment) { return experiment == "stale" || experiment == "reproductions"; }

std::vector<MeasuredRow> measure(const MeasurementInput& input) {
  const std::filesystem::path results = experiments_folder().parent_path() / "results";
  std::set<std::filesystem::path> folders;
  for (const auto& entry : std::filesystem::directory_iterator(results))
    if (entry.path().filename() != "local" && exists(entry.path() / "rows.jsonl")) folders.insert(entry.path());
  const std::filesystem::path scratch =
      std::filesystem::temp_directory_path() / ("hermesh-stale-" + std::to_string(getpid()));
  std::vector<MeasuredRow> rows;
  std::size_t done = 0;
  for (const auto& folder : folders) {
    input.context.check();
    const std::string name = folder.filename().string();
    input.context.progress("rows of " + name, double(done++) / double(folders.size()));
    if (!input.wants("folders", name) || is_about_rows(name)) continue;
    std::filesystem::create_directories(scratch);
    // The cells' own progress would flicker through that of the folders.
    RunContext child = child_context(input.context, false);
    const FolderCheck check =
        check_folder(read_rows(folder / "rows.jsonl"), static_cast<std::size_t>(input.parameters.number("groups")),
                     input.tables, scratch, child);
    std::filesystem::remove_all(scratch);
    MeasuredRow row{"folders", name};
    row.values = {{"rows", check.rows},           {"tried", check.tried},   {"by_digest", check.by_digest},
                  {"differing", check.differing}, {"sample", check.sample}, {"difference", check.difference},
                  {"skipped", check.skipped}};
    if (check.differing > 0) row.broken.push_back("stale: " + check.difference);
    if (input.emit)
      input.emit({row});
    else
      rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

Measurement stale_measurement() {
  return {"stale",
          "whether the present program still makes the rows of results/",
          {{"groups", "1", "how many cases at one resolution are made again of each folder, the cheapest first", {}, 1, 1000}},
          {{"folders",
            "rows of results/ made again",
            "folder",
            {{"rows", "rows", "rows that the folder shows"},
             {"tried", "tried", "of these, those that were made again"},
             {"by_digest", "by digest", "of these, those compared by digest; the others by their counts"},
             {"differing", "differ", "of these, those that came out otherwise, or can no longer be made"},
             {"sample", "sample", "which cells"},
             {"difference", "first difference", "cell, value then, value now"},
             {"skipped", "not tried", "why nothing was tried"}},
            true,
            true}},
          measure};
}

}  // namespace hermesh
