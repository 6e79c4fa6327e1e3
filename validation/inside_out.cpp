#include "validation/inside_out.h"

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "algorithms/core/disjoint_sets.h"
#include "validation/geometry/places.h"
#include "validation/solid.h"

namespace hermesh::validation {
namespace {

/// Returns whether the other components wind around a component, so that it is a cavity if it faces inwards.
/// Rays start at its vertices, one after another, until one of them meets no edge.
bool is_enclosed(const TriangleSoup& soup, const TriangleTree& tree,
                 const std::vector<std::uint32_t>& component, const std::vector<std::uint32_t>& triangles) {
  const std::uint32_t own = component[soup.triangles[triangles[0]][0]];
  const std::vector<Eigen::Vector3d> directions = ray_directions(2.0 * tree.bounds().diagonal());
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Eigen::Vector3d from = soup.corners(triangles[i % triangles.size()])[0], to = from + directions[i];
    int sum = 0;
    bool sure = true;
    tree.for_each_on_segment(from, to, [&](std::uint32_t slot) {
      if (component[soup.triangles[tree.triangle(slot)][0]] == own) return true;
      const std::optional<int> crossing = crossing_of(tree.corners(slot), from, to);
      sure = crossing.has_value();
      sum += crossing.value_or(0);
      return sure;
    });
    if (sure) return sum > 0;
  }
  return false;
}

}  // namespace

void count_inside_out(const TriangleSoup& soup, const TriangleTree& tree, MeshReport& report,
                      const RunContext& context) {
  if (!report.closed() || !report.oriented()) return;
  DisjointSets sets(soup.points.size());
  for (const Triangle& t : soup.triangles) sets.join(t[0], t[1]), sets.join(t[0], t[2]);
  std::vector<std::uint32_t> component(soup.points.size());
  for (std::uint32_t p = 0; p < component.size(); ++p) component[p] = sets.find(p);
  // A component goes by its lowest point, from which its volume is measured.
  std::vector<double> volume(soup.points.size());
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    const std::uint32_t of = component[soup.triangles[t][0]];
    const Corners c = soup.corners(t);
    const Eigen::Vector3d& apex = soup.points[of];
    volume[of] += (c[0] - apex).dot((c[1] - apex).cross(c[2] - apex));
  }
  std::map<std::uint32_t, std::vector<std::uint32_t>> triangles;  // of those with negative volume
  for (std::uint32_t t = 0; t < soup.triangles.size(); ++t)
    if (const std::uint32_t of = component[soup.triangles[t][0]]; volume[of] < 0.0)
      triangles[of].push_back(t);
  report.inside_out_components = 0;
  for (const auto& [of, of_one] : triangles) {
    context.check();
    if (is_enclosed(soup, tree, component, of_one)) continue;
    ++*report.inside_out_components;
    const Corners c = soup.corners(of_one[0]);
    add_place(report.inside_out_places, (c[0] + c[1] + c[2]) / 3.0, soup.polygon(of_one[0]));
  }
}

}  // namespace hermesh::validation
