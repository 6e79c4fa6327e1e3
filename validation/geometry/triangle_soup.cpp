#include "validation/geometry/triangle_soup.h"

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <numeric>

#include "validation/geometry/exact_predicates.h"

namespace hermesh::validation {

std::vector<TriangleSide> sorted_sides(const std::vector<Triangle>& triangles) {
  std::vector<TriangleSide> sides;
  sides.reserve(3 * triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t)
    for (std::int8_t k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), t, k, std::int8_t(a < b ? 1 : -1)});
    }
  tbb::parallel_sort(sides.begin(), sides.end());
  return sides;
}

WeldedPoints weld(const std::vector<Eigen::Vector3d>& points) {
  std::vector<std::uint32_t> order(points.size());
  std::iota(order.begin(), order.end(), 0u);
  tbb::parallel_sort(order.begin(), order.end(), [&points](std::uint32_t a, std::uint32_t b) {
    const Eigen::Vector3d &p = points[a], &q = points[b];
    return p == q ? a < b : std::lexicographical_compare(p.data(), p.data() + 3, q.data(), q.data() + 3);
  });
  WeldedPoints result{{}, std::vector<std::uint32_t>(points.size())};
  for (std::uint32_t p : order) {
    if (result.points.empty() || result.points.back() != points[p]) result.points.push_back(points[p]);
    result.number[p] = std::uint32_t(result.points.size() - 1);
  }
  return result;
}

MeshFile welded_triangles(const TriangleSoup& soup) {
  auto [points, number] = weld(soup.points);
  MeshFile result;
  result.points = std::move(points);
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    if (collinear(soup.corners(t))) continue;
    const Triangle& c = soup.triangles[t];
    result.triangles.push_back({number[c[0]], number[c[1]], number[c[2]]});
  }
  return result;
}

}  // namespace hermesh::validation
