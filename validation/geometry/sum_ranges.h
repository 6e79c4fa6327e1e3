// Parallel sums whose result does not depend on the number of threads.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include "algorithms/core/run_context.h"

namespace hermesh::validation {

/// Divides 0 … count − 1 into ranges of at most `grain` elements, calls add(begin, end, sum) for each, and
/// joins the sums in order by Sum::append(). @throws Cancelled.
template <class Sum, class Add>
Sum sum_ranges(std::size_t count, std::size_t grain, const RunContext& context, const Add& add) {
  const auto add_range = [&](const tbb::blocked_range<std::size_t>& range, Sum sum) {
    context.check();
    add(range.begin(), range.end(), sum);
    return sum;
  };
  const auto join = [](Sum left, const Sum& right) {
    left.append(right);
    return left;
  };
  return tbb::parallel_deterministic_reduce(tbb::blocked_range<std::size_t>(0, count, grain), Sum{},
                                            add_range, join);
}

}  // namespace hermesh::validation
