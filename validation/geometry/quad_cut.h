// Along which diagonal a judge cuts a quad.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh::validation {

/// A quad (a,b,c,d) means abc and acd (polygon_mesh.h), and who makes a quad that is not plane says by it
/// which of two surfaces it is. But a plane one has one surface only, which in a concave quad is cut along
/// the diagonal inside it, wherever the file starts.
enum class QuadRule {
  /// For the mesh that is judged: a–c, unless it is plane, a half by a–c faces against the quad as a whole or has no
  /// area, and no half by b–d does.
  as_given,
  /// For a reference from elsewhere, whose order means nothing. The same without asking whether it is plane, and then the
  /// diagonal across which the quad bends less; if they bend alike, the shorter one; and if they are equally long, the
  /// one with the lowest point number. This is how hermesh reads such a file when it makes a volume of it.
  better,
};

/// Whether the triangles are abd and bcd, and not abc and acd.
bool cut_along_other(const std::vector<Eigen::Vector3d>& points, const Quad& quad, QuadRule rule);

/// The quad from that of its corners at which the fan starts that cuts it right.
inline Quad cut_from_first(const std::vector<Eigen::Vector3d>& points, const Quad& q, QuadRule rule) {
  return cut_along_other(points, q, rule) ? Quad{q[1], q[2], q[3], q[0]} : q;
}

}  // namespace hermesh::validation
