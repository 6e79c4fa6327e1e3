// The diagonals along which validation cuts quads.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh::validation {

/// How a quad is cut into triangles. A quad (a,b,c,d) means abc and acd (polygon_mesh.h), so the order of the
/// corners of a quad that is not plane decides between two surfaces. A plane quad has only one surface, and
/// if concave it must be cut along the diagonal inside it, regardless of its first corner.
enum class QuadRule {
  /// For the validated mesh: a quad is cut along a–c, unless it is plane, a half by a–c faces against the
  /// quad as
  /// a whole or has no area, and no half by b–d does so.
  as_given,
  /// For a reference from elsewhere, whose order of corners is arbitrary. If the halves by only one diagonal
  /// all
  /// face with the quad and have an area, that diagonal is taken, even if the quad is not plane; else the one
  /// across which the quad bends less; if both bend equally, the shorter one; and if they are equally long,
  /// the
  /// one with the lowest point number. hermesh uses this rule when it voxelizes such a file.
  better,
};

/// Returns true if the rule cuts a quad (a,b,c,d) into abd and bcd instead of abc and acd.
bool cut_along_other(const std::vector<Eigen::Vector3d>& points, const Quad& quad, QuadRule rule);

/// Returns the quad with its corners rotated so that the rule cuts (a,b,c,d) into abc and acd.
inline Quad cut_from_first(const std::vector<Eigen::Vector3d>& points, const Quad& q, QuadRule rule) {
  return cut_along_other(points, q, rule) ? Quad{q[1], q[2], q[3], q[0]} : q;
}

}  // namespace hermesh::validation
