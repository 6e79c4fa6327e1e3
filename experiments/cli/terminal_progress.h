// Progress on the terminal: one line on stderr, rewritten in place.
#pragma once

#include <chrono>
#include <string_view>

#include "algorithms/core/run_context.h"

namespace hermesh::cli {

/// Shows the context's progress while it lives, if stderr is a terminal and `wanted`; at most ten updates a
/// second. The line is erased at the end, so that nothing of it stays on the screen.
class TerminalProgress {
 public:
  TerminalProgress(RunContext& context, bool wanted);
  ~TerminalProgress();
  TerminalProgress(const TerminalProgress&) = delete;
  TerminalProgress& operator=(const TerminalProgress&) = delete;

 private:
  void show(std::string_view stage, double fraction);

  RunContext& context_;
  std::chrono::steady_clock::time_point next_ = {};
};

/// Erases the line of progress if one is shown; may be called from any thread.
void erase_progress_line() noexcept;

}  // namespace hermesh::cli
