#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "algorithms/thesis/thesis_band.h"

namespace hermesh {
namespace {

/// Approximate number of samples that are rasterised between two checks for cancellation.
constexpr std::size_t kVoxelsAtOnce = 4096;

/// Returns the voxel that a point is rounded to, halves upwards (std::round would round them away from 0).
Voxel nearest_voxel(const Eigen::Vector3d& p) {
  const auto round = [](double x) { return std::int32_t(std::floor(x + 0.5)); };
  return {round(p.x()), round(p.y()), round(p.z())};
}

/// Returns the metric d_T of eq. 5.1: the number of parts that every edge is divided into.
std::int64_t edge_parts(const GridTriangle& t) {
  const auto largest = [](const Eigen::Vector3d& v) { return v.cwiseAbs().maxCoeff(); };
  return std::int64_t(
      std::ceil(std::max({largest(t[1] - t[0]), largest(t[2] - t[1]), largest(t[0] - t[2])})));
}

void make_unique(std::vector<Voxel>& voxels) {
  std::sort(voxels.begin(), voxels.end());
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
}

/// Calls visit(voxels) for batches of the sampled voxels, each batch without repetitions.
template <class F>
void for_each_batch(const GridTriangle& t, std::vector<Voxel>& voxels, F&& visit) {
  voxels.clear();
  const std::int64_t n = edge_parts(t);
  const auto put = [&](const Voxel& v) {
    if (voxels.empty() || voxels.back() != v) voxels.push_back(v);
  };
  if (n <= 1)
    for (const Eigen::Vector3d& corner : t) put(nearest_voxel(corner));
  else
    // Segment i runs at barycentric weight i/n off the first corner. In double precision a sum of three
    // products, so halves may round either way (see rasterize_by_samples()).
    for (std::int64_t i = 0; i <= n; ++i) {
      for (std::int64_t j = 0; j <= i; ++j)
        put(nearest_voxel((double(n - i) * t[0] + double(i - j) * t[1] + double(j) * t[2]) / double(n)));
      // A large triangle is passed on in parts, so that its voxels are never all in memory; a voxel in two
      // parts is added twice, without effect.
      if (voxels.size() < kVoxelsAtOnce) continue;
      make_unique(voxels);
      visit(voxels);
      voxels.clear();
    }
  make_unique(voxels);
  visit(voxels);
}

}  // namespace

std::vector<Voxel> rasterize_by_samples(const GridTriangle& triangle) {
  std::vector<Voxel> all, batch;
  for_each_batch(triangle, batch, [&](const std::vector<Voxel>& voxels) {
    all.insert(all.end(), voxels.begin(), voxels.end());
  });
  make_unique(all);
  return all;
}

}  // namespace hermesh

namespace hermesh::thesis {
namespace {

// The m subsets of §5.2. More than most machines have threads, and a constant, for the order in which voxels
// are updated affects distances (algorithm 2).
constexpr std::size_t kSubsets = 32;

/// A subset's grid while it is written. A voxel and its neighbours lie in up to eight blocks, which differ in
/// the parity of their coordinates: that makes a cache without conflicts.
class SubsetGrid {
 public:
  explicit SubsetGrid(const Triangles& triangles) : triangles_(triangles) {}

  /// Sets the triangle that the following voxels belong to.
  void begin_triangle(std::uint32_t id) {
    id_ = id;
    triangle_ = triangles_[id];
  }

  /// Updates a boundary voxel and its 18 neighbours as algorithm 1 does.
  void add_boundary_voxel(const Voxel& voxel) {
    const auto [block, sample] = at(voxel);
    add(block.boundary, sample);
    if (!test(block.set, sample) || block.triangle[sample] != id_) update(block, sample, voxel);
    for (const auto& [dx, dy, dz] : kNeighbours) add_neighbour({voxel[0] + dx, voxel[1] + dy, voxel[2] + dz});
  }

  Band take() { return std::move(band_); }

 private:
  /// A voxel's block and sample.
  struct At {
    BandBlock& block;
    int sample;
  };

  At at(const Voxel& v) {
    BandBlock*& cached = cache_[(v[0] >> 3 & 1) << 2 | (v[1] >> 3 & 1) << 1 | (v[2] >> 3 & 1)];
    const Voxel lower = {v[0] & ~7, v[1] & ~7, v[2] & ~7};
    if (!cached || cached->lower != lower) cached = &band_.block(band_.find_or_add(lower));
    return {*cached, sample_index(v[0] & 7, v[1] & 7, v[2] & 7)};
  }

  /// Updates a voxel next to a boundary voxel as algorithm 2 does. One that is nearer than ½ to an earlier
  /// triangle is unchanged, even if the new triangle is nearer: the print's trap. (0.25 is ½ squared.)
  void add_neighbour(const Voxel& voxel) {
    const auto [block, sample] = at(voxel);
    if (test(block.set, sample) && (block.squared_distance[sample] < 0.25f || block.triangle[sample] == id_))
      return;
    update(block, sample, voxel);
  }

  /// Takes the triangle's distance if it is the smaller one. Unset distances are infinite.
  void update(BandBlock& block, int sample, const Voxel& voxel) {
    const Eigen::Vector3d p = centre(voxel);
    const auto squared = float((closest_point(triangle_, p) - p).squaredNorm());
    add(block.set, sample);
    if (!(squared < block.squared_distance[sample])) return;
    block.squared_distance[sample] = squared;
    block.triangle[sample] = id_;
  }

  const Triangles& triangles_;
  std::uint32_t id_ = 0;
  GridTriangle triangle_;
  Band band_;
  std::array<BandBlock*, 8> cache_{};
};

/// The progress of all threads, counted by any, reported by the thread that made it.
class Progress {
 public:
  Progress(const RunContext& context, std::size_t total) : context_(context), total_(total) {}
  void add(std::size_t count) {
    const std::size_t done = done_ += count;
    if (std::this_thread::get_id() == owner_)
      context_.progress("rasterization", double(done) / double(total_));
  }

 private:
  const RunContext& context_;
  std::size_t total_;
  std::atomic<std::size_t> done_{0};
  std::thread::id owner_ = std::this_thread::get_id();
};

/// The parallel reduction over the subsets.
struct Rasterizer {
  const Triangles& triangles;
  const RunContext& context;
  Progress progress{context, triangles.corners.size()};

  std::size_t first_triangle(std::size_t subset) const {
    return triangles.corners.size() * subset / kSubsets;
  }

  Band rasterize_subset(std::size_t subset) {
    SubsetGrid grid(triangles);
    std::vector<Voxel> batch;
    const std::size_t first = first_triangle(subset), end = first_triangle(subset + 1);
    for (std::size_t t = first; t < end; ++t) {
      if (t % 64 == 0) context.check();
      if (t % 4096 == 4095) progress.add(4096);
      grid.begin_triangle(std::uint32_t(t));
      for_each_batch(triangles[std::uint32_t(t)], batch, [&](const std::vector<Voxel>& voxels) {
        context.check();
        for (const Voxel& voxel : voxels) grid.add_boundary_voxel(voxel);
      });
    }
    return grid.take();
  }

  /// Rasterises the subsets from `first` to before `end` into one grid: the parallel reduction of §3.4. The
  /// tree of merges is fixed, and a branch is merged as soon as it is done, so that few grids exist at a
  /// time.
  Band rasterize_subsets(std::size_t first, std::size_t end) {
    if (end - first == 1) return rasterize_subset(first);
    const std::size_t middle = first + (end - first) / 2;
    Band left, right;
    tbb::parallel_invoke([&] { left = rasterize_subsets(first, middle); },
                         [&] { right = rasterize_subsets(middle, end); });
    left.merge(std::move(right), context);
    return left;
  }
};

}  // namespace

Band rasterize(const Triangles& triangles, RunContext& context) {
  const Stage stage(context, "rasterization");
  Band band = Rasterizer{triangles, context}.rasterize_subsets(0, kSubsets);
  band.link(0, context);
  return band;
}

}  // namespace hermesh::thesis
