#include "algorithms/remesh/voxel_size.h"

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
/// Largest width that is searched, in errors.
constexpr double kWidest = 4.0;
/// Largest number of polygons around a position that are tested, and their largest distance, in errors.
constexpr std::size_t kMostAround = 64;
constexpr double kWithin = 0.8;
/// Largest number of positions whose thickness is measured.
constexpr std::size_t kMostMeasured = 500;
/// Thickness of a wall that a mesh can show, in voxels, and the voxel that is tried for a thickness.
constexpr double kThinVoxels = 2.0, kVoxelOfThickness = 0.9;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Returns the width of the wall or gap at a position of a polygon: the distance of the next polygon along
/// the normal or against it, the smaller one. Infinity if there is none within four errors.
double width_at(const TriangleTree& tree, std::uint32_t triangle, const Eigen::Vector3d& from, double error,
                double least) {
  const std::array<Eigen::Vector3d, 3> corner = {tree.corner(triangle, 0), tree.corner(triangle, 1),
                                                 tree.corner(triangle, 2)};
  const Eigen::Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
  const double most = kWidest * error;
  double nearest = most;
  const Eigen::Vector3d reach = most * normal.cwiseAbs();
  tree.for_each_near(from - reach, from + reach, [&](std::uint32_t other) {
    const Eigen::Vector3d a = tree.corner(other, 0), b = tree.corner(other, 1), c = tree.corner(other, 2);
    // Neighbours are not an opposite wall, except the other side of a fin, folded over along an edge.
    const bool folded = (b - a).cross(c - a).normalized().dot(normal) < kFolded;
    for (const Eigen::Vector3d& p : corner)
      if ((p == a || p == b || p == c) && !folded) return;
    // The line along the normal in barycentric coordinates of the triangle (Möller & Trumbore 1997).
    const Eigen::Vector3d across = normal.cross(c - a);
    const double slope = (b - a).dot(across);
    if (std::abs(slope) < 1e-12 * (b - a).norm() * (c - a).norm()) return;
    const double u = (from - a).dot(across) / slope;
    const Eigen::Vector3d turned = (from - a).cross(b - a);
    const double v = normal.dot(turned) / slope, width = std::abs((c - a).dot(turned) / slope);
    if (u < 0 || v < 0 || u + v > 1 || width < least) return;
    nearest = std::min(nearest, width);
  });
  return nearest < most ? nearest : kInfinite;
}

/// Returns the width of the wall or gap that voxels have to show so that a mesh can come within an error of a
/// position on a triangle of the surface: the largest of those around it that are nearly as near. Thinner
/// parts, such as the edge of a wedge and a shallow fin, need not be shown. Infinity if something around the
/// position is thicker than four errors.
double width_to_show(const TriangleTree& tree, std::uint32_t triangle, const Eigen::Vector3d& place,
                     double error, double least) {
  const double reach = kWithin * error;
  std::vector<std::pair<std::uint32_t, Eigen::Vector3d>> around;
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(reach);
  tree.for_each_near(place - half, place + half, [&](std::uint32_t t) {
    const Eigen::Vector3d a = tree.corner(t, 0), b = tree.corner(t, 1), c = tree.corner(t, 2),
                          inner = (a + b + c) / 3.0;
    // The innermost position of the triangle that is near.
    const Eigen::Vector3d nearest = closest_point(place, a, b, c).position;
    const double left = reach - (nearest - place).norm(), inwards = (inner - nearest).norm();
    if (left >= 0.0)
      around.emplace_back(t, nearest + (inwards > left ? left / inwards : 1.0) * (inner - nearest));
  });
  double largest = width_at(tree, triangle, place, error, least);
  for (std::size_t i = 0; i < around.size() && std::isfinite(largest); i += 1 + around.size() / kMostAround)
    largest = std::max(largest, width_at(tree, around[i].first, around[i].second, error, least));
  return largest;
}

}  // namespace

NextVoxel next_voxel(double size, double smallest, double factor, const SurfaceDistance& surface,
                     std::span<const Far> far, double error, double least) {
  // Most far positions are next to others, so an even sample is representative. A twentieth of it may be
  // thinner: a wedge is arbitrarily thin at its edge, and only there.
  std::vector<std::pair<double, std::size_t>> thick;
  for (std::size_t i = 0; i < far.size(); i += 1 + far.size() / kMostMeasured) {
    if (!far[i].of_surface || far[i].distance <= error) continue;
    const double width = width_to_show(surface.tree(), far[i].triangle, far[i].place, error, least);
    if (std::isfinite(width)) thick.emplace_back(width, i);
  }
  std::sort(thick.begin(), thick.end());
  const bool is_thin = !thick.empty();
  const double thinnest = is_thin ? thick[thick.size() / 20].first : kInfinite;
  // Voxels as thick as the thinnest wall show it wherever samples fall into it, or nearly.
  if (is_thin) factor = std::clamp(kVoxelOfThickness * thinnest / size, 0.2, 0.7);
  if (!(is_thin && kThinVoxels * thinnest < smallest) && size > 1.1 * smallest)
    return {std::max(smallest, factor * size), true};
  // A thicker part is shown, and is not the reason why the bound is not reached.
  if (is_thin && kVoxelOfThickness * thinnest < smallest)
    return {smallest, false, thinnest, {far[thick[thick.size() / 20].second]}};
  return {smallest, false, 0.0, {far.begin(), far.end()}};
}

}  // namespace hermesh
