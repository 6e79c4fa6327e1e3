// Whether one of two sets of times tends to be larger than the other, without assuming how times are
// distributed.
#pragma once

#include <span>

namespace hermesh {

struct RankTest {
  double u = 0.0;  ///< pairs (a, b) with a > b, a tie counting one half
  double p = 1.0;  ///< two-sided: how often a deviation as large as this or larger arises if both are of one
                   ///< distribution
};

/// The U test of Mann and Whitney (1947). Up to 20 values a side the distribution is counted, given the ties:
/// of all ways to choose which of the values are the first side's, the share whose U deviates as much. Beyond
/// that it is taken for normal, with the variance corrected for ties and U for its steps. p is 1 where a side
/// is empty.
RankTest rank_test(std::span<const double> a, std::span<const double> b);

}  // namespace hermesh
