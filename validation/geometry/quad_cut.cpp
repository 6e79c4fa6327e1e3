#include "validation/geometry/quad_cut.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hermesh::validation {
namespace {

using Eigen::Vector3d;

/// The least difference of two cosines, or of a ratio of squared lengths from 1, above rounding errors.
constexpr double kAlike = 1e-9;
/// Largest distance of a plane quad from its plane in a file of single precision, as a share of its longest
/// side.
constexpr double kPlane = 1e-6;

bool is_plane(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = b - a, v = c - a, w = d - a;
  const double longest = std::sqrt(std::max({u.squaredNorm(), v.squaredNorm(), w.squaredNorm()}));
  return std::abs(u.dot(v.cross(w))) <= kPlane * longest * longest * longest;
}

/// One of the two cuts of a quad into two triangles.
struct Halves {
  Vector3d first, second;  ///< normals of the two triangles, of twice their areas
  double squared_length;   ///< squared length of the diagonal

  Halves(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d)
      : first((b - a).cross(c - a)), second((c - a).cross(d - a)), squared_length((c - a).squaredNorm()) {}

  /// Returns true if both halves face with the whole, which is the same for either diagonal. A half that is
  /// only a rounding error has no area.
  bool proper() const {
    const Vector3d whole = first + second;
    const double least = kAlike * whole.squaredNorm();
    return first.dot(whole) > least && second.dot(whole) > least;
  }
  double cosine() const {
    const double lengths = first.norm() * second.norm();
    return lengths > 0.0 ? first.dot(second) / lengths : -1.0;
  }
};

}  // namespace

bool cut_along_other(const std::vector<Vector3d>& points, const Quad& q, QuadRule rule) {
  const Vector3d &a = points[q[0]], &b = points[q[1]], &c = points[q[2]], &d = points[q[3]];
  if (rule == QuadRule::as_given && !is_plane(a, b, c, d)) return false;
  const Halves own(a, b, c, d), other(b, c, d, a);
  if (own.proper() != other.proper()) return other.proper();
  if (rule == QuadRule::as_given) return false;
  if (std::abs(own.cosine() - other.cosine()) > kAlike) return other.cosine() > own.cosine();
  const double longer = std::max(own.squared_length, other.squared_length);
  if (std::abs(own.squared_length - other.squared_length) > kAlike * longer)
    return other.squared_length < own.squared_length;
  return std::min(q[1], q[3]) < std::min(q[0], q[2]);
}

}  // namespace hermesh::validation
