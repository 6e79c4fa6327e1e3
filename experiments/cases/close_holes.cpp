#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "algorithms/core/error.h"
#include "experiments/cases/recipe_shapes.h"

namespace hermesh {

using recipes::next_index;

namespace {

/// The mesh without the points that no polygon uses.
PolygonMesh compacted(const PolygonMesh& mesh) {
  constexpr std::uint32_t unused = 0xffffffff;
  std::vector<std::uint32_t> number(mesh.points.size(), unused);
  PolygonMesh result;
  result.origin = mesh.origin;
  result.triangles = triangulated(mesh);
  for (const Triangle& triangle : result.triangles)
    for (const std::uint32_t corner : triangle) number[corner] = 0;
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] == unused) continue;
    number[i] = next_index(result);
    result.points.push_back(mesh.points[i]);
  }
  for (Triangle& triangle : result.triangles)
    for (std::uint32_t& corner : triangle) corner = number[corner];
  return result;
}

/// The boundary edge that goes out of each point, in the direction in which the missing polygon would have
/// it.
std::map<std::uint32_t, std::uint32_t> boundary_edges(const PolygonMesh& mesh) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (const auto& [a, b, c] : mesh.triangles) edges.insert(edges.end(), {{a, b}, {b, c}, {c, a}});
  std::ranges::sort(edges);
  if (std::ranges::adjacent_find(edges) != edges.end())
    throw Error(
        "holes cannot be closed: an edge has more than two polygons, or two that are turned against each "
        "other");
  std::map<std::uint32_t, std::uint32_t> next;
  for (const auto& [a, b] : edges)
    if (!std::ranges::binary_search(edges, std::pair(b, a)) && !next.emplace(b, a).second)
      throw Error("holes cannot be closed: two of them touch in a point");
  return next;
}

/// The triangulation of a loop, without further points, that has the smallest area (Barequet & Sharir,
/// Filling Gaps in the Boundary of a Polyhedron, 1995), among those that use no edge which the mesh has
/// already.
class LoopTriangulation {
 public:
  LoopTriangulation(const PolygonMesh& mesh, const std::vector<std::uint32_t>& loop,
                    const std::set<std::pair<std::uint32_t, std::uint32_t>>& edges)
      : mesh_(mesh), loop_(loop), size_(loop.size()), area_(size_ * size_, 0.0), apex_(size_ * size_, 0) {
    for (std::size_t length = 2; length < size_; ++length)
      for (std::size_t first = 0; first + length < size_; ++first) solve(first, first + length, edges);
  }

  bool found() const { return std::isfinite(area_[size_ - 1]); }

  /// Adds the triangles between the corners first and last of the loop.
  void add_to(std::vector<Triangle>& triangles, std::size_t first, std::size_t last) const {
    if (last - first < 2) return;
    const std::size_t apex = apex_[first * size_ + last];
    triangles.push_back({loop_[first], loop_[apex], loop_[last]});
    add_to(triangles, first, apex);
    add_to(triangles, apex, last);
  }

 private:
  void solve(std::size_t first, std::size_t last,
             const std::set<std::pair<std::uint32_t, std::uint32_t>>& edges) {
    double& best = area_[first * size_ + last];
    best = std::numeric_limits<double>::infinity();
    const bool whole = first == 0 && last + 1 == size_;  // its base is an edge of the loop itself
    if (!whole && edges.contains(std::minmax(loop_[first], loop_[last]))) return;
    for (std::size_t apex = first + 1; apex < last; ++apex) {
      const double area =
          area_[first * size_ + apex] + area_[apex * size_ + last] + area_of(first, apex, last);
      if (area >= best) continue;
      best = area;
      apex_[first * size_ + last] = apex;
    }
  }
  double area_of(std::size_t a, std::size_t b, std::size_t c) const {
    const Eigen::Vector3d at = mesh_.world(loop_[a]);
    return (mesh_.world(loop_[b]) - at).cross(mesh_.world(loop_[c]) - at).norm() / 2.0;
  }

  const PolygonMesh& mesh_;
  const std::vector<std::uint32_t>& loop_;
  std::size_t size_;
  std::vector<double> area_;  ///< smallest area between two corners of the loop, infinite if there is no path
  std::vector<std::size_t> apex_;
};

void fill(PolygonMesh& mesh, const std::vector<std::uint32_t>& loop) {
  // The tables grow with the square of a loop's length and the time with its cube.
  if (loop.size() > 1000) throw Error("holes cannot be closed: one of them has more than 1000 edges");
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;  // among the loop's points
  const std::set<std::uint32_t> corners(loop.begin(), loop.end());
  for (const Triangle& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i)
      if (corners.contains(triangle[i]) && corners.contains(triangle[(i + 1) % 3]))
        edges.insert(std::minmax(triangle[i], triangle[(i + 1) % 3]));
  const LoopTriangulation triangulation(mesh, loop, edges);
  if (!triangulation.found()) throw Error("holes cannot be closed: one of them has no triangulation");
  triangulation.add_to(mesh.triangles, 0, loop.size() - 1);
}

}  // namespace

PolygonMesh close_holes(const PolygonMesh& mesh) {
  PolygonMesh closed = compacted(mesh);
  std::map<std::uint32_t, std::uint32_t> next = boundary_edges(closed);
  while (!next.empty()) {
    std::vector<std::uint32_t> loop;
    // Each point of the boundary has one edge out and one in, so the walk comes back to where it began.
    for (auto at = next.begin(); at != next.end(); at = next.find(loop.back())) {
      loop.push_back(at->second);
      next.erase(at);
    }
    fill(closed, loop);
  }
  return closed;
}

}  // namespace hermesh
