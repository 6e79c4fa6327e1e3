// What the cells of every kind of experiment share: contexts, failures, times, and what a row says of them.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "experiments/harness/job.h"
#include "experiments/measure.h"

namespace hermesh {

/// A context for one piece of work: its own stage times, the same cancellation; progress only where wanted,
/// since a terminal has no business inside a timed repetition.
RunContext child_context(const RunContext& context, bool with_progress);

/// The sentence of what went wrong, if anything did. Being cancelled and data that are not there are no
/// failures of a variant. @throws Cancelled; DataMissing.
std::optional<std::string> attempt(const std::function<void()>& work);

/// Says in the row that its cell failed, and why.
void mark_failed(Json& row, const std::string& sentence);
/// Says that its program is not installed: there are no figures, as where a cell failed, and it is no failure
/// of the run.
void mark_absent(Json& row, const std::string& reason);

/// Times of one piece of work that is repeated. The first run, which is also judged, warms caches and pools
/// up and does not count, unless it alone uses up the budget: then it is the only repetition there is.
struct Timing {
  Contender contender;
  std::vector<StageSeconds> stages;
  std::vector<double> cpu_seconds;
  bool warm = true;

  Timing(const GroupJob& job, double first_seconds, StageSeconds first_stages);
};

/// Returns the load averages over 1, 5 and 15 minutes, null if the system does not provide them.
Json load_averages();

/// A cell that takes part in a race.
struct Racer {
  Timing& timing;
  Json& row;
  std::function<double()> repeat;  ///< does the work once more and returns its seconds
};
/// Races the cells (race()), and writes the seconds, those of the stages and the machine's load before it in
/// their rows.
void race_cells(std::vector<Racer> racers);

Json seconds_json(const std::vector<double>& seconds, bool warm);
Json stages_json(const std::vector<StageSeconds>& repetitions);
Json optional_json(const std::optional<std::int64_t>& value);
Json case_json(const LoadedCase& input);
Json variant_json(const VariantEntry& variant, const Options& options);

/// A label as a part of a file's name.
std::string file_name(std::string label);

}  // namespace hermesh
