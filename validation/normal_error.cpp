#include "validation/normal_error.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "validation/geometry/surface_samples.h"

namespace hermesh::validation {
namespace {

struct NormalSums {
  double first = 0.0, second = 0.0, max = 0.0;
  std::int64_t samples = 0;

  void add(double angle) {
    first += angle;
    second += angle * angle;
    max = std::max(max, angle);
    ++samples;
  }
  void append(const NormalSums& later) {
    first += later.first;
    second += later.second;
    max = std::max(max, later.max);
    samples += later.samples;
  }
};

Eigen::Vector3d normal_of(const Corners& c) { return (c[1] - c[0]).cross(c[2] - c[0]); }

}  // namespace

NormalAngles sampled_normal_angles(const TriangleSoup& from, const TriangleTree& to, std::int64_t samples,
                                   RunContext& context) {
  const SurfaceSamples surface(from, samples);
  const auto add_range = [&](const tbb::blocked_range<std::int64_t>& range, NormalSums sums) {
    context.check();
    std::uint32_t guess = 0;
    for (std::int64_t i = range.begin(); i < range.end(); ++i) {
      const ClosestHit hit = to.closest(surface[i], guess);
      guess = hit.slot;
      const Eigen::Vector3d own = normal_of(from.corners(surface.triangle(i))),
                            other = normal_of(to.corners(hit.slot));
      if (!(own.norm() > 0.0) || !(other.norm() > 0.0)) continue;
      // The tangent of the angle from both products is exact for small and for large angles.
      sums.add(std::atan2(own.cross(other).norm(), own.dot(other)) * (180.0 / std::numbers::pi));
    }
    return sums;
  };
  const auto join = [](NormalSums left, const NormalSums& right) {
    left.append(right);
    return left;
  };
  const NormalSums sums = tbb::parallel_deterministic_reduce(
      tbb::blocked_range<std::int64_t>(0, surface.size(), 512), NormalSums{}, add_range, join);
  NormalAngles result;
  result.samples = sums.samples;
  if (sums.samples == 0) return result;
  result.mean = sums.first / double(sums.samples);
  result.rms = std::sqrt(sums.second / double(sums.samples));
  result.max = sums.max;
  return result;
}

}  // namespace hermesh::validation
