#include "experiments/cli/terminal_progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>
#include <utility>

namespace hermesh::cli {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kErase = "\r\033[K";
// A line that wraps could not be rewritten in place; 79 columns is the narrowest terminal in use.
constexpr std::size_t kLongestStage = 70;

/// The terminal's line. Never destroyed, since the thread that ends the process may erase it at any time.
struct Terminal {
  std::timed_mutex mutex;
  std::condition_variable_any changed;
  bool line_is_shown = false;
  std::chrono::steady_clock::time_point written = {};
};
Terminal& terminal() {
  static Terminal* const one = new Terminal;
  return *one;
}

void write_to_terminal(std::string_view text) {
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
  terminal().written = std::chrono::steady_clock::now();
}

}  // namespace

TerminalProgress::TerminalProgress(RunContext& context, bool wanted, std::vector<PlannedStage> plan)
    : context_(context) {
  if (!plan.empty()) overall_.emplace(std::move(plan));
  if (!wanted || !isatty(STDERR_FILENO)) return;
  context_.on_progress = [this](std::string_view stage, double fraction) { show(stage, fraction); };
  thread_ = std::jthread([this](const std::stop_token& stop) { repeat(stop); });
}

TerminalProgress::~TerminalProgress() {
  context_.on_progress = nullptr;
  if (thread_.joinable()) thread_.request_stop(), thread_.join();
  erase_progress_line();
}

void TerminalProgress::show(std::string_view stage, double fraction) {
  const auto now = Clock::now();
  // It has to know of all stages, also of those that are too short to be shown.
  if (overall_) fraction = overall_->update(stage, fraction);
  if (now < next_ && stage == stage_) return;
  const std::lock_guard lock(terminal().mutex);
  if (stage != stage_) stage_ = stage, stage_start_ = now;
  fraction_ = fraction;
  if (now < next_) return;
  next_ = now + 100ms;
  write_line(now, "");
}

void TerminalProgress::write_line(Clock::time_point now, const std::string& end) {
  char percent[16];
  std::snprintf(percent, sizeof percent, " %3.0f %%", 100.0 * std::clamp(fraction_, 0.0, 1.0));
  std::string line = stage_.substr(0, kLongestStage) + percent;
  if (overall_) {
    const std::chrono::duration<double> elapsed = now - start_;
    const auto left = OverallProgress::left(fraction_, elapsed.count());
    line = std::string(percent + 1) + (left ? ", " + duration_text(*left) + " left" : "") + ": " + stage_;
  }
  line.resize(std::min(line.size(), kLongestStage + 8 - end.size()));
  write_to_terminal(std::string(kErase) + line + end);
  terminal().line_is_shown = true;
}

void TerminalProgress::repeat(const std::stop_token& stop) {
  constexpr auto kSilence = 1s;
  std::unique_lock lock(terminal().mutex);
  while (!stop.stop_requested()) {
    terminal().changed.wait_for(lock, stop, kSilence / 4, [] { return false; });
    const auto now = Clock::now();
    // Nothing is written soon after the line was erased either: a summary may be about to take its place.
    if (stop.stop_requested() || stage_.empty() || now - terminal().written < kSilence) continue;
    write_line(now, " (" + duration_text(std::chrono::duration<double>(now - stage_start_).count()) + ")");
  }
}

void erase_progress_line() noexcept {
  // A terminal that takes nothing must not keep the process from ending.
  const std::unique_lock lock(terminal().mutex, 1s);
  if (std::exchange(terminal().line_is_shown, false)) write_to_terminal(kErase);
}

}  // namespace hermesh::cli
