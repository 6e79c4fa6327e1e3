#include "algorithms/core/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <limits>
#include <utility>

namespace hermesh {

void parallel_ranges(std::size_t n, const RunContext& context, const RangeFunction& f, std::size_t grain) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, grain),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      context.check();
                      f(range.begin(), range.end());
                    });
}

void check_indices(std::uint64_t total, const std::string& what) {
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw Error("the mesh would have " + std::to_string(total) + " " + what +
                ", more than 32-bit indices can number; use larger voxels");
}

std::uint64_t exclusive_scan(std::vector<std::uint64_t>& counts, const std::string& what) {
  std::uint64_t total = 0;
  for (std::uint64_t& count : counts) total += std::exchange(count, total);
  check_indices(total, what);
  return total;
}

}  // namespace hermesh
