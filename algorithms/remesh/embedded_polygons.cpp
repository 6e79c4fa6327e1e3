#include "algorithms/remesh/embedded_polygons.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/contact/triangle_grid.h"
#include "algorithms/remesh/topology.h"
#include "algorithms/remesh/two_sided_proof.h"

namespace hermesh {
namespace {

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

bool is_free_of_contacts(const FineMesh& mesh, const RunContext& context) {
  const std::size_t n = mesh.triangles().size();
  std::vector<Bounds> boxes(n);
  for (std::uint32_t t = 0; t < n; ++t)
    for (const Eigen::Vector3d& p : mesh.corners(t)) boxes[t].add(p);
  const TriangleGrid grid(boxes);
  std::atomic<bool> is_free = true;
  parallel_blocks(n, context, [&](std::size_t i) {
    if (!is_free.load(std::memory_order_relaxed)) return;
    const auto t = static_cast<std::uint32_t>(i);
    // Each pair once: from the triangle of the smaller level, at equal levels from the first.
    grid.visit(t, grid.level(t), [&](std::uint32_t u) {
      if (u == t || (grid.level(u) == grid.level(t) && u < t) || !boxes[t].overlaps(boxes[u])) return;
      if (!certainly_apart(mesh.triangles()[t], mesh.triangles()[u], mesh.points()))
        is_free.store(false, std::memory_order_relaxed);
    });
  });
  return is_free;
}

}  // namespace

std::vector<Eigen::Vector3d> scaled(std::span<const Eigen::Vector3f> points, double unit) {
  std::vector<Eigen::Vector3d> result(points.size());
  std::ranges::transform(points, result.begin(), [&](const Eigen::Vector3f& p) -> Eigen::Vector3d {
    return p.cast<double>() / unit;
  });
  return result;
}

std::optional<EmbeddedPolygons> embedded_polygons(const PolygonMesh& mesh, std::span<const std::int8_t> turns,
                                                  const RunContext& context) {
  EmbeddedPolygons result;
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
  if (!is_closed(fine) || !is_manifold(fine) || !is_free_of_contacts(fine, context)) return std::nullopt;
  return result;
}

std::vector<std::uint32_t> largest_of_components(const EmbeddedPolygons& mesh) {
  DisjointSets sets(mesh.points.size());
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t p : t) sets.join(t[0], p);
  std::vector<std::uint32_t> largest(mesh.points.size(), FineMesh::kNone);
  std::vector<double> most(mesh.points.size(), 0.0);
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const std::uint32_t set = sets.find(mesh.triangles[i][0]);
    if (const double here = area(mesh.points, mesh.triangles[i]); here > most[set])
      most[set] = here, largest[set] = i;
  }
  std::erase(largest, FineMesh::kNone);
  return largest;
}

}  // namespace hermesh
