// Lap times of work that is done in turns.
#pragma once

#include <chrono>
#include <utility>

namespace hermesh {

/// Clock of the wall, which each reading starts anew.
class Stopwatch {
 public:
  /// Seconds since construction or since the last call.
  double seconds() {
    const auto now = std::chrono::steady_clock::now(), before = std::exchange(start_, now);
    return std::chrono::duration<double>(now - before).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace hermesh
