// Measuring: times that resist a shared machine, and memory as the kernel counts it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace hermesh {

/// Sum over count; of at least one value.
double mean(const std::vector<double>& values);

/// Middle value; of an even number the mean of the two in the middle. 0 of none.
double median(std::vector<double> values);

using StageSeconds = std::vector<std::pair<std::string, double>>;

/// Median of every stage over the repetitions, in the order in which the stages first appear. A stage that
/// runs several times in one repetition counts with its sum; one that a repetition lacks counts there as 0.
StageSeconds median_stages(std::span<const StageSeconds> repetitions);

/// The peak of resident memory since construction, beyond what was resident then. The allocator first gives
/// back what it only hoards, and the kernel's high-water mark is reset; where that is not possible (no /proc,
/// or not writable) the figure is missing rather than wrong. One at a time: the mark belongs to the process.
class PeakMemory {
 public:
  PeakMemory();
  std::optional<std::int64_t> bytes() const;

 private:
  std::optional<std::int64_t> start_;
};

/// Seconds that `work` takes.
double timed(const std::function<void()>& work);

/// CPU seconds of the whole process so far, all threads, in the program and in the kernel.
double process_cpu_seconds();

/// One competitor in a race of repetitions.
struct Contender {
  std::function<double()> run;  ///< does the work once and returns its seconds
  double budget_seconds = 5.0;
  int repetitions = 5;
  std::vector<double> seconds;  ///< out: one entry a repetition
};

/// In rounds, so that a slow minute of a shared machine hits all alike. The order changes from round to round
/// so that over n rounds (2n if n is odd) each contender runs as often at each place and, within rounds, as
/// often after each other one (Williams, Experimental Designs Balanced for the Estimation of Residual Effects
/// of Treatments, 1949): what runs before matters, for memory that it gave back has to be fetched again. Each
/// contender runs at least once, then until it has `repetitions` or its own times have used up its budget. A
/// contender that already holds as many seconds as its budget does not run again.
void race(std::span<Contender> contenders);

}  // namespace hermesh
