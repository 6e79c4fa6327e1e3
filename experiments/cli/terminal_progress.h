// Progress on stderr: on a terminal one line, rewritten in place, with the progress of the whole command;
// elsewhere a line after a minute and each time that the duration has doubled.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "algorithms/core/run_context.h"

namespace hermesh::cli {

/// An expected stage, and its share of the command's time, in any unit.
struct PlannedStage {
  std::string name;  ///< as RunContext::progress() reports it; empty: the only stage, under any name
  double weight;
};

/// Returns the stages that a command usually runs, in their order, some more than once; empty for commands
/// without such an order. "remesh --error" is a command of its own. The weights are those of a scan of 70,000
/// triangles at 150 voxels.
std::vector<PlannedStage> plan_of(std::string_view command);

/// Computes the completed share of a plan, which never decreases: a stage that is not planned, or that
/// repeats once more than planned, takes a tenth of the rest before the last stage, or half if only that
/// stage is left.
class OverallProgress {
 public:
  explicit OverallProgress(std::vector<PlannedStage> plan);

  /// Takes the progress of a stage and returns that of all stages, 0 to 1. A stage begins with the fraction
  /// 0.
  double update(std::string_view stage, double fraction);

  /// Returns the seconds until the end, or none before a second and a fiftieth of the work. `elapsed` is the
  /// time until `done` was reached and `silence` the time since, in seconds; a silence that is longer than
  /// the estimate disproves it.
  static std::optional<double> left(double done, double elapsed, double silence = 0.0);

 private:
  void begin(std::string_view stage);

  std::vector<PlannedStage> plan_;
  double total_ = 0.0;
  std::size_t next_ = 0;  ///< the first stage of the plan that has not begun
  std::string stage_;
  double base_ = 0.0, span_ = 0.0, done_ = 0.0;
  bool ended_ = true;  ///< true if the stage has ended, so that the next one of its name is another
};

std::string duration_text(double seconds);  ///< "2 s", "3 min", "1 h 20 min"

/// Shows the context's progress during its lifetime if `wanted`; on a terminal at most ten updates a second.
/// With a plan the line has the progress of all stages and the remaining time, else the progress of the
/// stage. The destructor erases it. If a stage reports nothing for a second, a thread rewrites the line with
/// the time of the stage. If stderr is not a terminal, lines are written after `first_line` of work, twice as
/// long, and so on.
class TerminalProgress {
 public:
  TerminalProgress(RunContext& context, bool wanted, std::vector<PlannedStage> plan = {},
                   std::chrono::milliseconds first_line = std::chrono::minutes(1));
  ~TerminalProgress();
  TerminalProgress(const TerminalProgress&) = delete;
  TerminalProgress& operator=(const TerminalProgress&) = delete;

 private:
  using Clock = std::chrono::steady_clock;

  void show(std::string_view stage, double fraction);
  /// Writes the line of the time `now`; the caller holds the lock of the terminal.
  void write_line(Clock::time_point now, const std::string& end);
  /// Returns the progress, and the remaining time if it can be estimated.
  std::string text(Clock::time_point now) const;
  void repeat(const std::stop_token& stop);
  void write_lines(const std::stop_token& stop, std::chrono::milliseconds first_line);

  RunContext& context_;
  bool is_terminal_;
  Clock::time_point next_ = {}, start_ = Clock::now();
  std::optional<OverallProgress> overall_;
  // Read by the thread, and written only under the lock of the terminal.
  std::string stage_;
  double fraction_ = 0.0;
  Clock::time_point stage_start_ = {}, fraction_time_ = start_;
  std::jthread thread_;
};

/// Erases the line of progress if one is shown; may be called from any thread.
void erase_progress_line() noexcept;

}  // namespace hermesh::cli
