#include "validation/geometry/distance.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <cmath>

#include "validation/geometry/surface_samples.h"

namespace hermesh::validation {
namespace {

struct DistanceSums {
  double weight = 0.0, first = 0.0, second = 0.0;  // sums of weight, of distance and of its square
  double max_squared = -1.0;
  Eigen::Vector3d worst = Eigen::Vector3d::Zero();

  void add(const Eigen::Vector3d& point, double squared, double w) {
    weight += w;
    first += w * std::sqrt(squared);
    second += w * squared;
    if (squared > max_squared) max_squared = squared, worst = point;
  }
  void append(const DistanceSums& later) {
    weight += later.weight;
    first += later.first;
    second += later.second;
    if (later.max_squared > max_squared) max_squared = later.max_squared, worst = later.worst;
  }
};

// point(i) and weight(i) for i < count. Neighbours in the list tend to be neighbours in space, so that the
// answer of one query is a good first guess for the next.
template <class Point, class Weight>
DistanceSums sum_distances(std::size_t count, const Point& point, const Weight& weight,
                           const TriangleTree& to, const RunContext& context) {
  const auto add_range = [&](const tbb::blocked_range<std::size_t>& range, DistanceSums sums) {
    context.check();
    std::uint32_t guess = 0;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Eigen::Vector3d p = point(i);
      const ClosestHit hit = to.closest(p, guess);
      guess = hit.slot;
      sums.add(p, hit.squared, weight(i));
    }
    return sums;
  };
  const auto join = [](DistanceSums left, const DistanceSums& right) {
    left.append(right);
    return left;
  };
  return tbb::parallel_deterministic_reduce(tbb::blocked_range<std::size_t>(0, count, 512), DistanceSums{},
                                            add_range, join);
}

void fill_means(const DistanceSums& sums, Distances& result) {
  if (!(sums.weight > 0.0)) return;
  result.mean = sums.first / sums.weight;
  result.rms = std::sqrt(sums.second / sums.weight);
}

void fill_maximum(const DistanceSums& sums, Distances& result) {
  if (sums.max_squared < 0.0) return;
  result.max = std::sqrt(sums.max_squared);
  result.worst = sums.worst;
}

std::vector<std::uint32_t> used_points(const TriangleSoup& soup) {
  std::vector<std::uint8_t> used(soup.points.size(), 0);
  for (const Triangle& t : soup.triangles)
    for (std::uint32_t p : t) used[p] = 1;
  std::vector<std::uint32_t> list;
  for (std::uint32_t p = 0; p < used.size(); ++p)
    if (used[p]) list.push_back(p);
  return list;
}

}  // namespace

Distances sampled_distances(const TriangleSoup& from, const TriangleTree& to, std::int64_t samples,
                            RunContext& context) {
  const std::vector<std::uint32_t> used = used_points(from);
  const SurfaceSamples surface(from, samples);
  const auto one = [](std::size_t) { return 1.0; };
  const auto used_point = [&](std::size_t i) { return from.points[used[i]]; };
  DistanceSums at_points = sum_distances(used.size(), used_point, one, to, context);
  const auto sample = [&](std::size_t i) { return surface[std::int64_t(i)]; };
  const DistanceSums over_area = sum_distances(std::size_t(surface.size()), sample, one, to, context);
  Distances result;
  result.samples = std::int64_t(used.size()) + surface.size();
  fill_means(surface.size() > 0 ? over_area : at_points, result);
  at_points.append(over_area);
  fill_maximum(at_points, result);
  return result;
}

Distances point_distances(const std::vector<WeightedPoint>& points, const TriangleTree& to,
                          RunContext& context) {
  const auto point = [&](std::size_t i) { return points[i].point; };
  const auto weight = [&](std::size_t i) { return points[i].weight; };
  const DistanceSums sums = sum_distances(points.size(), point, weight, to, context);
  Distances result;
  result.samples = std::int64_t(points.size());
  fill_means(sums, result);
  fill_maximum(sums, result);
  return result;
}

}  // namespace hermesh::validation
