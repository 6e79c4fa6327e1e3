// Progress on the terminal: one line on stderr, rewritten in place.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "algorithms/core/run_context.h"
#include "experiments/cli/pipeline/overall_progress.h"

namespace hermesh::cli {

/// Shows the context's progress while it lives, if stderr is a terminal and `wanted`; at most ten updates a
/// second. With a plan the figure is that of all stages, with the time that is left; without, that of the
/// stage. The line is erased at the end, so that nothing of it stays on the screen. Where a stage reports
/// nothing for a second, a thread writes the line again with the time that the stage has taken.
class TerminalProgress {
 public:
  TerminalProgress(RunContext& context, bool wanted, std::vector<PlannedStage> plan = {});
  ~TerminalProgress();
  TerminalProgress(const TerminalProgress&) = delete;
  TerminalProgress& operator=(const TerminalProgress&) = delete;

 private:
  using Clock = std::chrono::steady_clock;

  void show(std::string_view stage, double fraction);
  /// Writes the line as it is at `now`; the caller holds the lock of the terminal.
  void write_line(Clock::time_point now, const std::string& end);
  void repeat(const std::stop_token& stop);

  RunContext& context_;
  Clock::time_point next_ = {}, start_ = Clock::now();
  std::optional<OverallProgress> overall_;
  // Read by the thread, and changed under the lock of the terminal only.
  std::string stage_;
  double fraction_ = 0.0;
  Clock::time_point stage_start_ = {};
  std::jthread thread_;
};

/// Erases the line of progress if one is shown; may be called from any thread.
void erase_progress_line() noexcept;

}  // namespace hermesh::cli
