#include "experiments/ledger/rank_test.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace hermesh {
namespace {

RankTest tested(const std::vector<double>& a, const std::vector<double>& b) { return rank_test(a, b); }

TEST(RankTest, CountsByHandWhereSidesAreApart) {
  // Of the C(n + m, n) choices, the two extreme ones deviate as much.
  EXPECT_DOUBLE_EQ(tested({1, 2, 3}, {4, 5, 6}).p, 2.0 / 20.0);
  EXPECT_DOUBLE_EQ(tested({4, 5, 6}, {1, 2, 3}).p, 2.0 / 20.0);
  EXPECT_DOUBLE_EQ(tested({1, 2, 3, 4, 5}, {6, 7, 8, 9, 10}).p, 2.0 / 252.0);
  EXPECT_DOUBLE_EQ(tested({1}, {2}).p, 1.0);
  EXPECT_EQ(tested({4, 5, 6}, {1, 2, 3}).u, 9.0);
  EXPECT_EQ(tested({1, 2, 3}, {4, 5, 6}).u, 0.0);
}

TEST(RankTest, CountsByHandWhereSidesOverlap) {
  // Ranks 1 and 3 of 4: sums of two ranks are 3, 4, 5, 5, 6, 7, the mean is 5, and 3, 4, 6 and 7 are as far
  // as 4.
  EXPECT_DOUBLE_EQ(tested({1, 3}, {2, 4}).p, 4.0 / 6.0);
  EXPECT_EQ(tested({1, 3}, {2, 4}).u, 1.0);
  // Ranks 1, 2 and 4 of 6: the sum is 7, 3.5 below the mean; sums of 6, 7, 14 and 15 arise in one way each.
  EXPECT_DOUBLE_EQ(tested({1, 2, 4}, {3, 5, 6}).p, 4.0 / 20.0);
}

TEST(RankTest, TiesShareTheirRank) {
  // Values 1, 1, 1, 2: ranks 2, 2, 2, 4. Sums of two ranks: 4 in three ways, 6 in three, the mean is 5: all
  // as far.
  EXPECT_DOUBLE_EQ(tested({1, 1}, {1, 2}).p, 1.0);
  EXPECT_EQ(tested({1, 1}, {1, 2}).u, 1.0);
  // Values 1, 1, 2, 2: ranks 1.5, 1.5, 3.5, 3.5. Sums: 3 once, 5 four times, 7 once.
  EXPECT_DOUBLE_EQ(tested({1, 1}, {2, 2}).p, 2.0 / 6.0);
  EXPECT_DOUBLE_EQ(tested({7, 7, 7}, {7, 7}).p, 1.0);
  EXPECT_EQ(tested({}, {1, 2}).p, 1.0);
}

TEST(RankTest, IsNormalBeyondTwenty) {
  std::vector<double> a, b;
  for (int i = 0; i < 21; ++i) a.push_back(i), b.push_back(i + 100);
  // U = 0, mean 220.5, variance 21·21·43/12 = 1580.25; (220.5 - 0.5)/39.752 = 5.5343, whose two tails
  // have 3.124e-8.
  EXPECT_NEAR(rank_test(a, b).p, 3.124e-8, 2e-10);
  // All values the same: no variance, no deviation.
  EXPECT_EQ(rank_test(std::vector<double>(30, 1.0), std::vector<double>(30, 1.0)).p, 1.0);
}

TEST(RankTest, CountsNearlyWhatTheNormalOneSays) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> one(0, 1);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<double> a, b;
    for (int i = 0; i < 20; ++i) a.push_back(one(random)), b.push_back(one(random) + 0.1);
    const RankTest counted = rank_test(a, b);
    const double deviation =
        std::max(0.0, std::abs(counted.u - 200.0) - 0.5) / std::sqrt(20.0 * 20.0 * 41.0 / 12.0);
    EXPECT_NEAR(counted.p, std::erfc(deviation / std::sqrt(2.0)), 0.005);
  }
}

TEST(RankTest, RarelyFindsWhatIsNotThere) {
  std::mt19937 random(11);
  std::lognormal_distribution<double> times(0, 0.3);
  int found = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    std::vector<double> a, b;
    for (int i = 0; i < 9; ++i) a.push_back(times(random)), b.push_back(times(random));
    found += rank_test(a, b).p < 0.01;
  }
  // Expected are at most 20, with a deviation of 4.5.
  EXPECT_LE(found, 36);
  EXPECT_GE(found, 4);
}

}  // namespace
}  // namespace hermesh
