#include "algorithms/extraction/certified_collapse/fine_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "algorithms/core/error.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {

namespace {

/// Calls f(first, end) for ranges of the points, side by side. Each call is to read all triangles for the
/// sake of its own points: that is cheap, for they are read in order, and what is done about a point is done
/// in the same order by any number of threads.
template <class F>
void for_each_range(std::size_t points, F&& f) {
  constexpr std::size_t kLeast = 1 << 13;
  const std::size_t threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const std::size_t ranges = std::clamp<std::size_t>(points / kLeast, 1, threads);
  tbb::parallel_for(std::size_t{0}, ranges, [&](std::size_t i) {
    f(static_cast<std::uint32_t>(points * i / ranges), static_cast<std::uint32_t>(points * (i + 1) / ranges));
  });
}

}  // namespace

FineMesh::FineMesh(std::vector<Eigen::Vector3d> points, std::vector<Triangle> triangles,
                   const RunContext& context)
    : points_(std::move(points)), triangles_(std::move(triangles)), first_(points_.size() + 1) {
  // `around_` has three entries for each triangle, which `first_` counts in 32 bits.
  if (triangles_.size() > kNone / 3)
    throw Error("the surface has " + std::to_string(triangles_.size()) +
                " triangles, more than can be merged; use larger voxels or tolerance 0");
  normals_.resize(triangles_.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, triangles_.size(), 1024), [&](const auto& range) {
    context.check();
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      if (triangles_[t][0] == kNone) continue;
      const Eigen::Vector3d &a = points_[triangles_[t][0]], &b = points_[triangles_[t][1]],
                            &c = points_[triangles_[t][2]];
      normals_[t] = (b - a).cross(c - a).stableNormalized().cast<float>();
    }
  });
  // Triangles by point: count, scan, fill, so that those around a point ascend.
  constexpr std::uint32_t kBetweenChecks =
      1 << 16;  // triangles, which are millions: all of them take tenths of a second
  const auto for_each_corner = [&](std::uint32_t first, std::uint32_t end, auto&& f) {
    for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
      if (t % kBetweenChecks == 0) context.check();
      if (triangles_[t][0] != kNone)
        for (const std::uint32_t p : triangles_[t])
          if (p >= first && p < end) f(p, t);
    }
  };
  for_each_range(points_.size(), [&](std::uint32_t first, std::uint32_t end) {
    for_each_corner(first, end, [&](std::uint32_t p, std::uint32_t) { ++first_[p + 1]; });
  });
  for (std::size_t p = 0; p < points_.size(); ++p) first_[p + 1] += first_[p];
  around_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for_each_range(points_.size(), [&](std::uint32_t first, std::uint32_t end) {
    for_each_corner(first, end, [&](std::uint32_t p, std::uint32_t t) { around_[next[p]++] = t; });
  });
  across_.resize(triangles_.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points_.size(), 1024), [&](const auto& range) {
    context.check();
    std::vector<Fan> fan;
    for (std::size_t p = range.begin(); p < range.end(); ++p) find_across(static_cast<std::uint32_t>(p), fan);
  });
}

/// Finds what lies across the sides that end at a point: the first side that leads back from there.
void FineMesh::find_across(std::uint32_t point, std::vector<Fan>& fan) {
  fan.clear();
  for (const std::uint32_t t : around(point)) {
    const Triangle& c = triangles_[t];
    const std::uint32_t i = c[0] == point ? 0u : c[1] == point ? 1u : 2u;
    fan.push_back({3 * t + i, c[(i + 1) % 3], c[(i + 2) % 3]});
  }
  for (const Fan& in : fan) {
    std::uint32_t& across =
        across_[in.side / 3][(in.side % 3 + 2) % 3];  // of the side that ends at the point
    across = kNone;
    for (const Fan& out : fan)
      if (out.next == in.before) {
        across = out.side;
        break;
      }
  }
}

std::uint32_t FineMesh::walk(std::uint32_t triangle, const Eigen::Vector3d& p) const {
  constexpr int kMostSteps = 1000;
  // Where two triangles would send the walk to one another, the point lies outside of the ridge between them.
  // Walks that go in longer circles, as around a spike, end with the number of steps.
  std::uint32_t before = triangle;
  for (int step = 0; step < kMostSteps; ++step) {
    const Corners c = corners(triangle);
    const Eigen::Vector3d n = normals_[triangle].cast<double>();
    int side = -1;
    double farthest = 0;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d edge = c[(i + 1) % 3] - c[i];
      // Beyond the side in the triangle's plane, times the side's length: squares are compared, without a
      // root.
      const double beyond = edge.cross(n).dot(p - c[i]), squared = edge.squaredNorm();
      if (beyond > 0 && beyond * beyond > farthest * squared) {
        farthest = beyond * beyond / squared;
        side = i;
      }
    }
    if (side < 0) return triangle;
    // Found among the triangles around one end of the side: a step needs no search.
    const std::uint32_t next = across(triangle, side);
    if (next == before || next == kNone) return triangle;
    before = triangle;
    triangle = next;
  }
  return triangle;
}

std::uint32_t FineMesh::nearest_around(std::uint32_t triangle, const Eigen::Vector3d& p,
                                       double& squared) const {
  constexpr int kMostSteps = 16;
  constexpr double kNormalRounding = 1e-4;  // over the few voxels that p is away
  squared = std::numeric_limits<double>::infinity();
  // An upper bound of the distance to the mesh in any case: that of a triangle that has been looked at.
  const auto ask = [&](std::uint32_t t) {
    const Corners c = corners(t);
    // Most are ruled out by their boxes.
    const Eigen::Vector3d below = c[0].cwiseMin(c[1]).cwiseMin(c[2]) - p,
                          above = p - c[0].cwiseMax(c[1]).cwiseMax(c[2]);
    if (below.cwiseMax(above).cwiseMax(0.0).squaredNorm() >= squared) return;
    // Then by their planes; the normals are of single precision.
    const double height = std::abs(normals_[t].cast<double>().dot(p - c[0])) - kNormalRounding;
    if (height > 0 && height * height >= squared) return;
    const double there = squared_distance(p, c[0], c[1], c[2]);
    if (there < squared) squared = there, triangle = t;
  };
  ask(triangle);
  for (int step = 0; step < kMostSteps; ++step) {
    const std::uint32_t from = triangle;
    // Around all three corners: the nearest may be beyond one of them, and not only beyond a side.
    for (const std::uint32_t corner : triangles_[from])
      for (const std::uint32_t t : around(corner))
        if (t != from) ask(t);
    if (triangle == from) break;
  }
  return triangle;
}

}  // namespace hermesh
