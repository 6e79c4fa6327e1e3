// Points as the file will hold them, seen from index space: PolygonMesh::world(), the sum in double precision of the
// placement's origin and of single precision about it. Far from the world's zero that sum rounds, too; about zero itself
// it is single precision (STL).
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include "algorithms/lattice/placement.h"

namespace hermesh {

/// Rounds places of index space to what the mesh file will hold. Every test of geometry in this folder looks at
/// rounded() points, so that what it proves holds for the mesh as written. (An affine map changes no orientation; its
/// own rounding, some 1e-13 voxels, is far below the margins.)
class FilePoints {
 public:
  explicit FilePoints(const IndexToWorld& placement)
      : placement_(placement), to_index_(placement.linear.inverse()) {}

  /// The coordinates that the file holds for a place of index space: world units, relative to the placement's origin.
  Eigen::Vector3f in_file(const Eigen::Vector3d& index) const { return placement_.local(index).cast<float>(); }
  /// The index coordinates, relative to the placement's base, of the nearest point that the file can hold.
  Eigen::Vector3d rounded(const Eigen::Vector3d& index) const {
    const Eigen::Vector3d written = placement_.origin + in_file(index).cast<double>();
    // The difference is exact, for the origin is zero or several times as far from zero as points are from it.
    return to_index_ * ((written - placement_.origin) - placement_.offset);
  }
  const IndexToWorld& placement() const { return placement_; }

 private:
  IndexToWorld placement_;
  Eigen::Matrix3d to_index_;
};

}  // namespace hermesh
