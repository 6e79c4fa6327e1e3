// Runs the module's functions in a thread of their own, with the interpreter's lock released, while the
// caller's thread delivers progress and checks for cancellation.
#pragma once

#include <pybind11/pybind11.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "hermesh/context.h"

namespace hermesh::python {

namespace py = pybind11;

/// Progress, cancellation and threads of a call, and its notes and times afterwards; one serves one call.
struct Watch {
  py::object progress;         ///< None or a callable of the stage's name and the share done, 0 to 1
  py::object cancel;           ///< None or something with is_set(), such as threading.Event
  std::optional<int> threads;  ///< maximum; none: all of the machine
  std::vector<std::string> notes = {};
  std::vector<std::pair<std::string, double>> stage_seconds = {}, figures = {};
};

/// Reports from the working thread to the waiting one.
class Reports {
 public:
  /// Called by the working thread. A report replaces an earlier unread one of the stage, except for its
  /// beginning, so that each stage is reported.
  void add(std::string_view stage, double fraction) {
    const std::lock_guard lock(mutex_);
    const bool replaces =
        !waiting_.empty() && waiting_.back().first == stage && waiting_.back().second > 0.0 && fraction > 0.0;
    if (replaces)
      waiting_.back().second = fraction;
    else
      waiting_.emplace_back(stage, fraction);
  }
  void finish() {
    const std::lock_guard lock(mutex_);
    finished_ = true;
    changed_.notify_one();
  }
  /// Waits for the end, for at most `time`. Returns true after the end, and the new reports.
  std::pair<bool, std::vector<std::pair<std::string, double>>> wait(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, time, [&] { return finished_; });
    return {finished_, std::exchange(waiting_, {})};
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::pair<std::string, double>> waiting_;
  bool finished_ = false;
};

/// Runs work(Context&) for a Python function. The caller's thread checks for Ctrl-C, because the interpreter
/// does so only in its main thread, and some stages do not report for seconds. An exception of the callback
/// or the signal, or Cancelled if the cancel object is set, ends the work and is rethrown after its end.
template <class Work>
auto watched(Watch& watch, Work&& work) {
  using Result = std::invoke_result_t<Work, Context&>;
  static constexpr std::chrono::milliseconds kBetweenLooks(20);
  std::optional<ThreadLimit> limit;
  if (watch.threads) limit.emplace(*watch.threads);

  Context context;
  Reports reports;
  std::optional<Result> result;
  std::exception_ptr thrown, raised;
  context.on_progress = [&](std::string_view stage, double fraction) { reports.add(stage, fraction); };
  std::thread worker([&] {
    try {
      result.emplace(work(context));
    } catch (...) {
      thrown = std::current_exception();
    }
    reports.finish();
  });

  for (bool finished = false; !finished;) {
    std::vector<std::pair<std::string, double>> news;
    {
      const py::gil_scoped_release others_may_run;
      std::tie(finished, news) = reports.wait(kBetweenLooks);
    }
    if (raised) continue;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!watch.progress.is_none())
        for (const auto& [stage, fraction] : news) watch.progress(stage, fraction);
      if (!watch.cancel.is_none() && watch.cancel.attr("is_set")().template cast<bool>()) throw Cancelled();
    } catch (...) {
      raised = std::current_exception();
      context.cancel();
    }
  }
  worker.join();
  watch.notes = std::move(context.notes);
  watch.stage_seconds = std::move(context.stage_seconds);
  watch.figures = std::move(context.figures);
  if (raised) std::rethrow_exception(raised);
  if (thrown) std::rethrow_exception(thrown);
  return std::move(*result);
}

/// Returns a Python function of the parameters and a Watch that calls `function` with the parameters and a
/// context.
template <class... Parameters, class Function>
auto watching(Function function) {
  return [function](Parameters... given, Watch& watch) {
    return watched(watch, [&](Context& context) { return function(given..., context); });
  };
}

}  // namespace hermesh::python
