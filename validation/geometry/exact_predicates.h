// Exact predicates on points in double precision: a floating-point filter decides the clear cases, CGAL's
// exact kernel the others, behind this light header.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "validation/geometry/triangle_soup.h"

namespace hermesh::validation {

namespace exact {
/// Returns orientation() below by CGAL's exact kernel, which is slower.
int orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Eigen::Vector3d& d);
}  // namespace exact

/// Returns the exact orientation of four points: 1 if abc turns counter-clockwise seen from d, −1 if
/// clockwise, 0 if the four points lie in one plane. The bound of the filter is Shewchuk's (Adaptive
/// Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates, 1997); it does not cover
/// underflow, hence the floor under the permanent.
inline int orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d) {
  const Eigen::Vector3d u = b - a, v = c - a, w = d - a;
  const double xy = u.x() * v.y(), yx = u.y() * v.x();
  const double yz = u.y() * v.z(), zy = u.z() * v.y();
  const double zx = u.z() * v.x(), xz = u.x() * v.z();
  const double determinant = (xy - yx) * w.z() + (yz - zy) * w.x() + (zx - xz) * w.y();
  const double permanent = (std::abs(xy) + std::abs(yx)) * std::abs(w.z()) +
                           (std::abs(yz) + std::abs(zy)) * std::abs(w.x()) +
                           (std::abs(zx) + std::abs(xz)) * std::abs(w.y());
  constexpr double kBound = (7.0 + 56.0 * 0x1p-53) * 0x1p-53;
  constexpr double kFloor = 1e-250;
  if (permanent > kFloor && permanent < 1e300 && std::abs(determinant) > kBound * permanent)
    return determinant > 0.0 ? 1 : -1;
  return exact::orientation(a, b, c, d);
}

/// Returns true if the triangle has exactly zero area.
bool collinear(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c);
inline bool collinear(const Corners& t) { return collinear(t[0], t[1], t[2]); }

/// Returns true if r and s are on one side of the line pq, for four points in one plane, p ≠ q and neither r
/// nor s on the line.
bool same_side(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r,
               const Eigen::Vector3d& s);

/// Returns true if the closed segment, of more than one point, and the closed triangle, of more than zero
/// area, meet.
bool segment_meets_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Corners& t);

/// Returns true if two closed triangles, each of nonzero area, intersect.
bool triangles_meet(const Corners& s, const Corners& t);

}  // namespace hermesh::validation
