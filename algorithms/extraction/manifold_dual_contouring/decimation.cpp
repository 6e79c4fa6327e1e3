#include "algorithms/extraction/manifold_dual_contouring/decimation.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/cube_decimation.h"
#include "algorithms/extraction/manifold_dual_contouring/cube_mesh.h"
#include "algorithms/extraction/manifold_dual_contouring/distance_certificate.h"
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
  Round(DecimatedMesh& mesh, const Box3& box, double side, RunContext& context)
      : mesh_(mesh), side_(side), start_(box.lower - Vector3d::Constant(kDisplacement * side)) {
    file_triangles(context);
    triangles_.resize(entries_.size());
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      triangles_[i] = entries_[i].triangle;
      if (i == 0 || entries_[i].cube != entries_[i - 1].cube) first_.push_back(i);
    }
    first_.push_back(entries_.size());
  }

  std::size_t cube_count() const { return first_.size() - 1; }

  void run(std::span<const std::uint32_t> cubes, const FilePoints& file, RunContext& context) {
    tbb::parallel_for(std::size_t{0}, cubes.size(), [&](std::size_t c) {
      context.check();
      decimate_cube(mesh_, file, cube_of(cubes[c]), triangles_of(cubes[c]), numbers_.local(), context);
    });
  }

  /// The cube that holds a place, cube_count() if there is none.
  std::uint32_t cube_at(const Vector3d& p) const {
    const DecimationCube::Index index = DecimationCube::index_of(p, start_, side_);
    const std::uint64_t key = index[0] << 42 | index[1] << 21 | index[2];
    const auto at = std::partition_point(first_.begin(), first_.end() - 1, [&](std::size_t i) { return entries_[i].cube < key; });
    const bool found = at != first_.end() - 1 && entries_[*at].cube == key;
    return static_cast<std::uint32_t>(found ? at - first_.begin() : first_.size() - 1);
  }

  /// Makes what a cube has changed as it was.
  void restore(std::uint32_t number, const DecimatedMesh& before) {
    const DecimationCube cube = cube_of(number);
    const auto restore_sample = [&](std::uint32_t s) {
      mesh_.attached_to[s] = before.attached_to[s];
      mesh_.next_sample[s] = before.next_sample[s];
    };
    for (const std::uint32_t t : triangles_of(number)) {
      const Triangle& corners = before.triangles[t];
      bool own = true;
      for (const std::uint32_t p : corners) own = own && cube.holds(before.points[p]);
      if (!own) continue;
      mesh_.triangles[t] = corners;
      mesh_.first_sample[t] = before.first_sample[t];
      for (std::uint32_t s = before.first_sample[t]; s != kNoSample; s = before.next_sample[s]) restore_sample(s);
      for (const std::uint32_t p : corners) {
        if (before.unmoved[p]) restore_sample(p);
        mesh_.points[p] = before.points[p];
        mesh_.quadrics[p] = before.quadrics[p];
        mesh_.unmoved[p] = before.unmoved[p];
        mesh_.below[p] = before.below[p];
      }
    }
  }

 private:
  std::span<const std::uint32_t> triangles_of(std::uint32_t cube) const {
    return std::span(triangles_).subspan(first_[cube], first_[cube + 1] - first_[cube]);
  }
  DecimationCube cube_of(std::uint32_t cube) const {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    const std::uint64_t key = entries_[first_[cube]].cube;
    return {start_, side_, {key >> 42, (key >> 21) & kMask, key & kMask}, kLongestEdge * side_, side_ == kFirstSide};
  }
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
    const DecimationCube::Index low = DecimationCube::index_of(box.lower, start_, side_),
                                high = DecimationCube::index_of(box.upper, start_, side_);
    for (std::uint64_t x = low[0]; x <= high[0]; ++x)
      for (std::uint64_t y = low[1]; y <= high[1]; ++y)
        for (std::uint64_t z = low[2]; z <= high[2]; ++z) f(x << 42 | y << 21 | z);
  }
  DecimatedMesh& mesh_;
  const double side_;
  const Vector3d start_;
  std::vector<Entry> entries_;             ///< by cube
  std::vector<std::uint32_t> triangles_;   ///< of the entries
  std::vector<std::size_t> first_;         ///< by cube: its first entry, and the end
  tbb::enumerable_thread_specific<CubeNumbers> numbers_;
};

/// Cubes that have a part in what could not be proved.
std::vector<std::uint32_t> cubes_of(const DistanceCertificate& certificate, const Round& round, const DecimatedMesh& mesh) {
  std::vector<std::uint32_t> cubes;
  for (const std::uint32_t s : certificate.samples) {
    cubes.push_back(round.cube_at(mesh.fine->points()[s]));
    const std::uint32_t t = mesh.attached_to[s];
    if (t == kNoTriangle) continue;
    for (const std::uint32_t p : mesh.triangles[t]) cubes.push_back(round.cube_at(mesh.points[p]));
  }
  std::sort(cubes.begin(), cubes.end());
  cubes.erase(std::unique(cubes.begin(), cubes.end()), cubes.end());
  std::erase(cubes, round.cube_count());
  return cubes;
}

/// Where the distance cannot be proved a cube is done again with less room for those concerned, and at last left as it was.
void run_certified(DecimatedMesh& mesh, Round& round, std::span<const float> tolerance, const FilePoints& file,
                   RunContext& context) {
  constexpr int kAttempts = 3;
  const DecimatedMesh before = mesh;
  std::vector<std::uint32_t> cubes(round.cube_count());
  std::iota(cubes.begin(), cubes.end(), 0u);
  for (int attempt = 1; attempt <= 2 * kAttempts && !cubes.empty(); ++attempt) {
    if (attempt <= kAttempts) round.run(cubes, file, context);
    const DistanceCertificate certificate = certify_distance(mesh, tolerance, &before, context);
    if (certificate.holds()) return;
    for (const std::uint32_t sample : certificate.samples) mesh.tolerance[sample] *= attempt == 1 ? 0.3f : 0.0f;
    cubes = cubes_of(certificate, round, mesh);
    for (const std::uint32_t cube : cubes) round.restore(cube, before);
  }
}

void forget_the_dead(DecimatedMesh& mesh) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.alive(t)) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    mesh.first_sample[kept] = mesh.first_sample[t];
    mesh.fine_triangle[kept] = mesh.fine_triangle[t];
    for (std::uint32_t s = mesh.first_sample[kept]; s != kNoSample; s = mesh.next_sample[s])
      mesh.attached_to[s] = static_cast<std::uint32_t>(kept);
    ++kept;
  }
  mesh.triangles.resize(kept);
  mesh.first_sample.resize(kept);
  mesh.fine_triangle.resize(kept);
}

}  // namespace

DecimatedMesh begin_decimation(const FineMesh& fine, std::vector<float> tolerance, std::vector<std::uint8_t> pinned,
                               RunContext& context) {
  Stage stage(context, "quadrics");
  const std::vector<Vector3d>& points = fine.points();
  DecimatedMesh mesh;
  mesh.fine = &fine;
  mesh.points = points;
  mesh.triangles = fine.triangles();
  mesh.quadrics.resize(points.size());
  mesh.fine_triangle.resize(mesh.triangles.size());
  std::iota(mesh.fine_triangle.begin(), mesh.fine_triangle.end(), 0u);
  mesh.pinned = std::move(pinned);
  mesh.pinned.resize(points.size(), 0);
  mesh.unmoved.assign(points.size(), 1);
  mesh.below.resize(points.size());
  for (std::uint32_t p = 0; p < points.size(); ++p) mesh.below[p] = fine.around(p).empty() ? 0 : fine.around(p).front();
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

void decimate(DecimatedMesh& mesh, std::span<const float> tolerance, const FilePoints& file, RunContext& context) {
  Stage stage(context, "decimate");
  Box3 box;
  for (const Vector3d& p : mesh.points) box.add(p);
  const double largest = mesh.points.empty() ? 0.0 : (box.upper - box.lower).norm();
  for (double side = kFirstSide; !mesh.triangles.empty(); side *= 2) {
    Round round(mesh, box, side, context);
    run_certified(mesh, round, tolerance, file, context);
    forget_the_dead(mesh);
    mesh.stirred.swap(mesh.stirred_next);
    std::fill(mesh.stirred_next.begin(), mesh.stirred_next.end(), 0);
    context.progress("decimate", std::min(1.0, side / (largest / kLongestEdge)));
    if (kLongestEdge * side > largest) break;
  }
}

}  // namespace hermesh
