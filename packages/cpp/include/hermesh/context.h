// What a call shares with its caller while it works: progress, cancellation, notes.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hermesh/error.h"
#include "hermesh/export.h"

namespace hermesh::HERMESH_V1 {

/// Every call takes one, and may be given a fresh one for each (`Context()` where nothing is to be watched).
/// One context serves one call at a time; cancel() and cancelled() alone may be called at any time from any
/// thread.
/// @snippet main.cpp cancel
class Context {
 public:
  /// Called with the name of a stage and the share of it that is done, 0 to 1, from the thread that made the
  /// call. An exception that it throws ends the work, and comes out of the call in place of Cancelled.
  std::function<void(std::string_view stage, double fraction)> on_progress;

  /// Asks the call to stop: it throws Cancelled soon, within some tens of milliseconds. May be called from
  /// on_progress, from another thread and from a signal handler, and holds for later calls until reset().
  void cancel() noexcept { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const noexcept { return cancelled_.load(std::memory_order_relaxed); }
  /// Takes the request to stop back.
  void reset() noexcept { cancelled_.store(false, std::memory_order_relaxed); }

  /// Sentences that the user should read although the work went on, such as how much of a surface is thinner
  /// than a voxel. Each call adds to them, also one that throws.
  std::vector<std::string> notes;
  /// The stages that were completed, with their seconds, in the order of their ends.
  std::vector<std::pair<std::string, double>> stage_seconds;
  /// Figures of the work by name, such as `lost_surface_share`.
  std::vector<std::pair<std::string, double>> figures;

 private:
  friend struct Inside;
  std::atomic<bool> cancelled_ = false;
};

/// Limits the number of threads of all calls in the process while it lives; results are the same bytes at any
/// number. The least of several limits holds.
class HERMESH_API ThreadLimit {
 public:
  /// @param threads at least 1. @throws Error for less.
  explicit ThreadLimit(int threads);
  ~ThreadLimit();
  ThreadLimit(const ThreadLimit&) = delete;
  ThreadLimit& operator=(const ThreadLimit&) = delete;

 private:
  struct Limit;
  std::unique_ptr<Limit> limit_;
};

}  // namespace hermesh::HERMESH_V1
