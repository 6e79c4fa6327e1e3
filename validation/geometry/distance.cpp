#include "validation/geometry/distance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "validation/geometry/sum_ranges.h"

namespace hermesh::validation {
namespace {

// The powers of the inverse of the plastic number, the real root of x³ = x + 1.
constexpr double kFirstStep = 0.7548776662466927;
constexpr double kSecondStep = 0.5698402909980532;

double fraction(double x) { return x - std::floor(x); }

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

// Sums over point(i) with weight(i) for i < count. Consecutive points tend to be close in space, so the
// answer of one query is a good first guess for the next.
template <class Point, class Weight>
DistanceSums sum_distances(std::size_t count, const Point& point, const Weight& weight,
                           const TriangleTree& to, const RunContext& context) {
  return sum_ranges<DistanceSums>(count, 512, context,
                                  [&](std::size_t begin, std::size_t end, DistanceSums& sums) {
                                    std::uint32_t guess = 0;
                                    for (std::size_t i = begin; i < end; ++i) {
                                      const Eigen::Vector3d p = point(i);
                                      const ClosestHit hit = to.closest(p, guess);
                                      guess = hit.slot;
                                      sums.add(p, hit.squared, weight(i));
                                    }
                                  });
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

struct AngleSums {
  double first = 0.0, second = 0.0, max = 0.0;
  std::int64_t samples = 0;

  void add(double angle) {
    first += angle;
    second += angle * angle;
    max = std::max(max, angle);
    ++samples;
  }
  void append(const AngleSums& later) {
    first += later.first;
    second += later.second;
    max = std::max(max, later.max);
    samples += later.samples;
  }
};

}  // namespace

SurfaceSamples::SurfaceSamples(const TriangleSoup& soup, std::int64_t count) : soup_(soup), count_(count) {
  area_up_to_.reserve(soup.triangles.size());
  double total = 0.0;
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    total += 0.5 * area_vector(soup.corners(t)).norm();
    area_up_to_.push_back(total);
  }
  if (!(total > 0.0)) count_ = 0;
}

std::size_t SurfaceSamples::triangle(std::int64_t i) const {
  const double area = area_up_to_.back() * ((double(i) + 0.5) / double(count_));
  const auto found = std::upper_bound(area_up_to_.begin(), area_up_to_.end() - 1, area);
  return std::size_t(found - area_up_to_.begin());
}

Eigen::Vector3d SurfaceSamples::operator[](std::int64_t i) const {
  const Corners c = soup_.corners(triangle(i));
  double u = fraction(double(i) * kFirstStep), v = fraction(double(i) * kSecondStep);
  // Fold the half of the unit square outside of the triangle onto it.
  if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
  return c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
}

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

NormalAngles sampled_normal_angles(const TriangleSoup& from, const TriangleTree& to, std::int64_t samples,
                                   RunContext& context) {
  const SurfaceSamples surface(from, samples);
  const AngleSums sums = sum_ranges<AngleSums>(
      std::size_t(surface.size()), 512, context, [&](std::size_t begin, std::size_t end, AngleSums& angles) {
        std::uint32_t guess = 0;
        for (auto i = std::int64_t(begin); i < std::int64_t(end); ++i) {
          const ClosestHit hit = to.closest(surface[i], guess);
          guess = hit.slot;
          const Eigen::Vector3d own = area_vector(from.corners(surface.triangle(i))),
                                other = area_vector(to.corners(hit.slot));
          if (!(own.norm() > 0.0) || !(other.norm() > 0.0)) continue;
          // The tangent of the angle from both products is accurate for small and for large angles.
          angles.add(std::atan2(own.cross(other).norm(), own.dot(other)) * (180.0 / std::numbers::pi));
        }
      });
  NormalAngles result;
  result.samples = sums.samples;
  if (sums.samples == 0) return result;
  result.mean = sums.first / double(sums.samples);
  result.rms = std::sqrt(sums.second / double(sums.samples));
  result.max = sums.max;
  return result;
}

}  // namespace hermesh::validation
