#include "validation/geometry/exact_predicates.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/intersections.h>

#include <Eigen/Geometry>

namespace hermesh::validation {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 to_cgal(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

Kernel::Triangle_3 to_cgal(const Corners& t) { return {to_cgal(t[0]), to_cgal(t[1]), to_cgal(t[2])}; }

}  // namespace

int exact::orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d) {
  return CGAL::orientation(to_cgal(a), to_cgal(b), to_cgal(c), to_cgal(d));
}

bool collinear(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  // One component of the cross product that is certainly not zero settles it. Each has two differences, two
  // products and one subtraction; 1e-14 is far above the rounding that those five operations can add up to.
  const Eigen::Vector3d u = b - a, v = c - a;
  const Eigen::Vector3d cross = u.cross(v);
  const double scale = u.cwiseAbs().maxCoeff() * v.cwiseAbs().maxCoeff();
  if (scale > 1e-250 && scale < 1e300 && cross.cwiseAbs().maxCoeff() > 1e-14 * scale) return false;
  return CGAL::collinear(to_cgal(a), to_cgal(b), to_cgal(c));
}

bool same_side(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& r,
               const Eigen::Vector3d& s) {
  return CGAL::coplanar_orientation(to_cgal(p), to_cgal(q), to_cgal(r), to_cgal(s)) == CGAL::POSITIVE;
}

bool segment_meets_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Corners& t) {
  const int side_p = orientation(t[0], t[1], t[2], p), side_q = orientation(t[0], t[1], t[2], q);
  if (side_p * side_q > 0) return false;
  if (side_p * side_q < 0) {
    const int ab = orientation(p, q, t[0], t[1]), bc = orientation(p, q, t[1], t[2]),
              ca = orientation(p, q, t[2], t[0]);
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
  }
  return CGAL::do_intersect(Kernel::Segment_3(to_cgal(p), to_cgal(q)), to_cgal(t));
}

bool triangles_meet(const Corners& s, const Corners& t) { return CGAL::do_intersect(to_cgal(s), to_cgal(t)); }

}  // namespace hermesh::validation
