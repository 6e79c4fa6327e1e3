#include "algorithms/core/polygon_mesh.h"

#include <algorithm>
#include <cmath>

namespace hermesh {

std::vector<Triangle> triangulated(const PolygonMesh& mesh) {
  std::vector<Triangle> triangles;
  triangles.reserve(mesh.triangle_count());
  triangles = mesh.triangles;
  for (const auto& [a, b, c, d] : mesh.quads) {
    triangles.push_back({a, b, c});
    triangles.push_back({a, c, d});
  }
  return triangles;
}

Bounds bounds(const PolygonMesh& mesh) {
  // Stray points would enlarge the box, and with it the voxels that tools choose by it.
  Bounds box;
  for (const Triangle& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) box.add(mesh.world(corner));
  for (const Quad& quad : mesh.quads)
    for (const std::uint32_t corner : quad) box.add(mesh.world(corner));
  return box;
}

namespace {

double power_of_two_not_below(double length) {
  // A power of two itself has the mantissa 1/2.
  int exponent = 0;
  const double mantissa = std::frexp(length, &exponent);  // in [1/2, 1)
  return std::ldexp(1.0, mantissa == 0.5 ? exponent - 1 : exponent);
}

double origin_on_axis(double lower, double upper, double longest_side) {
  // Distance of the box from 0 along the axis, 0 if it contains 0. Within four sides the coordinates are at
  // most five times the longest side, which costs single precision at most three bits.
  const double distance = std::max({lower, -upper, 0.0});
  if (distance <= 4.0 * longest_side) return 0.0;
  // The ends have the same sign, so their difference cannot overflow, as their sum could.
  const double centre = lower + (upper - lower) / 2.0;
  if (longest_side == 0.0) return centre;
  const double step = power_of_two_not_below(longest_side);
  // From 2^52 steps on, every double is already a multiple of the step.
  return std::abs(centre) < std::ldexp(step, 52) ? std::round(centre / step) * step : centre;
}

}  // namespace

Eigen::Vector3d choose_origin(const Bounds& box) {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  if (box.empty()) return origin;
  const double longest_side = box.size().maxCoeff();
  for (int axis = 0; axis < 3; ++axis)
    origin[axis] = origin_on_axis(box.lower[axis], box.upper[axis], longest_side);
  return origin;
}

}  // namespace hermesh
