#include "algorithms/extraction/contact/triangle_contact.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Threshold of certainty for a value divided by the lengths that it is the product of: the rounding error is
/// about 1e-13 for coordinates of thousands of voxels.
constexpr double kCertain = 1e-10;

struct Range {
  double low, high;
};
Range along(const Vector3d& axis, const Corners& t) {
  const double p = axis.dot(t[0]), q = axis.dot(t[1]), r = axis.dot(t[2]);
  return {std::min({p, q, r}), std::max({p, q, r})};
}

bool disjoint_apart(const Corners& a, const Corners& b) {
  // Relative to a corner of one, so that rounding is relative to the triangles' own size.
  const Vector3d o = a[0];
  const Corners s = {Vector3d::Zero(), a[1] - o, a[2] - o}, t = {b[0] - o, b[1] - o, b[2] - o};
  double size = 0;
  for (const Vector3d& p : t) size = std::max(size, p.cwiseAbs().maxCoeff());
  for (const Vector3d& p : s) size = std::max(size, p.cwiseAbs().maxCoeff());
  const auto separates = [&](const Vector3d& axis) {
    const Range of_s = along(axis, s), of_t = along(axis, t);
    const double gap = std::max(of_t.low - of_s.high, of_s.low - of_t.high);
    return gap > kCertain * size * axis.cwiseAbs().maxCoeff();
  };
  const std::array<Vector3d, 3> es = {s[1] - s[0], s[2] - s[1], s[0] - s[2]};
  const std::array<Vector3d, 3> et = {t[1] - t[0], t[2] - t[1], t[0] - t[2]};
  const Vector3d ns = es[0].cross(es[1]), nt = et[0].cross(et[1]);
  // The candidate axes for two triangles: both normals, and the cross products of a side of each. Any axis
  // along which the ranges are disjoint is a proof, so an axis that consists mostly of rounding errors is
  // harmless.
  if (separates(ns) || separates(nt)) return true;
  for (const Vector3d& e : es)
    for (const Vector3d& f : et)
      if (separates(e.cross(f))) return true;
  // If the triangles are nearly in one plane, the products above vanish; then the sides of either decide,
  // within its plane.
  for (int i = 0; i < 3; ++i)
    if (separates(ns.cross(es[i])) || separates(nt.cross(et[i]))) return true;
  return false;
}

/// Returns true if two wedges at the origin, that of a[0] and a[1] and that of b[0] and b[1], intersect only
/// in the origin.
bool wedges_apart(const std::array<Vector3d, 2>& a, const std::array<Vector3d, 2>& b) {
  const double size = std::max({a[0].cwiseAbs().maxCoeff(), a[1].cwiseAbs().maxCoeff(),
                                b[0].cwiseAbs().maxCoeff(), b[1].cwiseAbs().maxCoeff()});
  const auto sign = [&](const Vector3d& axis, const Vector3d& p) {
    const double value = axis.dot(p), noise = kCertain * size * axis.cwiseAbs().maxCoeff();
    return value > noise ? 1 : value < -noise ? -1 : 0;
  };
  const Vector3d na = a[0].cross(a[1]), nb = b[0].cross(b[1]);
  // A plane that contains one wedge intersects the other only in the corner.
  if (sign(na, b[0]) * sign(na, b[1]) > 0 || sign(nb, a[0]) * sign(nb, a[1]) > 0) return true;
  // A plane through one side of each, with the other sides on opposite sides of it: it contains two different
  // rays.
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) {
      const Vector3d axis = a[i].cross(b[j]);
      // For parallel rays the axis is only rounding error, and so is every sign.
      if (axis.cwiseAbs().maxCoeff() <= kCertain * a[i].cwiseAbs().maxCoeff() * b[j].cwiseAbs().maxCoeff())
        continue;
      if (sign(axis, a[1 - i]) * sign(axis, b[1 - j]) < 0) return true;
    }
  // A plane through one side of a wedge, perpendicular to it, with all of the other wedge beyond; one ray of
  // the other may lie in the plane if it points the opposite way, e.g. if a straight line passes through the
  // corner.
  const auto beyond = [&](const std::array<Vector3d, 2>& w, const Vector3d& normal,
                          const std::array<Vector3d, 2>& v) {
    for (int i = 0; i < 2; ++i) {
      const Vector3d beside = normal.cross(w[i]), other = normal.cross(w[1 - i]);
      const int own = sign(beside, w[1 - i]), own_other = sign(other, w[i]);
      if (own == 0 || own_other == 0) continue;
      const int first = sign(beside, v[0]), second = sign(beside, v[1]);
      if (first == -own && second == -own) return true;
      for (int j = 0; j < 2; ++j)
        if ((j == 0 ? second : first) == -own && (j == 0 ? first : second) == 0 && w[i].dot(v[j]) < 0 &&
            sign(other, v[j]) == -own_other)
          return true;
    }
    return false;
  };
  return beyond(a, na, b) || beyond(b, nb, a);
}

/// Returns true if the half-planes that end in the line along `edge`, and contain a and b, intersect only in
/// that line, i.e. do not coincide.
bool half_planes_apart(const Vector3d& edge, const Vector3d& a, const Vector3d& b) {
  const double size =
      std::max({edge.cwiseAbs().maxCoeff(), a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff()});
  const Vector3d na = edge.cross(a), nb = edge.cross(b);
  const double noise = kCertain * size * na.cwiseAbs().maxCoeff();
  // At an angle they share only the line; in one plane they are disjoint if they lie on opposite sides of it.
  if (std::abs(na.dot(b)) > noise) return true;
  const double across = na.dot(nb);  // negative: on opposite sides of the line
  return across < -kCertain * na.cwiseAbs().maxCoeff() * nb.cwiseAbs().maxCoeff() - 1e-300;
}

}  // namespace

bool certainly_apart(const Corners& a, const Corners& b, int shared) {
  if (shared == 0) return disjoint_apart(a, b);
  const Vector3d& o = a[0];
  if (shared == 1) return wedges_apart({a[1] - o, a[2] - o}, {b[1] - o, b[2] - o});
  return half_planes_apart(a[1] - o, a[2] - o, b[2] - o);
}

bool certainly_apart(NamedTriangle a, NamedTriangle b) {
  std::size_t shared = 0;  // shared corners, moved to the front in the same order in both
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = shared; j < 3; ++j)
      if (a.names[i] == b.names[j]) {
        std::swap(a.names[i], a.names[shared]);
        std::swap(a.corners[i], a.corners[shared]);
        std::swap(b.names[j], b.names[shared]);
        std::swap(b.corners[j], b.corners[shared]);
        ++shared;
        break;
      }
  return shared < 3 && certainly_apart(a.corners, b.corners, static_cast<int>(shared));
}

}  // namespace hermesh
