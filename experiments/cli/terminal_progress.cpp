#include "experiments/cli/terminal_progress.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <string>

namespace hermesh::cli {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kErase = "\r\033[K";
// A line that wraps could not be rewritten in place; 79 columns is the narrowest terminal in use.
constexpr std::size_t kLongestStage = 70;

std::atomic<bool> line_is_shown{false};

void write_to_terminal(std::string_view text) {
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

TerminalProgress::TerminalProgress(RunContext& context, bool wanted, std::vector<PlannedStage> plan) : context_(context) {
  if (!plan.empty()) overall_.emplace(std::move(plan));
  if (wanted && isatty(STDERR_FILENO))
    context_.on_progress = [this](std::string_view stage, double fraction) { show(stage, fraction); };
}

TerminalProgress::~TerminalProgress() {
  context_.on_progress = nullptr;
  erase_progress_line();
}

void TerminalProgress::show(std::string_view stage, double fraction) {
  const auto now = std::chrono::steady_clock::now();
  // It has to know of all stages, also of those that are too short to be shown.
  if (overall_) fraction = overall_->update(stage, fraction);
  if (now < next_) return;
  next_ = now + 100ms;
  char percent[16];
  std::snprintf(percent, sizeof percent, " %3.0f %%", 100.0 * std::clamp(fraction, 0.0, 1.0));
  std::string line = std::string(stage.substr(0, kLongestStage)) + percent;
  if (overall_) {
    const std::chrono::duration<double> elapsed = now - start_;
    const auto left = OverallProgress::left(fraction, elapsed.count());
    line = std::string(percent + 1) + (left ? ", " + duration_text(*left) + " left" : "") + ": " + std::string(stage);
    line.resize(std::min(line.size(), kLongestStage + 8));
  }
  write_to_terminal(std::string(kErase) + line);
  line_is_shown.store(true);
}

void erase_progress_line() noexcept {
  if (line_is_shown.exchange(false)) write_to_terminal(kErase);
}

}  // namespace hermesh::cli
