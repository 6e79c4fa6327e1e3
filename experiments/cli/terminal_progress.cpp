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
using Plan = std::vector<PlannedStage>;

void append(Plan& plan, const Plan& more) { plan.insert(plan.end(), more.begin(), more.end()); }

const Plan kVoxelize = {{"triangles to blocks", 0.02}, {"distances", 0.1}, {"signs", 0.45}, {"tree", 0.001}};
const Plan kSample = {{"ends of the data", 0.002},
                      {"Hermite data from the level set", 0.004},
                      {"Hermite data from the polygons", 0.15}};
const Plan kCollapse = {{"find cells", 0.002}, {"place points", 0.07}, {"let points leave", 0.03},
                        {"connect", 0.01},     {"try sheets", 0.001},  {"connect", 0.003},
                        {"move points", 0.02}, {"decimate", 0.06},     {"decimate", 0.04},
                        {"decimate", 0.2},     {"certify", 0.67},      {"decimate", 0.48},
                        {"certify", 0.57}};

constexpr std::string_view kErase = "\r\033[K";
// A line that wraps could not be rewritten in place; 79 columns is the narrowest terminal in use.
constexpr std::size_t kLongestStage = 70;

/// The line of the terminal. Never destroyed, because the thread that ends the process may erase it at any
/// time.
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

Plan plan_of(std::string_view command) {
  Plan plan;
  if (command == "remesh" || command == "voxelize") {
    append(plan, {{"read", 0.04}});
    append(plan, kVoxelize);
  }
  if (command == "voxelize") append(plan, {{"write volumes", 0.03}});
  if (command == "remesh") {
    append(plan, kSample);
    append(plan, kCollapse);
    append(plan, {{"write", 0.01}});
  }
  if (command == "remesh --error") {
    append(plan, {{"read", 0.04}, {"try larger voxels", 0.4}});
    // A rough mesh determines the voxel size of the next one.
    for (int pass = 0; pass < 2; ++pass) {
      append(plan, kVoxelize);
      append(plan, kSample);
      plan.insert(plan.end(), kCollapse.begin(), kCollapse.begin() + 7);
      append(plan, {{"compare", 0.2}});
    }
    plan.insert(plan.end(), kCollapse.begin() + 7, kCollapse.end());
    append(plan, {{"decimate", 0.2}, {"certify", 0.3}, {"prove", 0.5}, {"write", 0.01}});
  }
  if (command == "combine") {
    append(plan, {{"read", 0.03}, {"read", 0.03}});
    for (int operand = 0; operand < 2; ++operand) {
      append(plan, kVoxelize);
      append(plan, kSample);
    }
    append(plan, {{"combine level sets", 0.01}, {"combine Hermite data", 0.01}});
    append(plan, kCollapse);
    append(plan, {{"write", 0.01}});
  }
  if (command == "extract")
    append(plan, {{"read volume", 0.3},
                  {"ends of the data", 0.05},
                  {"place points", 0.3},
                  {"connect", 0.1},
                  {"write", 0.25}});
  return plan;
}

OverallProgress::OverallProgress(Plan plan) : plan_(std::move(plan)) {
  for (const PlannedStage& stage : plan_) total_ += stage.weight;
}

void OverallProgress::begin(std::string_view stage) {
  stage_ = stage;
  ended_ = false;
  base_ = done_;
  const auto planned = std::find_if(plan_.begin() + std::ptrdiff_t(next_), plan_.end(),
                                    [&](const PlannedStage& one) { return one.name == stage; });
  if (planned != plan_.end()) {
    double before = 0.0;
    for (auto one = plan_.begin(); one != planned; ++one) before += one->weight;
    next_ = std::size_t(planned - plan_.begin()) + 1;
    base_ = std::max(done_, before / total_);
    span_ = std::max(0.0, (before + planned->weight) / total_ - base_);
    return;
  }
  // The number of further stages is unknown: each gets a part of the rest, so that they never reach the last
  // stage. The part is small as long as planned stages are left.
  const double last = plan_.empty() ? 0.0 : plan_.back().weight / total_;
  const double part = next_ + 1 < plan_.size() ? 0.1 : 0.5;
  span_ = std::max(0.0, (1.0 - last - base_) * part);
}

double OverallProgress::update(std::string_view stage, double fraction) {
  fraction = std::clamp(std::isfinite(fraction) ? fraction : 0.0, 0.0, 1.0);
  if (plan_.size() == 1 && plan_[0].name.empty()) return done_ = std::max(done_, fraction);
  if (ended_ || stage != stage_) begin(stage);
  if (fraction >= 1.0) ended_ = true;
  return done_ = std::max(done_, base_ + span_ * fraction);
}

std::optional<double> OverallProgress::left(double done, double elapsed, double silence) {
  if (done < 0.02 || elapsed < 1.0) return std::nullopt;
  const double left = elapsed * (1.0 - done) / done - silence;
  return left < 0.0 ? std::nullopt : std::optional(left);
}

std::string duration_text(double seconds) {
  const auto whole = static_cast<long>(std::ceil(std::max(0.0, seconds)));
  if (whole < 100) return std::to_string(whole) + " s";
  const long minutes = (whole + 59) / 60;
  if (minutes < 100) return std::to_string(minutes) + " min";
  return std::to_string(minutes / 60) + " h " + std::to_string(minutes % 60) + " min";
}

TerminalProgress::TerminalProgress(RunContext& context, bool wanted, std::vector<PlannedStage> plan,
                                   std::chrono::milliseconds first_line)
    : context_(context), is_terminal_(isatty(STDERR_FILENO) == 1) {
  if (!plan.empty()) overall_.emplace(std::move(plan));
  if (!wanted) return;
  context_.on_progress = [this](std::string_view stage, double fraction) { show(stage, fraction); };
  thread_ = std::jthread([this, first_line](const std::stop_token& stop) {
    is_terminal_ ? repeat(stop) : write_lines(stop, first_line);
  });
}

TerminalProgress::~TerminalProgress() {
  context_.on_progress = nullptr;
  if (thread_.joinable()) thread_.request_stop(), thread_.join();
  erase_progress_line();
}

void TerminalProgress::show(std::string_view stage, double fraction) {
  const auto now = Clock::now();
  // It needs all stages, also those that are too short to be shown.
  if (overall_) fraction = overall_->update(stage, fraction);
  if (now < next_ && stage == stage_) return;
  const std::lock_guard lock(terminal().mutex);
  if (stage != stage_) stage_ = stage, stage_start_ = now;
  if (fraction != fraction_) fraction_ = fraction, fraction_time_ = now;
  if (now < next_) return;
  next_ = now + 100ms;
  if (is_terminal_) write_line(now, "");
}

std::string TerminalProgress::text(Clock::time_point now) const {
  char percent[16];
  std::snprintf(percent, sizeof percent, " %3.0f %%", 100.0 * std::clamp(fraction_, 0.0, 1.0));
  if (!overall_) return stage_.substr(0, kLongestStage) + percent;
  // The estimate is that of the last progress, so that it counts down while a stage reports nothing.
  const std::chrono::duration<double> elapsed = fraction_time_ - start_, silence = now - fraction_time_,
                                      of_stage = now - stage_start_;
  auto left = OverallProgress::left(fraction_, elapsed.count(), silence.count());
  // A stage that takes longer than the estimate of all disproves it.
  if (left && of_stage.count() > 2.0 * *left + 5.0) left.reset();
  return std::string(percent + 1) + (left ? ", " + duration_text(*left) + " left" : "") + ": " + stage_;
}

void TerminalProgress::write_line(Clock::time_point now, const std::string& end) {
  std::string line = text(now);
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
    // Nothing is written soon after the line was erased either, because a summary may follow.
    if (stop.stop_requested() || stage_.empty() || now - terminal().written < kSilence) continue;
    write_line(now, " (" + duration_text(std::chrono::duration<double>(now - stage_start_).count()) + ")");
  }
}

void TerminalProgress::write_lines(const std::stop_token& stop, std::chrono::milliseconds first_line) {
  std::unique_lock lock(terminal().mutex);
  for (std::chrono::milliseconds time = first_line; !stop.stop_requested(); time *= 2) {
    terminal().changed.wait_until(lock, stop, start_ + time, [] { return false; });
    if (stop.stop_requested()) return;
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    std::string line = text(now);
    if (overall_) line.erase(0, line.find_first_not_of(' '));
    write_to_terminal("hermesh: working for " + duration_text(seconds) + ", " + line + "\n");
  }
}

void erase_progress_line() noexcept {
  // A blocked terminal must not keep the process from ending.
  const std::unique_lock lock(terminal().mutex, 1s);
  if (std::exchange(terminal().line_is_shown, false)) write_to_terminal(kErase);
}

}  // namespace hermesh::cli
