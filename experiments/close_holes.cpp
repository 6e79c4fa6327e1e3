#include <algorithm>

#include "algorithms/core/error.h"
#include "experiments/recipe_shapes.h"

namespace hermesh {

using recipes::add_point;
using recipes::next_index;

namespace {

/// Without the points that no polygon uses.
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
    Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
    for (const std::uint32_t corner : loop) centroid += closed.points[corner].cast<double>();
    const std::uint32_t centre = next_index(closed);
    add_point(closed, centroid / double(loop.size()));
    for (std::size_t i = 0; i < loop.size(); ++i)
      closed.triangles.push_back({centre, loop[i], loop[(i + 1) % loop.size()]});
  }
  return closed;
}

}  // namespace hermesh
