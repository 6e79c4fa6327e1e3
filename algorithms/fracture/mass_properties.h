// Mass properties of a piece: volume, area, centre of mass and inertia tensor.
#pragma once

#include <Eigen/Core>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Properties of the solid that a closed, outwards oriented mesh bounds, at density 1, in world units.
struct MassProperties {
  double volume = 0.0, area = 0.0;
  Eigen::Vector3d centre =
      Eigen::Vector3d::Zero();  ///< centre of mass; of the used points' box where there is no volume
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about the centre of mass
};

/// Integrates over the solid exactly, up to rounding: the sum of the integrals over the tetrahedra of the
/// triangles with the middle of the mesh's box (the divergence theorem; Tonon, *Explicit Exact Formulas for
/// the 3-D Tetrahedron Inertia Tensor*, 2004), in the order of the triangles. Of a mesh whose volume is not
/// above 0 the inertia stays 0.
MassProperties mass_properties(const PolygonMesh& mesh);

}  // namespace hermesh
