#include "algorithms/remesh/wall_width.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "algorithms/search/triangle_point.h"

namespace hermesh {
namespace {

/// Cosine of the angle between neighbours' normals below which they are two sides of a fin.
constexpr double kFolded = -0.5;
/// Widths beyond this many errors are not looked for.
constexpr double kWidest = 4.0;
/// Polygons around a place that are asked at most, and how near these are, in errors.
constexpr std::size_t kMostAround = 64;
constexpr double kAround = 0.8;

/// The width of the wall or of the gap at a place of a polygon: how far the next polygon is along the normal
/// or against it, whichever is less. Infinity where there is none within four errors.
double width_at(const TriangleTree& tree, std::uint32_t triangle, const Eigen::Vector3d& from, double error,
                double least) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  const std::array<Eigen::Vector3d, 3> corner = {tree.corner(triangle, 0), tree.corner(triangle, 1),
                                                 tree.corner(triangle, 2)};
  const Eigen::Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
  const double most = kWidest * error;
  double nearest = most;
  const Eigen::Vector3d reach = most * normal.cwiseAbs();
  tree.for_each_near(from - reach, from + reach, [&](std::uint32_t other) {
    const Eigen::Vector3d a = tree.corner(other, 0), b = tree.corner(other, 1), c = tree.corner(other, 2);
    // Neighbours are no opposite wall, but for the other side of a fin, which is folded over along an edge.
    const bool folded = (b - a).cross(c - a).normalized().dot(normal) < kFolded;
    for (const Eigen::Vector3d& p : corner)
      if ((p == a || p == b || p == c) && !folded) return;
    // The line along the normal in barycentric coordinates of the triangle (Möller & Trumbore 1997).
    const Eigen::Vector3d across = normal.cross(c - a);
    const double slope = (b - a).dot(across);
    if (std::abs(slope) < 1e-12 * (b - a).norm() * (c - a).norm()) return;
    const double u = (from - a).dot(across) / slope;
    const Eigen::Vector3d turned = (from - a).cross(b - a);
    const double v = normal.dot(turned) / slope, way = std::abs((c - a).dot(turned) / slope);
    if (u < 0 || v < 0 || u + v > 1 || way < least) return;
    nearest = std::min(nearest, way);
  });
  return nearest < most ? nearest : kNone;
}

}  // namespace

double width_to_show(const TriangleTree& tree, std::uint32_t triangle, const Eigen::Vector3d& place,
                     double error, double least) {
  const double reach = kAround * error;
  std::vector<std::pair<std::uint32_t, Eigen::Vector3d>> around;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(reach);
  tree.for_each_near(place - half, place + half, [&](std::uint32_t t) {
    const Eigen::Vector3d a = tree.corner(t, 0), b = tree.corner(t, 1), c = tree.corner(t, 2),
                          inner = (a + b + c) / 3.0;
    // The place of the triangle that is most within, as far as that is near.
    const Eigen::Vector3d nearest = closest_point(place, a, b, c).position;
    const double left = reach - (nearest - place).norm(), way = (inner - nearest).norm();
    if (left >= 0.0) around.emplace_back(t, nearest + (way > left ? left / way : 1.0) * (inner - nearest));
  });
  double largest = width_at(tree, triangle, place, error, least);
  for (std::size_t i = 0; i < around.size() && std::isfinite(largest); i += 1 + around.size() / kMostAround)
    largest = std::max(largest, width_at(tree, around[i].first, around[i].second, error, least));
  return largest;
}

}  // namespace hermesh
