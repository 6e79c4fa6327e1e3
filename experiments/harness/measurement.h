// Measurements: experiments that one function makes as tables of values, without variants that compete.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/options.h"
#include "algorithms/core/run_context.h"
#include "experiments/harness/json_values.h"
#include "experiments/pipeline.h"

namespace hermesh {

struct Tables;

/// The input of a measurement.
struct MeasurementInput {
  const Options& parameters;
  std::uint64_t seed;
  const Tables& tables;       ///< of cases and methods
  std::filesystem::path out;  ///< directory of the run
  RunContext& context;
  /// Rows whose "measurement/table/label" does not contain it are dropped.
  std::string filter = {};
  /// Takes finished rows before those that the function returns, so that a measurement of hours can be
  /// interrupted without losing them; from one thread at a time.
  std::function<void(std::vector<struct MeasuredRow>)> emit = {};
  std::string name = {};            ///< of the measurement
  std::set<std::string> done = {};  ///< "table/label" of existing rows

  /// Returns true if a row with that label is missing and passes the filter. A measurement asks before it
  /// does the work for the row.
  bool wants(const std::string& table, const std::string& label) const {
    return !done.contains(table + "/" + label) &&
           (name + "/" + table + "/" + label).find(filter) != std::string::npos;
  }
  bool wants_any(const std::string& table, std::span<const char* const> labels) const {
    return std::ranges::any_of(labels, [&](const char* label) { return wants(table, label); });
  }
};

/// A row of one of its tables.
struct MeasuredRow {
  std::string table;
  std::string label;  ///< first column of the table, and curve of a plot
  Json values = {};   ///< by column: a number, text or truth value; a missing one is shown as "–"
  std::vector<std::string> broken = {};  ///< violated expectations; they make the exit code 3
};

struct MeasuredColumn {
  std::string name;     ///< the key in a row's values
  std::string header;   ///< short, with the unit in brackets
  std::string meaning;  ///< for the legend
};

struct MeasuredTable {
  std::string name;
  std::string title;
  std::string first_column;  ///< header of the labels
  std::vector<MeasuredColumn> columns;
  bool printed = true;    ///< false for rows that appear in plots only
  bool additive = false;  ///< rows of later runs with other labels or resolutions join those of earlier runs
};

/// See experiments/measurements.toml.
struct Measurement {
  std::string name;
  std::vector<OptionSpec> parameters;
  std::vector<MeasuredTable> tables;
  std::function<std::vector<MeasuredRow>(const MeasurementInput&)> measure;
};

/// Splits the value of a parameter at a separator.
std::vector<std::string> words_in(const std::string& list, char separator = ' ');
std::vector<double> numbers_in(const std::string& list, char separator = ' ');

/// Returns the cases of polygons.
std::vector<std::string> case_choices();

/// Voxelizes with the method "hermesh" and otherwise by the recipe.
LevelSet voxelized(const PolygonMesh& mesh, VoxelizeRecipe recipe, const MeasurementInput& input);

struct RepeatedExtraction {
  PolygonMesh mesh;
  RunContext context;          ///< of the last run
  double seconds;              ///< median
  std::optional<double> peak;  ///< memory of the first run, MiB
};
/// Extracts as often as the parameter "repetitions" states.
RepeatedExtraction extract_repeatedly(const LevelSet& level_set, const ExtractRecipe& recipe,
                                      const MeasurementInput& input);

/// Returns 1, 2, 4, … and the number of threads of the program.
std::vector<std::size_t> thread_counts();

/// A job of the laboratory (cells/serve.h).
struct MeasurementJob {
  std::string name;
  std::map<std::string, std::string> parameters = {};  ///< as given
  std::uint64_t seed = 1;                              ///< of its random numbers
  std::filesystem::path out = {};                      ///< directory of the run
  std::string filter = {};          ///< only rows whose "measurement/table/label" contains it
  std::set<std::string> done = {};  ///< "table/label" of rows that exist already
  Json head = Json::object();       ///< the first keys of all rows
};

/// Runs the measurement and returns its rows; `keep` receives each as soon as it is ready. A failure becomes
/// a row.
/// @throws Cancelled; Error for an unknown measurement or parameter, for a row of a table or a value of a
/// column that the measurement did not declare.
std::vector<Json> run_measurement(const MeasurementJob& job, const Tables& tables, RunContext& context,
                                  const std::function<void(const Json&)>& keep = {});

}  // namespace hermesh
