#include "algorithms/extraction/manifold_dual_contouring/decimation.h"

#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/block_decimation.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_grid.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr double kFirstSide = 32.0;  ///< voxels: some thousand triangles, which fit a core's cache
/// Share of a cube's side by which the cubes of a round are displaced, so that no two rounds have borders in common.
constexpr double kDisplacement = 0.382;
/// Longest edge that a round makes, as a share of the side: what lies at a border must not fall far behind the rest.
constexpr double kLongestEdge = 0.25;

struct Entry {
  std::uint64_t cube;  ///< 21 bits an axis
  std::uint32_t triangle;
  bool operator<(const Entry& other) const {
    return cube != other.cube ? cube < other.cube : triangle < other.triangle;
  }
};

class Round {
 public:
  Round(DecimatedMesh& mesh, const Box3& box, double side)
      : mesh_(mesh), side_(side), start_(box.lower - Vector3d::Constant(kDisplacement * side)) {}

  void run(const FilePoints& file, RunContext& context) {
    file_triangles(context);
    std::vector<std::size_t> first;
    for (std::size_t i = 0; i < entries_.size(); ++i)
      if (i == 0 || entries_[i].cube != entries_[i - 1].cube) first.push_back(i);
    first.push_back(entries_.size());
    std::vector<std::uint32_t> triangles(entries_.size());
    for (std::size_t i = 0; i < entries_.size(); ++i) triangles[i] = entries_[i].triangle;
    tbb::parallel_for(std::size_t{0}, first.size() - 1, [&](std::size_t c) {
      context.check();
      const DecimationCube cube{lower_of(entries_[first[c]].cube), side_, kLongestEdge * side_};
      decimate_cube(mesh_, file, cube, std::span(triangles).subspan(first[c], first[c + 1] - first[c]), context);
    });
  }

 private:
  void file_triangles(RunContext& context) {
    const std::size_t n = mesh_.triangles.size();
    std::vector<std::uint64_t> counts(n);
    parallel_blocks(n, context, [&](std::size_t t) {
      for_each_cube(t, [&](std::uint64_t) { ++counts[t]; });
    });
    entries_.resize(exclusive_scan(counts, "triangles"));
    parallel_blocks(n, context, [&](std::size_t t) {
      std::size_t at = counts[t];
      for_each_cube(t, [&](std::uint64_t cube) { entries_[at++] = {cube, static_cast<std::uint32_t>(t)}; });
    });
    tbb::parallel_sort(entries_.begin(), entries_.end());
  }
  template <class F>
  void for_each_cube(std::size_t t, F&& f) const {
    if (!mesh_.alive(t)) return;
    Box3 box;
    for (const std::uint32_t p : mesh_.triangles[t]) box.add(mesh_.points[p]);
    std::array<std::uint64_t, 3> low, high;
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<std::uint64_t>(std::max(0.0, (box.lower[a] - start_[a]) / side_));
      high[a] = static_cast<std::uint64_t>(std::max(0.0, (box.upper[a] - start_[a]) / side_));
    }
    for (std::uint64_t x = low[0]; x <= high[0]; ++x)
      for (std::uint64_t y = low[1]; y <= high[1]; ++y)
        for (std::uint64_t z = low[2]; z <= high[2]; ++z) f(x << 42 | y << 21 | z);
  }
  Vector3d lower_of(std::uint64_t cube) const {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    return start_ + side_ * Vector3d(double(cube >> 42), double((cube >> 21) & kMask), double(cube & kMask));
  }

  DecimatedMesh& mesh_;
  const double side_;
  const Vector3d start_;
  std::vector<Entry> entries_;
};

void forget_the_dead(DecimatedMesh& mesh) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.alive(t)) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    mesh.first_sample[kept] = mesh.first_sample[t];
    for (std::uint32_t s = mesh.first_sample[kept]; s != kNoSample; s = mesh.next_sample[s])
      mesh.attached_to[s] = static_cast<std::uint32_t>(kept);
    ++kept;
  }
  mesh.triangles.resize(kept);
  mesh.first_sample.resize(kept);
}

}  // namespace

DecimatedMesh begin_decimation(const FineMesh& fine, std::vector<float> tolerance, RunContext& context) {
  Stage stage(context, "quadrics");
  const std::vector<Vector3d>& points = fine.points();
  DecimatedMesh mesh;
  mesh.fine = &fine;
  mesh.points = points;
  mesh.triangles = fine.triangles();
  mesh.quadrics.resize(points.size());
  mesh.unmoved.assign(points.size(), 1);
  mesh.stirred.assign(points.size(), 1);
  mesh.stirred_next.assign(points.size(), 0);
  mesh.first_sample.assign(mesh.triangles.size(), kNoSample);
  mesh.next_sample.assign(points.size(), kNoSample);
  mesh.attached_to.assign(points.size(), kNoTriangle);
  mesh.proposed.assign(points.size(), 0);
  mesh.tolerance = std::move(tolerance);
  for (const Triangle& t : mesh.triangles) {
    const Vector3d normal = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
    const double size = normal.norm();
    if (!(size > 0)) continue;
    for (const std::uint32_t p : t) mesh.quadrics[p].add_plane(normal / size, size / 6.0);
  }
  return mesh;
}

void decimate(DecimatedMesh& mesh, const FilePoints& file, RunContext& context) {
  Stage stage(context, "decimate");
  Box3 box;
  for (const Vector3d& p : mesh.points) box.add(p);
  const double largest = mesh.points.empty() ? 0.0 : (box.upper - box.lower).norm();
  for (double side = kFirstSide; !mesh.triangles.empty(); side *= 2) {
    Round(mesh, box, side).run(file, context);
    forget_the_dead(mesh);
    mesh.stirred.swap(mesh.stirred_next);
    std::fill(mesh.stirred_next.begin(), mesh.stirred_next.end(), 0);
    context.progress("decimate", std::min(1.0, side / (largest / kLongestEdge)));
    if (kLongestEdge * side > largest) break;
  }
}

}  // namespace hermesh
