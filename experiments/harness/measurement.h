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

namespace hermesh {

struct Tables;

/// What a measurement is given.
struct MeasurementInput {
  const Options& parameters;  ///< those of its entry, from the tier of the file
  std::uint64_t seed;         ///< for its random numbers
  const Tables& tables;       ///< to load cases with, and to find variants in
  std::filesystem::path out;  ///< folder of the run
  RunContext& context;
  /// Rows whose "measurement/table/label" does not contain it are thrown away.
  std::string filter = {};
  /// Takes rows that are ready, before those that measure() returns, so that what takes hours can be cut
  /// short and loses nothing; from one thread at a time.
  std::function<void(std::vector<struct MeasuredRow>)> emit = {};
  std::string name = {};            ///< of the measurement
  std::set<std::string> done = {};  ///< "table/label" of rows that there are already

  /// Whether the filter leaves a row of that label. A measurement asks before it does what the row needs.
  bool wants(const std::string& table, const std::string& label) const {
    return !done.contains(table + "/" + label) &&
           (name + "/" + table + "/" + label).find(filter) != std::string::npos;
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

/// A measurement to be made (harness/job.h).
struct MeasurementJob {
  std::string name;
  std::map<std::string, std::string> parameters = {};  ///< as given
  std::uint64_t seed = 1;                              ///< of its random numbers
  std::filesystem::path out = {};                      ///< directory of the run
  std::string filter = {};          ///< only rows whose "measurement/table/label" contains it
  std::set<std::string> done = {};  ///< "table/label" of rows that exist already
  Json head = Json::object();       ///< the first keys of all rows
};

/// Makes the measurement and returns its rows; `keep` gets each as soon as it is ready. A failure is a row,
/// too.
/// @throws Cancelled; Error for an unknown measurement or parameter, for a row of a table or a value of a
/// column that the measurement did not declare.
std::vector<Json> run_measurement(const MeasurementJob& job, const Tables& tables, RunContext& context,
                                  const std::function<void(const Json&)>& keep = {});

}  // namespace hermesh
