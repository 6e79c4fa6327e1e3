// Along which diagonal a judge cuts a quad.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh::validation {

/// How a quad is cut into triangles. A quad (a,b,c,d) means abc and acd (polygon_mesh.h), and who makes a
/// quad that is not plane says by this order which of two surfaces it is. But a plane quad has one surface
/// only, and if it is concave it must be cut along the diagonal inside it, whichever corner the file begins
/// with.
enum class QuadRule {
  /// The rule for the mesh that is judged: a quad is cut along a–c, unless it is plane, a half by a–c faces
  /// against the quad as a whole or has no area, and no half by b–d does so.
  as_given,
  /// The rule for a reference from elsewhere, whose order of corners means nothing. If the halves by one
  /// diagonal alone all face with the quad and have an area, that diagonal is taken, whether the quad is
  /// plane or not; else the one across which the quad bends less; if it bends alike across both, the shorter
  /// one; and if they are equally long, the one with the lowest point number. This is how hermesh reads such
  /// a file when it makes a volume of it.
  better,
};

/// Whether the rule cuts a quad (a,b,c,d) into abd and bcd, and not into abc and acd.
bool cut_along_other(const std::vector<Eigen::Vector3d>& points, const Quad& quad, QuadRule rule);

/// The quad with its corners in an order by which (a,b,c,d) means the triangles that the rule cuts it into.
inline Quad cut_from_first(const std::vector<Eigen::Vector3d>& points, const Quad& q, QuadRule rule) {
  return cut_along_other(points, q, rule) ? Quad{q[1], q[2], q[3], q[0]} : q;
}

}  // namespace hermesh::validation
