#include "algorithms/remesh/manifold_polygons.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <iterator>
#include <mutex>
#include <numeric>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/contact/triangle_grid.h"
#include "algorithms/remesh/topology.h"
#include "algorithms/remesh/two_sided_proof.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

/// Of this many triangles one may meet another; a volume shows such meshes better if there are more.
constexpr std::size_t kFewMeet = 32;

/// Returns true if each side of a triangle is that of exactly one other, in reverse.
bool is_closed(const FineMesh& mesh) {
  const std::vector<Triangle>& triangles = mesh.triangles();
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t side = mesh.side_across(t, i);
      // Of several triangles across a side all but one have another one across theirs.
      if (side == FineMesh::kNone || mesh.side_across(side / 3, int(side % 3)) != 3 * t + std::uint32_t(i))
        return false;
    }
  return true;
}

/// Returns true if the triangles around each vertex of a closed mesh are one fan.
bool is_manifold(const FineMesh& mesh) {
  for (std::uint32_t p = 0; p < mesh.points().size(); ++p) {
    const auto around = mesh.around(p);
    if (around.empty()) continue;
    std::size_t count = 0;
    std::uint32_t t = around.front();
    do {
      const Triangle& c = mesh.triangles()[t];
      t = mesh.across(t, c[0] == p ? 0 : c[1] == p ? 1 : 2);
    } while (++count <= around.size() && t != around.front());
    if (count != around.size()) return false;
  }
  return true;
}

/// Returns the pairs of triangles that may meet, ascending; none if there are more than `most`.
std::optional<std::vector<std::array<std::uint32_t, 2>>> contacts(const FineMesh& mesh, std::size_t most,
                                                                  const RunContext& context) {
  const std::size_t n = mesh.triangles().size();
  std::vector<Bounds> boxes(n);
  for (std::uint32_t t = 0; t < n; ++t)
    for (const Eigen::Vector3d& p : mesh.corners(t)) boxes[t].add(p);
  const TriangleGrid grid(boxes);
  std::vector<std::array<std::uint32_t, 2>> result;
  std::mutex mutex;
  std::atomic<std::size_t> count = 0;
  parallel_blocks(n, context, [&](std::size_t i) {
    if (count > most) return;
    const auto t = static_cast<std::uint32_t>(i);
    // Each pair once: from the triangle of the smaller level, at equal levels from the first.
    grid.visit(t, grid.level(t), [&](std::uint32_t u) {
      if (u == t || (grid.level(u) == grid.level(t) && u < t) || !boxes[t].overlaps(boxes[u])) return;
      if (certainly_apart(mesh.triangles()[t], mesh.triangles()[u], mesh.points())) return;
      ++count;
      const std::lock_guard lock(mutex);
      result.push_back({std::min(t, u), std::max(t, u)});
    });
  });
  if (count > most) return std::nullopt;
  // The same pair may have been found in several cells.
  std::ranges::sort(result);
  result.erase(std::ranges::unique(result).begin(), result.end());
  return result;
}

/// Tests the triangles `among`, with which all contacts are, against all; returns flags as
/// ManifoldPolygons::meets.
std::vector<std::uint8_t> in_contact_with(const ManifoldPolygons& mesh, std::span<const std::uint32_t> among,
                                          const FineMesh& fine, double unit, const RunContext& context) {
  std::vector<Triangle> tested;
  for (const std::uint32_t t : among) tested.push_back(mesh.triangles[t]);
  const TriangleTree tree(mesh.points, tested, 1.0 / unit);
  std::vector<std::uint8_t> result(mesh.triangles.size());
  parallel_blocks(result.size(), context, [&](std::size_t i) {
    const auto t = static_cast<std::uint32_t>(i);
    Bounds box;
    for (const Eigen::Vector3d& p : fine.corners(t)) box.add(p);
    tree.for_each_near(box.lower, box.upper, [&](std::uint32_t number) {
      const std::uint32_t u = among[number];
      if (u == t || certainly_apart(mesh.triangles[t], mesh.triangles[u], fine.points())) return;
      std::atomic_ref(result[t]).store(1, std::memory_order_relaxed);
      std::atomic_ref(result[u]).store(1, std::memory_order_relaxed);
    });
  });
  return result;
}

/// One round of untangled(): collapses that do not affect each other.
class Untangling {
 public:
  Untangling(const ManifoldPolygons& mesh, const FineMesh& fine)
      : fine_(fine), points_(mesh.points), into_(points_.size()), touched_(points_.size()) {
    std::iota(into_.begin(), into_.end(), 0u);
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      if (mesh.meets[t]) collapse_a_side(mesh.triangles[t]);
  }
  bool is_idle() const { return !any_; }

  /// Applies the collapses, and returns the triangles that changed or met others.
  std::vector<std::uint32_t> apply(ManifoldPolygons& mesh) {
    std::vector<std::uint32_t> changed;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      Triangle t = mesh.triangles[i];
      bool is_changed = mesh.meets[i];
      for (std::uint32_t& p : t) is_changed |= touched_[p] != 0, p = into_[p];
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      if (is_changed) changed.push_back(std::uint32_t(kept));
      mesh.triangles[kept++] = t;
    }
    mesh.triangles.resize(kept);
    mesh.points = std::move(points_);
    return changed;
  }

 private:
  std::vector<std::uint32_t> neighbours(std::uint32_t p) const {
    std::vector<std::uint32_t> result;
    for (const std::uint32_t t : fine_.around(p)) result.push_back(fine_.next(t, p));
    std::ranges::sort(result);
    return result;
  }

  /// Collapses the shortest side whose ends have only two neighbours in common, so that the mesh remains
  /// manifold.
  void collapse_a_side(const Triangle& t) {
    std::array<int, 3> sides = {0, 1, 2};
    const auto length = [&](int i) { return (points_[t[i]] - points_[t[(i + 1) % 3]]).squaredNorm(); };
    std::ranges::stable_sort(sides, {}, length);
    for (const int side : sides) {
      const std::uint32_t a = t[side], b = t[(side + 1) % 3];
      const std::vector<std::uint32_t> around_a = neighbours(a), around_b = neighbours(b);
      std::vector<std::uint32_t> common, all;
      std::ranges::set_intersection(around_a, around_b, std::back_inserter(common));
      std::ranges::set_union(around_a, around_b, std::back_inserter(all));  // a and b are in it
      if (common.size() != 2 || all.size() <= 4) continue;
      if (std::ranges::any_of(all, [&](std::uint32_t p) { return touched_[p] != 0; })) continue;
      for (const std::uint32_t p : all) touched_[p] = 1;
      points_[a] = 0.5f * (points_[a] + points_[b]);
      into_[b] = a;
      any_ = true;
      return;
    }
  }

  const FineMesh& fine_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::uint32_t> into_;    ///< vertex that each is merged into
  std::vector<std::uint8_t> touched_;  ///< by vertex: 1 if a triangle around it changes in this round
  bool any_ = false;
};

}  // namespace

ManifoldPolygons untangled(ManifoldPolygons mesh, const RunContext& context) {
  constexpr int kMostRounds = 16;
  const double unit = std::exp2(std::round(std::log2(mesh.mean_edge)));
  for (int round = 0; round < kMostRounds && !mesh.is_embedded(); ++round) {
    const FineMesh before(scaled(mesh.points, unit), mesh.triangles, context);
    Untangling collapses(mesh, before);
    if (collapses.is_idle()) break;
    const std::vector<std::uint32_t> changed = collapses.apply(mesh);
    const FineMesh fine(scaled(mesh.points, unit), mesh.triangles, context);
    mesh.meets = in_contact_with(mesh, changed, fine, unit, context);
  }
  return mesh;
}

std::vector<Eigen::Vector3d> scaled(std::span<const Eigen::Vector3f> points, double unit) {
  std::vector<Eigen::Vector3d> result(points.size());
  std::ranges::transform(points, result.begin(), [&](const Eigen::Vector3f& p) -> Eigen::Vector3d {
    return p.cast<double>() / unit;
  });
  return result;
}

bool ManifoldPolygons::is_embedded() const { return std::ranges::find(meets, 1) == meets.end(); }

std::optional<ManifoldPolygons> manifold_polygons(const PolygonMesh& mesh, std::span<const std::int8_t> turns,
                                                  const RunContext& context) {
  ManifoldPolygons result;
  std::vector<Triangle> triangles = triangulated(mesh);
  const std::vector<std::uint32_t> first = first_at_position(mesh.points);
  std::vector<std::uint32_t> number(mesh.points.size(), FineMesh::kNone);
  double edges = 0.0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Triangle t = triangles[i];
    for (std::uint32_t& p : t) p = first[p];
    if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
    if (turns[i] == 0) return std::nullopt;
    if (turns[i] < 0) std::swap(t[1], t[2]);
    if (!(area(mesh.points, t) > 0.0)) return std::nullopt;
    edges += (mesh.points[t[0]] - mesh.points[t[1]]).cast<double>().norm();
    for (std::uint32_t& p : t) {
      if (number[p] == FineMesh::kNone) {
        number[p] = std::uint32_t(result.points.size());
        result.points.push_back(mesh.points[p]);
      }
      p = number[p];
    }
    result.triangles.push_back(t);
  }
  if (result.triangles.empty()) return std::nullopt;
  result.mean_edge = edges / double(result.triangles.size());
  const double unit = std::exp2(std::round(std::log2(result.mean_edge)));
  const FineMesh fine(scaled(result.points, unit), result.triangles, context);
  if (!is_closed(fine) || !is_manifold(fine)) return std::nullopt;
  auto pairs = contacts(fine, result.triangles.size() / kFewMeet, context);
  if (!pairs) return std::nullopt;
  result.pairs = std::move(*pairs);
  result.meets.resize(result.triangles.size());
  for (const auto& [t, u] : result.pairs) result.meets[t] = result.meets[u] = 1;
  return result;
}

std::vector<std::uint32_t> largest_of_patch(const ManifoldPolygons& mesh) {
  const std::size_t n = mesh.triangles.size();
  // Sides of triangles that meet no other, by their ends; each occurs once or twice.
  std::vector<std::array<std::uint32_t, 3>> sides;
  for (std::uint32_t t = 0; t < n; ++t)
    for (std::size_t i = 0; i < 3 && !mesh.meets[t]; ++i) {
      const auto [low, high] = std::minmax(mesh.triangles[t][i], mesh.triangles[t][(i + 1) % 3]);
      sides.push_back({low, high, t});
    }
  std::ranges::sort(sides);
  DisjointSets sets(n);
  for (std::size_t i = 1; i < sides.size(); ++i)
    if (sides[i][0] == sides[i - 1][0] && sides[i][1] == sides[i - 1][1])
      sets.join(sides[i][2], sides[i - 1][2]);
  std::vector<std::uint32_t> largest(n, FineMesh::kNone);
  std::vector<double> most(n, 0.0);
  for (std::uint32_t i = 0; i < n; ++i) {
    if (mesh.meets[i]) continue;
    const std::uint32_t set = sets.find(i);
    if (const double here = area(mesh.points, mesh.triangles[i]); here > most[set])
      most[set] = here, largest[set] = i;
  }
  for (std::uint32_t i = 0; i < n; ++i)
    if (!mesh.meets[i]) largest[i] = largest[sets.find(i)];
  return largest;
}

std::vector<Triangle> pieces_apart(const ManifoldPolygons& mesh, double smallest,
                                   std::vector<Eigen::Vector3f>& points) {
  const auto corners = [&](std::uint32_t t) {
    const Triangle& c = mesh.triangles[t];
    return Corners{mesh.points[c[0]].cast<double>(), mesh.points[c[1]].cast<double>(),
                   mesh.points[c[2]].cast<double>()};
  };
  std::vector<std::vector<std::uint32_t>> others(mesh.triangles.size());
  for (const auto& [t, u] : mesh.pairs) others[t].push_back(u), others[u].push_back(t);
  std::vector<Triangle> result;
  std::vector<Corners> stack;
  for (std::uint32_t t = 0; t < others.size(); ++t) {
    if (others[t].empty()) continue;
    stack.assign(1, corners(t));
    while (!stack.empty()) {
      const Corners c = stack.back();
      stack.pop_back();
      if (std::ranges::all_of(others[t],
                              [&](std::uint32_t u) { return certainly_apart(c, corners(u), 0); })) {
        const auto first = std::uint32_t(points.size());
        for (const Eigen::Vector3d& p : c) points.push_back(p.cast<float>());
        result.push_back({first, first + 1, first + 2});
        continue;
      }
      const Corners half = {(c[1] + c[2]) / 2.0, (c[2] + c[0]) / 2.0, (c[0] + c[1]) / 2.0};
      if (std::max({(half[0] - half[1]).norm(), (half[1] - half[2]).norm(), (half[2] - half[0]).norm()}) <
          smallest)
        continue;
      for (const Corners& part : {Corners{c[0], half[2], half[1]}, Corners{half[2], c[1], half[0]},
                                  Corners{half[1], half[0], c[2]}, half})
        stack.push_back(part);
    }
  }
  return result;
}

}  // namespace hermesh
