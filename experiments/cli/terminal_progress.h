// Progress on the terminal: one line on stderr, rewritten in place.
#pragma once

#include <chrono>
#include <optional>
#include <string_view>
#include <vector>

#include "algorithms/core/run_context.h"
#include "experiments/cli/pipeline/overall_progress.h"

namespace hermesh::cli {

/// Shows the context's progress while it lives, if stderr is a terminal and `wanted`; at most ten updates a
/// second. With a plan the figure is that of all stages, with the time that is left; without, that of the stage. The line
/// is erased at the end, so that nothing of it stays on the screen.
class TerminalProgress {
 public:
  TerminalProgress(RunContext& context, bool wanted, std::vector<PlannedStage> plan = {});
  ~TerminalProgress();
  TerminalProgress(const TerminalProgress&) = delete;
  TerminalProgress& operator=(const TerminalProgress&) = delete;

 private:
  void show(std::string_view stage, double fraction);

  RunContext& context_;
  std::chrono::steady_clock::time_point next_ = {}, start_ = std::chrono::steady_clock::now();
  std::optional<OverallProgress> overall_;
};

/// Erases the line of progress if one is shown; may be called from any thread.
void erase_progress_line() noexcept;

}  // namespace hermesh::cli
