#include "algorithms/extraction/certified_collapse/decimation.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_collapse/cube_decimation.h"
#include "algorithms/extraction/certified_collapse/cube_mesh.h"
#include "algorithms/extraction/contact/triangle_grid.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr double kFirstSide = 32.0;  ///< voxels: some thousand triangles, which fit a core's cache
/// Share of a cube's side by which the cubes of a round are displaced, so that no two rounds have borders in
/// common.
constexpr double kDisplacement = 0.382;
/// Longest edge that a round makes, as a share of the side: what lies at a border must not fall far behind
/// the rest.
constexpr double kLongestEdge = 0.25;

/// A triangle in one of the cubes that its box touches.
struct Entry {
  std::uint64_t cube;  ///< 21 bits an axis
  std::uint32_t triangle;
  bool operator<(const Entry& other) const {
    return cube != other.cube ? cube < other.cube : triangle < other.triangle;
  }
};

/// One round: the mesh divided among cubes of one size, each done by one thread.
class Round {
 public:
  Round(DecimatedMesh& mesh, const Bounds& box, double side, RunContext& context)
      : mesh_(mesh), side_(side), start_(box.lower - Vector3d::Constant(kDisplacement * side)) {
    // Sorted by cube and then by number: each cube sees its triangles in one order.
    file_triangles(context);
    triangles_.resize(entries_.size());
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      triangles_[i] = entries_[i].triangle;
      if (i == 0 || entries_[i].cube != entries_[i - 1].cube) first_.push_back(i);
    }
    first_.push_back(entries_.size());
  }

  std::size_t cube_count() const { return first_.size() - 1; }

  /// Collapses edges in all cubes; the joins are returned by cube, in the order of cubes.
  std::vector<std::vector<Join>> run(Collapses kind, const FilePoints& file, const RunContext& context) {
    std::vector<std::vector<Join>> joins(cube_count());
    // Cubes are taken one by one, not by sixteen as in parallel_blocks(): each is work enough.
    tbb::parallel_for(std::size_t{0}, cube_count(), [&](std::size_t c) {
      context.check();
      const auto cube = static_cast<std::uint32_t>(c);
      joins[c] =
          decimate_cube(mesh_, kind, file, cube_of(cube), triangles_of(cube), numbers_.local(), context);
    });
    return joins;
  }

 private:
  std::span<const std::uint32_t> triangles_of(std::uint32_t cube) const {
    return std::span(triangles_).subspan(first_[cube], first_[cube + 1] - first_[cube]);
  }
  DecimationCube cube_of(std::uint32_t cube) const {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    const std::uint64_t key = entries_[first_[cube]].cube;
    return {start_, side_, {key >> 42, (key >> 21) & kMask, key & kMask}, kLongestEdge * side_};
  }
  void file_triangles(RunContext& context) {
    // Count, scan, fill; the sort makes the order whole.
    const std::size_t n = mesh_.triangles.size();
    std::vector<std::uint64_t> counts(n);
    parallel_blocks(n, context,
                    [&](std::size_t t) { for_each_cube(t, [&](std::uint64_t) { ++counts[t]; }); });
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
    Bounds box;
    for (const std::uint32_t p : mesh_.triangles[t]) box.add(mesh_.points[p]);
    // By box: more cubes than the triangle touches, but never fewer.
    const DecimationCube::Index low = DecimationCube::index_of(box.lower, start_, side_),
                                high = DecimationCube::index_of(box.upper, start_, side_);
    for (std::uint64_t x = low[0]; x <= high[0]; ++x)
      for (std::uint64_t y = low[1]; y <= high[1]; ++y)
        for (std::uint64_t z = low[2]; z <= high[2]; ++z) f(x << 42 | y << 21 | z);
  }
  DecimatedMesh& mesh_;
  const double side_;
  const Vector3d start_;
  std::vector<Entry> entries_;            ///< ascending by cube
  std::vector<std::uint32_t> triangles_;  ///< triangles of the entries, in their order
  std::vector<std::size_t> first_;        ///< first entry of each cube, and the end
  // As large as the whole mesh, so there is one for each thread and not one for each cube.
  tbb::enumerable_thread_specific<CubeNumbers> numbers_;
};

/// Drops the triangles that are gone, in order. Samples keep their lists, which hang on the triangles that
/// stay.
void forget_the_dead(DecimatedMesh& mesh) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (!mesh.alive(t)) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    mesh.first_sample[kept] = mesh.first_sample[t];
    mesh.fine_triangle[kept] = mesh.fine_triangle[t];
    ++kept;
  }
  mesh.triangles.resize(kept);
  mesh.first_sample.resize(kept);
  mesh.fine_triangle.resize(kept);
}

/// Attaches every sample to a triangle near it, but for those that are points where they were.
void attach_samples(DecimatedMesh& mesh, const MergeForest& forest, const MergedMesh& merged,
                    const RunContext& context) {
  std::vector<std::uint32_t> nearest(mesh.unmoved.size(), kNoTriangle);
  parallel_blocks(nearest.size(), context, [&](std::size_t i) {
    const auto sample = static_cast<std::uint32_t>(i);
    if (mesh.unmoved[sample]) return;
    // A part all of whose points have gone into two has no triangle left; the proof brings it back.
    const std::uint32_t point = merged.number[forest.leader(sample)];
    if (point == MergeForest::kNone) return;
    const Vector3d& p = mesh.fine->points()[sample];
    const std::uint32_t start = merged.mesh->around(point).front();
    // Found from the point that the sample went into. A nearer triangle may be missed: what is promised rests
    // on merge_proof.h alone, and not on what is attached here. So one that is near enough will do.
    nearest[i] = merged.mesh->walk(start, p);
    const Corners corners = merged.mesh->corners(nearest[i]);
    const double within = mesh.tolerance[sample];
    if (squared_distance(p, corners[0], corners[1], corners[2]) <= within * within) return;
    double squared;
    nearest[i] = merged.mesh->nearest_around(nearest[i], p, squared);
  });
  // In one thread, ascending: the lists are the same for every number of threads.
  for (std::uint32_t sample = 0; sample < nearest.size(); ++sample) {
    if (nearest[sample] == kNoTriangle) continue;
    mesh.next_sample[sample] = mesh.first_sample[nearest[sample]];
    mesh.first_sample[nearest[sample]] = sample;
  }
}

/// The merged mesh with the numbers of the fine one, and with the planes and tolerances of all that its
/// points stand for. Edges of the points `where` are worth a look in the first round.
DecimatedMesh begin(const MergeForest& forest, const MergedMesh& merged, std::span<const std::uint8_t> where,
                    const FineMesh& fine, std::span<const float> tolerance, const RunContext& context) {
  const std::size_t n = fine.points().size();
  DecimatedMesh mesh;
  mesh.fine = &fine;
  mesh.tolerance = tolerance;
  mesh.points.resize(n);
  mesh.quadrics.resize(n);
  mesh.least_tolerance.resize(n);
  mesh.unmoved.resize(n);
  mesh.dirty.resize(n);
  mesh.dirty_next.resize(n);
  mesh.fine_triangle = merged.origin;
  mesh.first_sample.assign(merged.origin.size(), kNoSample);
  mesh.next_sample.assign(n, kNoSample);
  parallel_blocks(n, context, [&](std::size_t i) {
    mesh.unmoved[i] = forest.set_of(static_cast<std::uint32_t>(i)) == MergeForest::kNone;
  });
  parallel_blocks(merged.leaders.size(), context, [&](std::size_t i) {
    const std::uint32_t p = merged.leaders[i], set = forest.set_of(p);
    mesh.dirty[p] = where.empty() || where[p];
    mesh.points[p] = merged.mesh->points()[i];
    mesh.least_tolerance[p] = tolerance[p];
    if (set == MergeForest::kNone) {
      mesh.quadrics[p] = quadric_at(fine, p);
      return;
    }
    mesh.quadrics[p] = forest.node(set).quadric;
    for (const std::uint32_t sample : forest.members(set))
      mesh.least_tolerance[p] = std::min(mesh.least_tolerance[p], tolerance[sample]);
  });
  mesh.triangles = merged.mesh->triangles();
  for (Triangle& t : mesh.triangles)
    for (std::uint32_t& p : t) p = merged.leaders[p];
  return mesh;
}

}  // namespace

void collapse_edges(MergeForest& forest, const MergedMesh& merged, std::span<const std::uint8_t> where,
                    const FineMesh& fine, std::span<const float> tolerance,
                    std::span<const std::uint8_t> pinned, Collapses kind, double moment,
                    const FilePoints& file, RunContext& context) {
  DecimatedMesh mesh = begin(forest, merged, where, fine, tolerance, context);
  mesh.pinned = pinned;
  mesh.moment = moment;
  if (kind == Collapses::careful) attach_samples(mesh, forest, merged, context);
  Bounds box;
  for (const Vector3d& p : merged.mesh->points()) box.add(p);
  // No edge is longer than the box's diagonal.
  const double largest = (box.upper - box.lower).norm();
  for (double side = kFirstSide; !mesh.triangles.empty(); side *= 2) {
    Round round(mesh, box, side, context);
    // Joins of one cube build on one another; cubes have no points in common. In the order of cubes, so nodes
    // have the same numbers for every number of threads.
    for (const auto& joins : round.run(kind, file, context))
      for (const Join& join : joins) forest.join(join.going, join.node);
    forget_the_dead(mesh);
    mesh.dirty.swap(mesh.dirty_next);
    std::fill(mesh.dirty_next.begin(), mesh.dirty_next.end(), 0);
    if (std::ranges::find(mesh.dirty, 1) == mesh.dirty.end())
      break;  // no round is left that would look at an edge
    // Then the limit of edges binds no more, and as the first cube begins 0.382 sides before the box, that
    // cube has held the whole mesh.
    if (kLongestEdge * side > largest) break;
  }
  forest.settle();
}

}  // namespace hermesh
