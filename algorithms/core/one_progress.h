// The progress of many stages as that of one.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "algorithms/core/run_context.h"

namespace hermesh {

/// Tells the progress of many stages as that of one, as long as it lives.
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

}  // namespace hermesh
