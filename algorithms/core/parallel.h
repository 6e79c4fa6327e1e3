// Count – scan – fill: a parallel pass counts per block, a prefix sum gives each block its first index, a
// parallel pass writes straight into the final arrays. No locks, and the same bytes for every number of
// threads.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Calls f(i) for i in 0…n−1, in parallel, and looks for cancellation every few blocks. @throws Cancelled.
template <class F>
void parallel_blocks(std::size_t n, const RunContext& context, F&& f) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 16),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      context.check();
                      for (std::size_t i = range.begin(); i < range.end(); ++i) f(i);
                    });
}

/// Array of `n` copies of `value`, written in parallel, so that no thread alone touches all its pages.
/// @throws Cancelled.
template <class T>
LargeArray<T> filled(std::size_t n, const T& value, const RunContext& context) {
  LargeArray<T> result(n);
  parallel_blocks(n, context, [&](std::size_t i) { result[i] = value; });
  return result;
}

/// Checks that indices of 32 bits can number `total` elements. `what` is their name in the plural. @throws Error
inline void check_indices(std::uint64_t total, const std::string& what) {
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw Error("the mesh would have " + std::to_string(total) + " " + what +
                ", more than 32-bit indices can number; use larger voxels");
}

/// Replaces each count by the sum of the counts before it and returns the total. @throws Error if the total cannot be
/// an index of 32 bits; `what` names the counted things in the plural.
inline std::uint64_t exclusive_scan(std::vector<std::uint64_t>& counts, const std::string& what) {
  std::uint64_t total = 0;
  for (std::uint64_t& count : counts) {
    const std::uint64_t before = total;
    total += count;
    count = before;
  }
  check_indices(total, what);
  return total;
}

}  // namespace hermesh
