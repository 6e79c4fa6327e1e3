// Progress, cancellation and notes of a call.
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

/// Parameter of every call; a new one may be given to each (`Context()`). One context serves one call at a
/// time; only cancel() and cancelled() may be called at any time from any thread.
/// @snippet main.cpp cancel
class Context {
 public:
  /// Called with the name of a stage and its completed share, 0 to 1, from the thread that made the call. An
  /// exception that it throws ends the work, and the call throws it instead of Cancelled.
  std::function<void(std::string_view stage, double fraction)> on_progress;

  /// Stops the call, which throws Cancelled within a few tens of milliseconds. May be called from
  /// on_progress, from another thread and from a signal handler, and holds for later calls until reset().
  void cancel() noexcept { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const noexcept { return cancelled_.load(std::memory_order_relaxed); }
  /// Withdraws the cancellation.
  void reset() noexcept { cancelled_.store(false, std::memory_order_relaxed); }

  /// Warnings, such as the share of a surface that is thinner than a voxel. Each call appends to them, also
  /// one that throws.
  std::vector<std::string> notes;
  /// The completed stages with their seconds, in the order of their ends.
  std::vector<std::pair<std::string, double>> stage_seconds;
  /// Statistics by name, such as `lost_surface_share`.
  std::vector<std::pair<std::string, double>> figures;

 private:
  friend struct Inside;
  std::atomic<bool> cancelled_ = false;
};

/// Limits the number of threads of all calls in the process during its lifetime; results have the same bytes
/// at any number. The smallest of several limits holds.
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
