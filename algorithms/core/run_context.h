// What a long piece of work shares with whoever started it: progress, cancellation, and where the time went.
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

/// What one run reports and obeys. Only cancelled() and check() may be called from any thread; the rest
/// belongs to the thread that runs the stages.
class RunContext {
 public:
  /// Callback with the name of the stage and the share of it that is done, 0 to 1; only the thread that runs
  /// the stage calls it.
  std::function<void(std::string_view stage, double fraction)> on_progress;
  /// Flag that somebody else (a signal handler, say) sets to ask for an early end; may be null.
  const std::atomic<bool>* cancel = nullptr;

  bool cancelled() const { return cancel && cancel->load(std::memory_order_relaxed); }
  /// @throws Cancelled if somebody asked for an early end. Cheap enough for once a leaf, from any thread.
  void check() const {
    if (cancelled()) throw Cancelled();
  }
  void progress(std::string_view stage, double fraction) const {
    if (on_progress) on_progress(stage, fraction);
  }
  /// A figure of the work that tables show, such as the bytes of what lies between two stages.
  void figure(std::string name, double value) { figures.emplace_back(std::move(name), value); }
  /// A sentence that the user should read although the work goes on, such as points that a file format
  /// rounds.
  void note(std::string sentence) { notes.push_back(std::move(sentence)); }

  std::vector<std::pair<std::string, double>> stage_seconds;  ///< stages in order of completion
  std::vector<std::string> notes;
  std::vector<std::pair<std::string, double>> figures;
};

/// Times a stage from construction to destruction, and announces it.
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

}  // namespace hermesh
