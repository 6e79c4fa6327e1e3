#include "algorithms/remesh/height_field.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <tuple>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/number_text.h"
#include "algorithms/core/parallel.h"
#include "algorithms/search/triangle_tree.h"

namespace hermesh {
namespace {

/// Replaces each corner by the lowest number of the points with the same coordinates.
void join_points(std::vector<Triangle>& triangles, const std::vector<Eigen::Vector3f>& points) {
  std::vector<std::uint32_t> order(points.size()), first(points.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t p) { return std::tuple(points[p].x(), points[p].y(), points[p].z()); };
  std::ranges::sort(order, [&](auto a, auto b) { return std::tuple(key(a), a) < std::tuple(key(b), b); });
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && key(order[i - 1]) == key(order[i]) ? first[order[i - 1]] : order[i];
  for (Triangle& triangle : triangles)
    for (std::uint32_t& corner : triangle) corner = first[corner];
  std::erase_if(triangles, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; });
}

/// Returns twice the signed area of three points seen from above. Exact in its sign for points in single
/// precision of similar size: their differences and products have at most 53 digits.
double area_from_above(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// @throws Error if the middle of a triangle lies over or below another triangle
void check_one_layer(const PolygonMesh& field, const std::vector<Triangle>& triangles, RunContext& context) {
  std::vector<Eigen::Vector3f> flat = field.points;
  for (Eigen::Vector3f& point : flat) point.z() = 0.0f;
  const TriangleTree tree(flat, triangles, 1.0);
  std::vector<std::uint8_t> is_covered(triangles.size());
  parallel_blocks(triangles.size(), context, [&](std::size_t i) {
    const auto corner = [&](std::uint32_t t, int c) {
      return Eigen::Vector3d(flat[triangles[t][std::size_t(c)]].cast<double>());
    };
    const auto own = static_cast<std::uint32_t>(i);
    const Eigen::Vector3d at = (corner(own, 0) + corner(own, 1) + corner(own, 2)) / 3.0;
    tree.for_each_near(at, at, [&](std::uint32_t t) {
      if (t == own) return;
      bool is_within = true;
      for (int c = 0; c < 3; ++c)
        is_within = is_within && area_from_above(corner(t, c), corner(t, (c + 1) % 3), at) > 0.0;
      if (is_within) is_covered[i] = 1;
    });
  });
  const auto covered = std::ranges::find(is_covered, 1);
  if (covered == is_covered.end()) return;
  const Triangle& t = triangles[std::size_t(covered - is_covered.begin())];
  throw Error("the polygons are not a height field: there are several layers at " +
              text(Eigen::Vector3d((field.world(t[0]) + field.world(t[1]) + field.world(t[2])) / 3.0)) +
              "; use --shell for sheets that are no height field");
}

}  // namespace

PolygonMesh fill_below(const PolygonMesh& field, double base, RunContext& context) {
  PolygonMesh solid;
  solid.origin = field.origin;
  solid.points = field.points;
  solid.triangles = triangulated(field);
  join_points(solid.triangles, solid.points);
  const auto ground = static_cast<float>(base - field.origin.z());
  for (Triangle& triangle : solid.triangles) {
    const auto at = [&](int c) {
      return Eigen::Vector3d(solid.points[triangle[std::size_t(c)]].cast<double>());
    };
    const double area = area_from_above(at(0), at(1), at(2));
    const Eigen::Vector3d middle = (at(0) + at(1) + at(2)) / 3.0 + field.origin;
    if (area == 0.0)
      throw Error("the polygons are not a height field: one at " + text(middle) +
                  " is vertical; use --shell for sheets that are no height field");
    if (area < 0.0) std::swap(triangle[1], triangle[2]);
    for (const std::uint32_t corner : triangle)
      if (!(solid.points[corner].z() > ground))
        throw Error("the height field is not above the base at " + text(base) + ": a vertex is at " +
                    text(field.world(corner)) + "; choose a lower base");
  }
  check_one_layer(field, solid.triangles, context);
  const auto top = static_cast<std::uint32_t>(solid.points.size());
  const std::size_t count = solid.triangles.size();
  // Edges of the boundary are those that no polygon on the other side has in the opposite direction.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const Triangle& t : solid.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      if (++edges[{t[c], t[(c + 1) % 3]}] > 1)
        throw Error("the polygons are not a height field: an edge at " + text(field.world(t[c])) +
                    " has more than two polygons");
  for (std::uint32_t p = 0; p < top; ++p)
    solid.points.emplace_back(solid.points[p].x(), solid.points[p].y(), ground);
  for (std::size_t i = 0; i < count; ++i) {
    const Triangle t = solid.triangles[i];
    solid.triangles.push_back({t[0] + top, t[2] + top, t[1] + top});
  }
  for (const auto& [edge, number] : edges) {
    const auto [a, b] = edge;
    if (edges.contains({b, a})) continue;
    solid.triangles.push_back({b, a, a + top});
    solid.triangles.push_back({b, a + top, b + top});
  }
  return solid;
}

}  // namespace hermesh
