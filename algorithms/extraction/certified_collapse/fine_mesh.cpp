#include "algorithms/extraction/certified_collapse/fine_mesh.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "algorithms/core/error.h"
#include "algorithms/core/parallel.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {

namespace {

/// Calls f(first, end) for ranges of the vertices, in parallel. Each call reads all triangles, in order,
/// which is cheap, and processes those of its own vertices in the same order for any number of threads.
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
  parallel_blocks(triangles_.size(), context, [&](std::size_t t) {
    if (triangles_[t][0] == kNone) return;
    const auto [a, b, c] = corners(static_cast<std::uint32_t>(t));
    normals_[t] = (b - a).cross(c - a).stableNormalized().cast<float>();
  });
  // Triangles by vertex: count, scan, fill, so that those around a vertex ascend.
  constexpr std::uint32_t kBetweenChecks = 1
                                           << 16;  // of millions of triangles, which take tenths of a second
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
  std::vector<std::uint32_t> free(first_.begin(), first_.end() - 1);
  for_each_range(points_.size(), [&](std::uint32_t first, std::uint32_t end) {
    for_each_corner(first, end, [&](std::uint32_t p, std::uint32_t t) { around_[free[p]++] = t; });
  });
  // Across a side that ends at a vertex lies the first side that leads back from there.
  across_.resize(triangles_.size());
  parallel_blocks(points_.size(), context, [&](std::size_t i) {
    const auto p = static_cast<std::uint32_t>(i);
    const auto corner = [&](std::uint32_t t) {
      const Triangle& c = triangles_[t];
      return c[0] == p ? 0u : c[1] == p ? 1u : 2u;
    };
    for (const std::uint32_t in : around(p)) {
      const std::uint32_t side = (corner(in) + 2) % 3;
      across_[in][side] = kNone;
      for (const std::uint32_t out : around(p))
        if (next(out, p) == triangles_[in][side]) {
          across_[in][side] = 3 * out + corner(out);
          break;
        }
    }
  });
}

std::uint32_t FineMesh::walk(std::uint32_t triangle, const Eigen::Vector3d& p) const {
  constexpr int kMostSteps = 1000;
  // If two triangles send the walk to one another, the point lies outside of the ridge between them. Walks in
  // longer circles, as around a spike, end with the number of steps.
  std::uint32_t before = triangle;
  for (int step = 0; step < kMostSteps; ++step) {
    const Corners c = corners(triangle);
    const Eigen::Vector3d n = normals_[triangle].cast<double>();
    int side = -1;
    double farthest = 0;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d edge = c[(i + 1) % 3] - c[i];
      // Distance beyond the side in the triangle's plane, times the side's length; squares avoid a root.
      const double beyond = edge.cross(n).dot(p - c[i]), squared = edge.squaredNorm();
      if (beyond > 0 && beyond * beyond > farthest * squared) {
        farthest = beyond * beyond / squared;
        side = i;
      }
    }
    if (side < 0) return triangle;
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
  // In any case an upper bound of the distance to the mesh, since it is that of one of its triangles.
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
    // Around all three corners, because the nearest may be beyond one of them.
    for (const std::uint32_t corner : triangles_[from])
      for (const std::uint32_t t : around(corner))
        if (t != from) ask(t);
    if (triangle == from) break;
  }
  return triangle;
}

}  // namespace hermesh
