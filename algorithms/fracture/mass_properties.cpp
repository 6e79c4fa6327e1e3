#include "algorithms/fracture/mass_properties.h"

#include <Eigen/Geometry>

namespace hermesh {

MassProperties mass_properties(const PolygonMesh& mesh) {
  using Eigen::Matrix3d;
  using Eigen::Vector3d;
  MassProperties result;
  const Bounds box = bounds(mesh);
  if (box.empty()) return result;
  // Tetrahedra have a corner amid the mesh: with a corner at the world's zero, far from the mesh, their large
  // volumes of either sign would cancel and leave few digits.
  const Vector3d anchor = 0.5 * (box.lower + box.upper);
  Vector3d first = Vector3d::Zero();   // ∫ x
  Matrix3d second = Matrix3d::Zero();  // ∫ x xᵀ
  for (const Triangle& t : triangulated(mesh)) {
    const Vector3d a = mesh.world(t[0]) - anchor, b = mesh.world(t[1]) - anchor,
                   c = mesh.world(t[2]) - anchor;
    // For the tetrahedron (0, a, b, c) of volume V, with s = a + b + c:
    // ∫ x = V/4 s, and ∫ x xᵀ = V/20 (s sᵀ + a aᵀ + b bᵀ + c cᵀ).
    const double volume = a.dot(b.cross(c)) / 6.0;
    const Vector3d sum = a + b + c;
    result.volume += volume;
    result.area += 0.5 * (b - a).cross(c - a).norm();
    first += volume / 4.0 * sum;
    second +=
        volume / 20.0 * (sum * sum.transpose() + a * a.transpose() + b * b.transpose() + c * c.transpose());
  }
  if (!(result.volume > 0)) {
    result.centre = anchor;
    return result;
  }
  const Vector3d mean = first / result.volume;
  result.centre = anchor + mean;
  // Parallel axes: second moments about the centre, then the inertia tr(M) I − M (density 1, world units⁵).
  const Matrix3d about_centre = second - result.volume * mean * mean.transpose();
  result.inertia = about_centre.trace() * Matrix3d::Identity() - about_centre;
  return result;
}

}  // namespace hermesh
