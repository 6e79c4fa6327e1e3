// Shared by the cells of all kinds of experiments: contexts, failures, times and parts of rows.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "experiments/harness/job.h"
#include "experiments/measure.h"

namespace hermesh {

/// Returns a context with its own stage times and the same cancellation, and with progress unless it is for a
/// timed repetition.
RunContext child_context(const RunContext& context, bool with_progress);

/// Returns the error message of the work, if it fails. @throws Cancelled and DataMissing, which are no
/// failures of a method.
std::optional<std::string> attempt(const std::function<void()>& work);

/// Marks a row as failed.
void mark_failed(Json& row, const std::string& sentence);
/// Marks the program of a row as not installed: the row has no values, but the run has not failed.
void mark_absent(Json& row, const std::string& reason);

/// Times of repeated work. The first run, whose result is validated, warms caches and thread pools and does
/// not count, unless it uses up the budget: then it is the only repetition.
struct Timing {
  Contender contender;
  std::vector<StageSeconds> stages;
  std::vector<double> cpu_seconds;
  bool warm = true;

  Timing(const GroupJob& job, double first_seconds, StageSeconds first_stages);
};

/// Returns the load averages over 1, 5 and 15 minutes, null if the system does not provide them.
Json load_averages();

/// A cell that is timed.
struct Racer {
  Timing& timing;
  Json& row;
  std::function<double()> repeat;  ///< does the work once more and returns its seconds
};
/// Times the cells interleaved (race()), and adds the seconds, those of the stages and the machine's load
/// before to their rows.
void race_cells(std::vector<Racer> racers);

Json seconds_json(const std::vector<double>& seconds, bool warm);
Json stages_json(const std::vector<StageSeconds>& repetitions);
Json optional_json(const std::optional<std::int64_t>& value);
Json case_json(const LoadedCase& input);
Json variant_json(const VariantEntry& variant, const Options& options);

/// Replaces the characters of a label that do not belong in a file name.
std::string file_name(std::string label);

/// Runs a group of cells of extractors: validates the meshes and then times the methods. Returns a row for
/// each, failed ones included; writes the meshes and the picture. @throws Cancelled; Error if a mesh or the
/// picture cannot be written.
std::vector<Json> run_group(const GroupJob& job, const LoadedCase& input, const Tables& tables,
                            const CellWatch& watch, RunContext& context);

/// Does the same for voxelizers. `solid`: whose signs are the reference, mostly the input; `voxel_size`:
/// world units.
/// @throws Cancelled.
std::vector<Json> run_voxelizers(const GroupJob& job, const LoadedCase& input, const LoadedCase& solid,
                                 double voxel_size, const Tables& tables, const CellWatch& watch,
                                 RunContext& context);

}  // namespace hermesh
