// Measurements: experiments that are no race of variants over cases, but tables of figures that one function
// makes (errors of a code, bytes of a data structure, the rate of an operation).
//
// To add one:
//   1. In experiments/measurements/measure_NAME.cpp write a function from MeasurementInput to rows, and below it
//      `Measurement NAME_measurement()`: the name, the parameters with their defaults and ranges, the tables
//      with what their columns mean, and that function. Add the file to experiments/CMakeLists.txt.
//   2. Declare it at the end of this header, and enter it in the table in measurements.cpp.
//   3. Write experiments/questions/thesis/NAME.toml, or in the folder of another subject; normal_codes.toml explains the keys.
// For that it gets rows with commit, machine, seed and parameters, `hermesh run`, `hermesh report` in all its
// formats, and the plots that its file asks for.
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/options.h"
#include "algorithms/core/run_context.h"
#include "experiments/harness/columns.h"

namespace hermesh {

struct Experiment;
struct Tables;
struct Tier;

/// What a measurement is given.
struct MeasurementInput {
  const Options& parameters;  ///< those of its entry, from the tier of the file
  std::uint64_t seed;         ///< for its random numbers
  const Tables& tables;       ///< to load cases with, and to find variants in
  std::filesystem::path out;  ///< folder of the run
  RunContext& context;
  /// Rows whose "measurement/table/label" does not contain it are thrown away.
  std::string filter = {};
  /// Takes rows that are ready, before those that measure() returns, so that what takes hours can be cut short and
  /// loses nothing; from one thread at a time.
  std::function<void(std::vector<struct MeasuredRow>)> emit = {};
  std::string name = {};  ///< of the measurement
  std::set<std::string> done = {};  ///< "table/label" of rows that there are already

  /// Whether the filter leaves a row of that label. A measurement asks before it does what the row needs.
  bool wants(const std::string& table, const std::string& label) const {
    return !done.contains(table + "/" + label) && (name + "/" + table + "/" + label).find(filter) != std::string::npos;
  }
  bool wants_any(const std::string& table, std::span<const char* const> labels) const {
    return std::ranges::any_of(labels, [&](const char* label) { return wants(table, label); });
  }
};

/// A line of one of its tables.
struct MeasuredRow {
  std::string table;
  std::string label;  ///< who or what was measured: the first column, and a plot's curve
  Json values = {};   ///< a number, text or truth value by column; an absent one is shown as "–"
  std::vector<std::string> broken = {};  ///< what should hold and does not; makes the exit code 3
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
  bool printed = true;  ///< false for rows that are only there to be plotted
  /// Whether rows of a later run under other labels or of other resolutions join those of earlier runs: of
  /// tables that take hours, and whose rows need not be of one run because their times are not compared.
  bool additive = false;
};

struct Measurement {
  std::string name;
  std::string summary;                 ///< one line
  std::vector<OptionSpec> parameters;  ///< keys that a tier of the file may set
  std::vector<MeasuredTable> tables;
  std::function<std::vector<MeasuredRow>(const MeasurementInput&)> measure;
};

/// What a parameter lists, separated by blanks.
std::vector<std::string> words_in(const std::string& list);
std::vector<double> numbers_in(const std::string& list);

/// For a parameter that names a case: what it may be.
std::vector<std::string> case_choices();

/// The table of measurements.
std::span<const Measurement> all_measurements();

/// The measurement that the experiment names, as rows for rows.jsonl that begin with `head`; only those whose
/// "measurement/table/label" contains the filter and that are not among `done` ("table/label"). A failure is a row, too.
/// `keep` gets each as soon as it is ready.
/// @throws Cancelled; Error for a row of a table or a value of a column that the measurement did not declare.
std::vector<Json> run_measurement(const Experiment& experiment, const Tier& tier, const Tables& tables,
                                  const std::filesystem::path& out, const std::string& filter,
                                  const Json& head, RunContext& context,
                                  const std::function<void(const Json&)>& keep = {},
                                  const std::set<std::string>& done = {});

// Those that there are, each in its measure_….cpp.

Measurement normal_codes_measurement();
Measurement lost_crossings_measurement();
Measurement bounded_measurement();
Measurement hermite_memory_measurement();
Measurement hermite_csg_measurement();
Measurement hermite_speed_measurement();
Measurement table_9_2_measurement();
Measurement tables_9_3_and_9_4_measurement();
Measurement volumes_measurement();
Measurement guarantee_measurement();
Measurement fracture_measurement();
Measurement fracture_speed_measurement();
Measurement fracture_guarantee_measurement();
Measurement digests_measurement();
Measurement tests_measurement();
Measurement figure_9_1_measurement();
Measurement figure_9_3_measurement();
Measurement figure_9_4_measurement();
Measurement figure_9_6_measurement();
Measurement threads_measurement();
Measurement sampling_measurement();
Measurement arithmetic_measurement();
Measurement surface_noise_measurement();
Measurement reproductions_measurement();
Measurement stale_measurement();  // experiments/ledger/stale.cpp

}  // namespace hermesh
