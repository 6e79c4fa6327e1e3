#include "experiments/measure.h"

#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <numeric>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace hermesh {
namespace measure_test {

TEST(Median, OfFew) {
  EXPECT_EQ(median({}), 0.0);
  EXPECT_EQ(median({3.0}), 3.0);
  EXPECT_EQ(median({9.0, 1.0}), 5.0);
  EXPECT_EQ(median({100.0, 1.0, 2.0}), 2.0);
  EXPECT_EQ(median({4.0, 1.0, 100.0, 2.0}), 3.0);
}

TEST(Median, StagesKeepTheirOrderAndAddUpWithinARepetition) {
  const std::vector<StageSeconds> repetitions = {
      {{"count", 1.0}, {"fill", 5.0}, {"count", 1.0}}, {{"count", 4.0}, {"fill", 7.0}}, {{"count", 3.0}}};
  const StageSeconds expected = {{"count", 3.0}, {"fill", 5.0}};
  EXPECT_EQ(median_stages(repetitions), expected);
}

/// The order in which the contenders ran, a letter each, in `rounds` rounds of interleaved timing.
std::string order_of_race(int contenders, int rounds) {
  std::string order;
  std::vector<Contender> all(contenders);
  for (int i = 0; i < contenders; ++i) {
    all[i].repetitions = rounds;
    all[i].run = [&order, i] {
      order += static_cast<char>('a' + i);
      return 0.1;
    };
  }
  race(all);
  for (const Contender& contender : all) EXPECT_EQ(contender.seconds, std::vector<double>(rounds, 0.1));
  return order;
}

TEST(Race, OrderOfFew) {
  EXPECT_EQ(order_of_race(1, 3), "aaa");
  EXPECT_EQ(order_of_race(2, 2), "abba");
  EXPECT_EQ(order_of_race(3, 2), "abcacb");
  EXPECT_EQ(order_of_race(4, 4), "abdcbcadcdbadacb");
}

TEST(Race, AllRunAsOftenAtEachPlaceAndAfterEachOther) {
  for (int n = 2; n <= 9; ++n) {
    const int rounds = n % 2 == 0 ? n : 2 * n;
    const std::string order = order_of_race(n, rounds);
    std::map<std::pair<char, int>, int> at_place;
    std::map<std::pair<char, char>, int> after;
    for (int i = 0; i < n * rounds; ++i) {
      ++at_place[{order[i], i % n}];
      if (i % n > 0) ++after[{order[i], order[i - 1]}];
    }
    EXPECT_EQ(at_place.size(), std::size_t(n * n));
    EXPECT_EQ(after.size(), std::size_t(n * (n - 1)));
    for (const auto& [who, times] : at_place) EXPECT_EQ(times, rounds / n) << n;
    for (const auto& [who, times] : after) EXPECT_EQ(times, rounds / n) << n;
  }
}

TEST(Race, StopsOnceTheOwnBudgetIsUsedUpButRunsAtLeastOnce) {
  std::vector<Contender> contenders(3);
  contenders[0] = {[] { return 1.0; }, 2.5, 100, {}};
  contenders[1] = {[] { return 50.0; }, 0.0, 100, {}};
  contenders[2] = {[] { return 1.0; }, 2.5, 100, {3.0}};  // its first run was enough
  race(contenders);
  EXPECT_EQ(contenders[0].seconds.size(), 3u);
  EXPECT_EQ(contenders[1].seconds.size(), 1u);
  EXPECT_EQ(contenders[2].seconds.size(), 1u);
}

TEST(Timed, CountsTheTimeOfTheWork) {
  EXPECT_GE(timed([] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); }), 0.02);
}

TEST(PeakMemory, SeesWhatWasTakenAndGivenBackButNotWhatWasThereBefore) {
  constexpr std::size_t kMebibyte = 1 << 20;
  const std::vector<char> before(100 * kMebibyte, 1);
  const PeakMemory memory;
  if (!memory.bytes()) GTEST_SKIP() << "this system does not let a process reset its high-water mark";
  long sum = 0;
  {
    const std::vector<char> during(64 * kMebibyte, 1);
    sum = std::accumulate(during.begin(), during.end(), 0L);
  }
  EXPECT_EQ(sum, static_cast<long>(64 * kMebibyte));
  EXPECT_GT(*memory.bytes(), static_cast<std::int64_t>(60 * kMebibyte));
  EXPECT_LT(*memory.bytes(), static_cast<std::int64_t>(90 * kMebibyte));
  const PeakMemory afterwards;
  EXPECT_LT(*afterwards.bytes(), static_cast<std::int64_t>(30 * kMebibyte));
  EXPECT_EQ(before[before.size() / 2], 1);
}

}  // namespace measure_test
}  // namespace hermesh
