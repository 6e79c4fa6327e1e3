#include "algorithms/remesh/manifold_polygons.h"

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

/// Returns a flag for each triangle: 1 if it may meet another one; nothing if more than `most` do.
std::vector<std::uint8_t> in_contact(const FineMesh& mesh, std::size_t most, const RunContext& context) {
  const std::size_t n = mesh.triangles().size();
  std::vector<Bounds> boxes(n);
  for (std::uint32_t t = 0; t < n; ++t)
    for (const Eigen::Vector3d& p : mesh.corners(t)) boxes[t].add(p);
  const TriangleGrid grid(boxes);
  std::vector<std::uint8_t> result(n);
  std::atomic<std::size_t> count = 0;
  const auto mark = [&](std::uint32_t t) { count += !std::atomic_ref(result[t]).exchange(1); };
  parallel_blocks(n, context, [&](std::size_t i) {
    if (count > most) return;
    const auto t = static_cast<std::uint32_t>(i);
    // Each pair once: from the triangle of the smaller level, at equal levels from the first.
    grid.visit(t, grid.level(t), [&](std::uint32_t u) {
      if (u == t || (grid.level(u) == grid.level(t) && u < t) || !boxes[t].overlaps(boxes[u])) return;
      if (certainly_apart(mesh.triangles()[t], mesh.triangles()[u], mesh.points())) return;
      mark(t);
      mark(u);
    });
  });
  if (count > most) result.clear();
  return result;
}

}  // namespace

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
  result.meets = in_contact(fine, result.triangles.size() / kFewMeet, context);
  if (result.meets.empty()) return std::nullopt;
  return result;
}

std::vector<std::uint32_t> largest_of_patches(const ManifoldPolygons& mesh) {
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
  std::erase(largest, FineMesh::kNone);
  return largest;
}

}  // namespace hermesh
