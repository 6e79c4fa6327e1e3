#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_collapse/domain_mesh.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr double kFirstSide = 32.0;  ///< voxels: about a thousand triangles, which fit a core's cache
/// Most domains of the first round that a triangle is listed in, in the mean: those of a mesh that was not
/// made from voxels can be far larger than a domain.
constexpr double kMostDomains = 64.0;
/// Displacement of the domains of a round, as a share of their side, so that no two rounds share borders.
constexpr double kDisplacement = 0.382;
/// Longest edge that a round makes, as a share of the side: parts at a border must not stay much finer.
constexpr double kLongestEdge = 0.25;

/// A triangle in one of the domains that its box touches.
struct Entry {
  std::uint64_t domain;  ///< 21 bits an axis
  std::uint32_t triangle;
  auto operator<=>(const Entry&) const = default;
};

/// One round: the mesh divided among domains of one size, each processed by one thread.
class Round {
 public:
  Round(DecimatedMesh& mesh, const Bounds& box, double side, RunContext& context)
      : mesh_(mesh), side_(side), start_(box.lower - Vector3d::Constant(kDisplacement * side)) {
    // Sorted by domain, then by index: the order of a domain's triangles is unique.
    enter_triangles(context);
    triangles_.resize(entries_.size());
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      triangles_[i] = entries_[i].triangle;
      if (i == 0 || entries_[i].domain != entries_[i - 1].domain) first_.push_back(i);
    }
    first_.push_back(entries_.size());
  }

  /// Collapses edges in all domains, and returns the joins in the order of domains.
  std::vector<std::vector<Join>> run(Collapses kind, const RunContext& context) {
    std::vector<std::vector<Join>> joins(first_.size() - 1);
    // Domains are taken one by one, not by sixteen as in parallel_blocks(): each is enough work.
    tbb::parallel_for(std::size_t{0}, joins.size(), [&](std::size_t d) {
      context.check();
      const auto triangles = std::span(triangles_).subspan(first_[d], first_[d + 1] - first_[d]);
      joins[d] = collapse_in_domain(mesh_, kind, domain_of(d), triangles, local_.local(), context);
    });
    return joins;
  }

 private:
  Domain domain_of(std::size_t domain) const {
    constexpr std::uint64_t kMask = (1u << 21) - 1;
    const std::uint64_t key = entries_[first_[domain]].domain;
    return {start_, side_, {key >> 42, (key >> 21) & kMask, key & kMask}, kLongestEdge * side_};
  }
  void enter_triangles(const RunContext& context) {
    // Count, scan, fill; the sort completes the order.
    const std::size_t n = mesh_.triangles.size();
    std::vector<std::uint64_t> counts(n);
    parallel_blocks(n, context,
                    [&](std::size_t t) { for_each_domain(t, [&](std::uint64_t) { ++counts[t]; }); });
    entries_.resize(exclusive_scan(counts, "triangles"));
    parallel_blocks(n, context, [&](std::size_t t) {
      std::size_t at = counts[t];
      for_each_domain(t, [&](std::uint64_t d) { entries_[at++] = {d, static_cast<std::uint32_t>(t)}; });
    });
    tbb::parallel_sort(entries_.begin(), entries_.end());
  }
  template <class F>
  void for_each_domain(std::size_t t, F&& f) const {
    if (!mesh_.alive(t)) return;
    Bounds box;
    for (const std::uint32_t p : mesh_.triangles[t]) box.add(mesh_.points[p]);
    // By box: possibly more domains than the triangle touches, but never fewer.
    const Domain::Index low = Domain::index_of(box.lower, start_, side_),
                        high = Domain::index_of(box.upper, start_, side_);
    for (std::uint64_t x = low[0]; x <= high[0]; ++x)
      for (std::uint64_t y = low[1]; y <= high[1]; ++y)
        for (std::uint64_t z = low[2]; z <= high[2]; ++z) f(x << 42 | y << 21 | z);
  }
  DecimatedMesh& mesh_;
  const double side_;
  const Vector3d start_;
  std::vector<Entry> entries_;            ///< ascending
  std::vector<std::uint32_t> triangles_;  ///< of the entries, in their order
  std::vector<std::size_t> first_;        ///< first entry of each domain, and the end
  // As large as the whole mesh, so there is one for each thread and not one for each domain.
  tbb::enumerable_thread_specific<std::vector<std::uint32_t>> local_;
};

/// Removes dead triangles; the others keep their order and their lists of samples.
void erase_dead(DecimatedMesh& mesh) {
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

/// Attaches every sample to a triangle near it, except those that are unmoved vertices.
void attach_samples(DecimatedMesh& mesh, const MergeForest& forest, const MergedMesh& merged,
                    const RunContext& context) {
  std::vector<std::uint32_t> nearest(mesh.input.fine.points().size(), FineMesh::kNone);
  parallel_blocks(nearest.size(), context, [&](std::size_t i) {
    const auto sample = static_cast<std::uint32_t>(i);
    if (forest.set_of(sample) == MergeForest::kNone) return;
    // A component merged into two vertices has no triangle left; the proof restores it.
    const std::uint32_t point = merged.number[forest.leader(sample)];
    if (point == MergeForest::kNone) return;
    const Vector3d& p = mesh.input.fine.points()[sample];
    const std::uint32_t start = merged.mesh->around(point).front();
    // Searched from the vertex that the sample was merged into. A nearer triangle may be missed: the
    // guarantees rest on merge_proof.h only, so one that is near enough is sufficient.
    nearest[i] = merged.mesh->walk(start, p);
    const Corners corners = merged.mesh->corners(nearest[i]);
    const double within = mesh.input.tolerance[sample];
    if (squared_distance(p, corners[0], corners[1], corners[2]) <= within * within) return;
    double squared;
    nearest[i] = merged.mesh->nearest_around(nearest[i], p, squared);
  });
  mesh.next_sample.assign(nearest.size(), FineMesh::kNone);
  // In one thread, ascending: the lists are the same for any number of threads.
  for (std::uint32_t sample = 0; sample < nearest.size(); ++sample) {
    if (nearest[sample] == FineMesh::kNone) continue;
    mesh.next_sample[sample] = mesh.first_sample[nearest[sample]];
    mesh.first_sample[nearest[sample]] = sample;
  }
}

/// Returns the merged mesh with the planes and tolerances of all that its vertices represent. Edges at the
/// vertices `where` are tested in the first round.
DecimatedMesh begin(const MergeForest& forest, const MergedMesh& merged, std::span<const std::uint8_t> where,
                    const DecimationInput& input, const RunContext& context) {
  const std::size_t n = merged.leaders.size();
  DecimatedMesh mesh(input, merged.leaders);
  mesh.points.resize(n);
  mesh.quadrics.resize(n);
  mesh.least_tolerance.resize(n);
  mesh.unmoved.resize(n);
  mesh.dirty.resize(n);
  mesh.dirty_next.resize(n);
  mesh.fine_triangle = merged.origin;
  mesh.first_sample.assign(merged.origin.size(), FineMesh::kNone);
  parallel_blocks(n, context, [&](std::size_t i) {
    const std::uint32_t p = merged.leaders[i], set = forest.set_of(p);
    mesh.unmoved[i] = set == MergeForest::kNone;
    mesh.dirty[i] = where.empty() || where[p];
    mesh.points[i] = merged.mesh->points()[i];
    mesh.least_tolerance[i] = input.tolerance[p];
    if (set == MergeForest::kNone) {
      mesh.quadrics[i] = quadric_at(input.fine, p);
      return;
    }
    mesh.quadrics[i] = forest.node(set).quadric;
    for (const std::uint32_t sample : forest.members(set))
      mesh.least_tolerance[i] = std::min(mesh.least_tolerance[i], input.tolerance[sample]);
  });
  mesh.triangles = merged.mesh->triangles();
  return mesh;
}

/// Returns the side of the domains of the first round, voxels.
double first_side(const DecimatedMesh& mesh) {
  for (double side = kFirstSide;; side *= 2) {
    double domains = 0.0;
    for (const Triangle& t : mesh.triangles) {
      Bounds box;
      for (const std::uint32_t p : t) box.add(mesh.points[p]);
      domains += (box.size() / side + Vector3d::Ones()).prod();
    }
    if (domains <= kMostDomains * double(mesh.triangles.size())) return side;
  }
}

}  // namespace

void collapse_edges(MergeForest& forest, const MergedMesh& merged, std::span<const std::uint8_t> where,
                    const DecimationInput& input, Collapses kind, RunContext& context) {
  DecimatedMesh mesh = begin(forest, merged, where, input, context);
  if (kind == Collapses::careful) attach_samples(mesh, forest, merged, context);
  Bounds box;
  for (const Vector3d& p : merged.mesh->points()) box.add(p);
  // No edge is longer than the box's diagonal.
  const double largest = (box.upper - box.lower).norm();
  for (double side = first_side(mesh); !mesh.triangles.empty(); side *= 2) {
    Round round(mesh, box, side, context);
    // Joins of one domain build on one another; domains share no vertices. In the order of domains, so nodes
    // have the same numbers for any number of threads.
    for (const auto& joins : round.run(kind, context))
      for (const Join& join : joins) forest.join(join.going, join.node);
    erase_dead(mesh);
    mesh.dirty.swap(mesh.dirty_next);
    std::fill(mesh.dirty_next.begin(), mesh.dirty_next.end(), 0);
    if (std::ranges::find(mesh.dirty, 1) == mesh.dirty.end()) break;  // no edge is left to test
    // Then the limit of edges no longer binds, and since the first domain begins 0.382 sides before the box,
    // it contained the whole mesh.
    if (kLongestEdge * side > largest) break;
  }
  forest.settle();
}

}  // namespace hermesh
