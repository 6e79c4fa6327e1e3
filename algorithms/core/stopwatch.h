// Lap times of work that is done in turns.
#pragma once

#include <chrono>
#include <utility>

namespace hermesh {

class Stopwatch {
 public:
  /// Since it was made or asked last.
  double seconds() {
    const auto now = std::chrono::steady_clock::now(), before = std::exchange(start_, now);
    return std::chrono::duration<double>(now - before).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

}  // namespace hermesh
