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

/// Returns the mean of at least one value.
double mean(const std::vector<double>& values);

/// Returns the middle value; for an even number of values the mean of the two in the middle; 0 if there are
/// none.
double median(std::vector<double> values);

using StageSeconds = std::vector<std::pair<std::string, double>>;

/// Returns the median of every stage over the repetitions, in the order in which the stages first appear. A
/// stage that runs several times in one repetition counts with its sum; one that a repetition lacks counts
/// there as 0.
StageSeconds median_stages(std::span<const StageSeconds> repetitions);

/// Measures the peak of resident memory since construction, less the resident memory at construction. The
/// allocator first returns its unused memory, and the kernel's high-water mark is reset; where that is not
/// possible (no /proc, or not writable) the value is missing rather than wrong. Only one instance at a time:
/// the mark belongs to the process.
class PeakMemory {
 public:
  PeakMemory();
  std::optional<std::int64_t> bytes() const;

 private:
  std::optional<std::int64_t> start_;
};

/// Seconds that `work` takes.
double timed(const std::function<void()>& work);

/// Returns the CPU seconds of the whole process so far, all threads, in the program and in the kernel.
double process_cpu_seconds();

/// One contender of an interleaved timing.
struct Contender {
  std::function<double()> run;  ///< does the work once and returns its seconds
  double budget_seconds = 5.0;
  int repetitions = 5;
  std::vector<double> seconds;  ///< out: one entry a repetition
};

/// Runs the contenders in rounds, so that a slow minute of a shared machine affects all of them. The order
/// changes from round to round so that over n rounds (2n if n is odd) each contender runs equally often at
/// each position and, within rounds, after each other one (Williams, Experimental Designs Balanced for the
/// Estimation of Residual Effects of Treatments, 1949): the previous contender matters, since memory that it
/// released has to be fetched again. Each contender runs at least once, then until it has `repetitions` or
/// its own times have used up its budget. A contender that already has as many seconds as its budget does not
/// run again.
void race(std::span<Contender> contenders);

/// Does the same for work with equal numbers of repetitions and budgets; returns the seconds of each. If
/// `warm`, each runs once before, untimed, to warm caches and thread pools.
std::vector<std::vector<double>> race(const std::vector<std::function<double()>>& work, int repetitions,
                                      double budget_seconds = 1e9, bool warm = false);

}  // namespace hermesh
