#include "algorithms/remesh/topology.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "algorithms/core/disjoint_sets.h"

namespace hermesh {

std::vector<std::uint32_t> first_at_position(std::span<const Eigen::Vector3f> points) {
  std::vector<std::uint32_t> order(points.size()), first(points.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) { return std::array{points[i].x(), points[i].y(), points[i].z()}; };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return key(a) != key(b) ? key(a) < key(b) : a < b; });
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && key(order[i]) == key(order[i - 1]) ? first[order[i - 1]] : order[i];
  return first;
}

Topology topology_of(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles) {
  const std::vector<std::uint32_t> number = first_at_position(points);
  DisjointSets sets(points.size());
  std::vector<bool> used(points.size());
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::int64_t faces = 0;
  for (const Triangle& t : triangles) {
    const Triangle c = {number[t[0]], number[t[1]], number[t[2]]};
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    ++faces;
    for (std::size_t i = 0; i < 3; ++i) {
      used[c[i]] = true;
      sets.join(c[0], c[i]);
      edges.push_back({std::min(c[i], c[(i + 1) % 3]), std::max(c[i], c[(i + 1) % 3])});
    }
  }
  Topology result;
  std::int64_t vertices = 0;
  for (std::uint32_t i = 0; i < used.size(); ++i) {
    vertices += used[i];
    result.components += used[i] && sets.find(i) == i;
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    const bool is_pair = i + 1 < edges.size() && edges[i] == edges[i + 1];
    if (!is_pair || (i > 0 && edges[i] == edges[i - 1])) return result;
  }
  // Euler's formula: vertices - edges + faces = 2 (components - genus), with half an edge per entry.
  result.genus = std::int64_t(result.components) - (vertices - std::int64_t(edges.size() / 2) + faces) / 2;
  return result;
}

}  // namespace hermesh
