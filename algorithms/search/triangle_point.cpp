#include "algorithms/search/triangle_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

namespace hermesh {
namespace {

/// Returns the point of side i–j that is nearest to p; its first end if the side has no length.
TrianglePoint on_segment(const Eigen::Vector3d& p, const std::array<Eigen::Vector3d, 3>& corners, int i,
                         int j) {
  const Eigen::Vector3d along = corners[j] - corners[i];
  const double length = along.squaredNorm();
  const double t = length > 0.0 ? std::clamp((p - corners[i]).dot(along) / length, 0.0, 1.0) : 0.0;
  TrianglePoint point{corners[i] + t * along, Eigen::Vector3d::Zero()};
  point.weights[i] = 1.0 - t;
  point.weights[j] = t;
  return point;
}

}  // namespace

TrianglePoint closest_point(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                            const Eigen::Vector3d& c) {
  const std::array<Eigen::Vector3d, 3> corners = {a, b, c};
  // The best of the three sides, then the foot of the perpendicular, if it lies within: for a degenerate
  // triangle only the sides are correct.
  TrianglePoint best = on_segment(p, corners, 0, 1);
  const auto offer = [&](const TrianglePoint& other) {
    if ((other.position - p).squaredNorm() < (best.position - p).squaredNorm()) best = other;
  };
  offer(on_segment(p, corners, 1, 2));
  offer(on_segment(p, corners, 2, 0));
  const Eigen::Vector3d normal = (b - a).cross(c - a);
  Eigen::Vector3d weights;
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d &u = corners[(i + 1) % 3], &v = corners[(i + 2) % 3];
    // The fraction of the area opposite corner i; projecting p first would change nothing.
    weights[i] = (v - u).cross(p - u).dot(normal);
  }
  // On a sliver the weights may be rounded; the point is still one of the triangle, and compared by its
  // distance.
  if (const double sum = weights.sum(); weights.minCoeff() >= 0.0 && sum > 0.0) {
    weights /= sum;
    offer({weights[0] * a + weights[1] * b + weights[2] * c, weights});
  }
  return best;
}

}  // namespace hermesh
