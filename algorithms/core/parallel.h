// Count, scan, fill: a parallel pass counts per block, a prefix sum gives each block its first index, a
// parallel pass writes into the final arrays. No locks, and the same bytes for every number of threads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Non-owning reference to a function f(begin, end), which must outlive it.
class RangeFunction {
 public:
  template <class F>
  explicit RangeFunction(const F& f)
      : function_(&f), call_([](const void* function, std::size_t begin, std::size_t end) {
          (*static_cast<const F*>(function))(begin, end);
        }) {}
  void operator()(std::size_t begin, std::size_t end) const { call_(function_, begin, end); }

 private:
  const void* function_;
  void (*call_)(const void* function, std::size_t begin, std::size_t end);
};

/// Calls f(begin, end) in parallel for ranges of about `grain` indices that partition 0…n−1, and checks for
/// cancellation before each. (This header does not include TBB's, which would add half a second to the
/// compilation of nearly every file.) @throws Cancelled.
void parallel_ranges(std::size_t n, const RunContext& context, const RangeFunction& f, std::size_t grain);

/// Calls f(i) in parallel for i in 0…n−1, in tasks of at least `grain`, and checks for cancellation before
/// each task. A block of samples takes microseconds, so sixteen of them are worth a task. @throws Cancelled.
template <class F>
void parallel_blocks(std::size_t n, const RunContext& context, F&& f, std::size_t grain = 16) {
  const auto range = [&f](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) f(i);
  };
  parallel_ranges(n, context, RangeFunction(range), grain);
}

/// Returns `n` copies of `value`, written in parallel, so that their pages are first touched by all threads.
/// @throws Cancelled.
template <class T>
LargeArray<T> filled(std::size_t n, const T& value, const RunContext& context) {
  LargeArray<T> result(n);
  parallel_blocks(n, context, [&](std::size_t i) { result[i] = value; });
  return result;
}

/// @throws Error if `total` elements need more than 32-bit indices; `what` is their name in the plural.
void check_indices(std::uint64_t total, const std::string& what);

/// Replaces each count by the sum of the counts before it and returns the total. @throws Error as
/// check_indices().
std::uint64_t exclusive_scan(std::vector<std::uint64_t>& counts, const std::string& what);

}  // namespace hermesh
