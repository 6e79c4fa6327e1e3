// Progress, cancellation, notes, statistics (`figures`) and times of a run.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "algorithms/core/error.h"

namespace hermesh {

/// State of one run. Only cancelled() and check() may be called from any thread; the rest belongs to the
/// thread that runs the stages.
class RunContext {
 public:
  /// Callback with the name of the stage and its completed fraction, 0 to 1; only the thread that runs the
  /// stage calls it.
  std::function<void(std::string_view stage, double fraction)> on_progress;
  /// Flag set by a signal handler or another thread to request an early end; may be null.
  const std::atomic<bool>* cancel = nullptr;

  bool cancelled() const { return cancel && cancel->load(std::memory_order_relaxed); }
  /// @throws Cancelled if an early end was requested. Cheap enough for once a leaf, from any thread.
  void check() const {
    if (cancelled()) throw Cancelled();
  }
  void progress(std::string_view stage, double fraction) const {
    if (on_progress) on_progress(stage, fraction);
  }
  /// Adds a metric for tables, such as the bytes of an intermediate result.
  void figure(std::string name, double value) { figures.emplace_back(std::move(name), value); }
  /// Adds a warning, e.g. about points that a file format rounds.
  void note(std::string sentence) { notes.push_back(std::move(sentence)); }

  std::vector<std::pair<std::string, double>> stage_seconds;  ///< stages in order of completion
  std::vector<std::string> notes;
  std::vector<std::pair<std::string, double>> figures;
};

/// Times a stage from construction to destruction, and reports its begin and end.
class Stage {
 public:
  Stage(RunContext& context, std::string name)
      : context_(context), name_(std::move(name)), start_(std::chrono::steady_clock::now()) {
    context_.check();
    context_.progress(name_, 0.0);
  }
  ~Stage() {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    context_.stage_seconds.emplace_back(name_, elapsed.count());
    context_.progress(name_, 1.0);
  }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

 private:
  RunContext& context_;
  std::string name_;
  std::chrono::steady_clock::time_point start_;
};

/// Reports the progress of many stages as that of one during its lifetime.
class OneProgress {
 public:
  OneProgress(RunContext& context, std::string name)
      : context_(context), name_(std::move(name)), on_progress_(std::exchange(context.on_progress, {})) {
    update(0.0);
  }
  ~OneProgress() {
    update(1.0);
    context_.on_progress = on_progress_;
  }
  OneProgress(const OneProgress&) = delete;
  OneProgress& operator=(const OneProgress&) = delete;
  void update(double fraction) const {
    if (on_progress_) on_progress_(name_, fraction);
  }

 private:
  RunContext& context_;
  std::string name_;
  std::function<void(std::string_view stage, double fraction)> on_progress_;
};

/// Wall-clock lap times.
class Stopwatch {
 public:
  /// Returns the seconds since construction or since the last call.
  double seconds() {
    const auto now = std::chrono::steady_clock::now(), before = std::exchange(start_, now);
    return std::chrono::duration<double>(now - before).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace hermesh
