#include "experiments/ledger/rank_test.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace hermesh {
namespace {

/// The most values of a side whose distribution is counted.
constexpr std::size_t kCounted = 20;

/// Twice the rank of each value among all, from 2; ties share the middle of theirs, hence twice.
struct Ranks {
  std::vector<int> twice;  ///< in ascending order
  int first_side = 0;      ///< sum over the values of the first side
  double ties = 0.0;       ///< sum of t³ - t over the runs of t equal values
};

Ranks ranks_of(std::span<const double> a, std::span<const double> b) {
  std::vector<std::pair<double, bool>> all;
  for (const double value : a) all.emplace_back(value, true);
  for (const double value : b) all.emplace_back(value, false);
  std::ranges::sort(all);
  Ranks ranks;
  for (std::size_t begin = 0; begin < all.size();) {
    std::size_t end = begin;
    while (end < all.size() && all[end].first == all[begin].first) ++end;
    const double t = double(end - begin);
    ranks.ties += t * t * t - t;
    const int shared = int(begin + 1 + end);  // twice the mean of the ranks begin + 1 to end
    for (; begin < end; ++begin) {
      ranks.twice.push_back(shared);
      if (all[begin].second) ranks.first_side += shared;
    }
  }
  return ranks;
}

/// The share of all choices of n ranks whose sum is at least as far from the mean.
double counted(const Ranks& ranks, int n) {
  const int total = int(ranks.twice.size());
  int largest = 0;
  for (const int rank : ranks.twice) largest += rank;
  // ways[k][s]: choices of k of the ranks so far with the sum s. C(40, 20) is 1.4e11, which a double holds
  // exactly.
  std::vector<std::vector<double>> ways(std::size_t(n) + 1,
                                        std::vector<double>(std::size_t(largest) + 1, 0.0));
  ways[0][0] = 1.0;
  for (const int rank : ranks.twice)
    for (int k = n; k >= 1; --k)
      for (int sum = largest; sum >= rank; --sum)
        ways[std::size_t(k)][std::size_t(sum)] += ways[std::size_t(k) - 1][std::size_t(sum - rank)];
  const int mean = n * (total + 1);  // of twice the sum of n ranks
  const int deviation = std::abs(ranks.first_side - mean);
  double as_far = 0.0, all = 0.0;
  for (int sum = 0; sum <= largest; ++sum) {
    all += ways[std::size_t(n)][std::size_t(sum)];
    if (std::abs(sum - mean) >= deviation) as_far += ways[std::size_t(n)][std::size_t(sum)];
  }
  return as_far / all;
}

}  // namespace

RankTest rank_test(std::span<const double> a, std::span<const double> b) {
  if (a.empty() || b.empty()) return {};
  const double n = double(a.size()), m = double(b.size());
  const Ranks ranks = ranks_of(a, b);
  RankTest test;
  test.u = 0.5 * ranks.first_side - 0.5 * n * (n + 1.0);
  if (a.size() <= kCounted && b.size() <= kCounted) {
    test.p = counted(ranks, int(a.size()));
    return test;
  }
  const double all = n + m;
  const double variance = n * m / 12.0 * (all + 1.0 - ranks.ties / (all * (all - 1.0)));
  if (variance <= 0.0) return test;  // all values are equal
  const double deviation = std::max(0.0, std::abs(test.u - 0.5 * n * m) - 0.5);
  test.p = std::erfc(deviation / std::sqrt(2.0 * variance));
  return test;
}

}  // namespace hermesh
