#include "experiments/measure.h"

#include <sys/resource.h>
#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <chrono>
#include <fstream>
#include <numeric>

namespace hermesh {
namespace {

/// A line such as "VmHWM:     1234 kB" of /proc/self/status, in bytes.
std::optional<std::int64_t> status_bytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  std::string word;
  while (status >> word) {
    std::int64_t kibibytes = 0;
    if (word == key + ":" && status >> kibibytes) return kibibytes * 1024;
    std::getline(status, word);
  }
  return std::nullopt;
}

/// "5" sets the high-water mark to the memory that is resident now (Linux 4.0 and later).
bool reset_high_water_mark() {
  std::ofstream clear("/proc/self/clear_refs");
  clear << "5" << std::flush;
  return clear.good();
}

}  // namespace

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  const std::size_t middle = values.size() / 2;
  return values.size() % 2 ? values[middle] : 0.5 * (values[middle - 1] + values[middle]);
}

StageSeconds median_stages(std::span<const StageSeconds> repetitions) {
  std::vector<std::pair<std::string, std::vector<double>>> table;
  for (std::size_t r = 0; r < repetitions.size(); ++r)
    for (const auto& [name, seconds] : repetitions[r]) {
      auto row =
          std::find_if(table.begin(), table.end(), [&](const auto& entry) { return entry.first == name; });
      if (row == table.end())
        row = table.insert(table.end(), {name, std::vector<double>(repetitions.size())});
      row->second[r] += seconds;
    }
  StageSeconds result;
  for (auto& [name, seconds] : table) result.emplace_back(name, median(std::move(seconds)));
  return result;
}

PeakMemory::PeakMemory() {
#if defined(__GLIBC__)
  malloc_trim(0);
#endif
  const bool reset = reset_high_water_mark();
  const auto resident = status_bytes("VmRSS"), peak = status_bytes("VmHWM");
  // Kernels count resident pages in batches per thread, so a mark just reset may be slightly above the
  // present value. A mark far above it was not reset in spite of the kernel's answer; differences to it mean
  // nothing.
  constexpr std::int64_t kBatches = 16 << 20;
  if (reset && resident && peak && *peak <= *resident + kBatches) start_ = std::max(*resident, *peak);
}

std::optional<std::int64_t> PeakMemory::bytes() const {
  const auto peak = status_bytes("VmHWM");
  if (!start_ || !peak) return std::nullopt;
  return std::max<std::int64_t>(0, *peak - *start_);
}

double timed(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double process_cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

namespace {

/// Returns the contender at a position of a round, see race(): 0, 1, n − 1, 2, n − 2, …, rotated by one in
/// every round; if n is odd, every other round is mirrored.
std::size_t runner(std::size_t position, std::size_t round, std::size_t n) {
  if (n % 2 == 1 && round % 2 == 1) position = n - 1 - position;
  const std::size_t step = (position + 1) / 2;
  return (round + (position % 2 == 1 ? step : n - step)) % n;
}

}  // namespace

void race(std::span<Contender> contenders) {
  const auto wants_more = [](const Contender& contender) {
    const double used = std::accumulate(contender.seconds.begin(), contender.seconds.end(), 0.0);
    return contender.seconds.empty() || (static_cast<int>(contender.seconds.size()) < contender.repetitions &&
                                         used < contender.budget_seconds);
  };
  for (std::size_t round = 0; std::any_of(contenders.begin(), contenders.end(), wants_more); ++round)
    for (std::size_t position = 0; position < contenders.size(); ++position) {
      Contender& contender = contenders[runner(position, round, contenders.size())];
      if (wants_more(contender)) contender.seconds.push_back(contender.run());
    }
}

std::vector<std::vector<double>> race(const std::vector<std::function<double()>>& work, int repetitions,
                                      double budget_seconds, bool warm) {
  std::vector<Contender> contenders;
  for (const auto& run : work) contenders.push_back({run, budget_seconds, repetitions, {}});
  if (warm)
    for (const auto& run : work) run();
  race(contenders);
  std::vector<std::vector<double>> seconds;
  for (Contender& contender : contenders) seconds.push_back(std::move(contender.seconds));
  return seconds;
}

}  // namespace hermesh
