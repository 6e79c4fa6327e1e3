// Points as represented in the file, in index space: PolygonMesh::world(), i.e. the sum in double precision
// of the placement's origin and of a single-precision offset. Far from the world's zero that sum rounds, too;
// about zero it is single precision (STL).
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include "algorithms/core/bounds.h"
#include "algorithms/lattice/placement.h"

namespace hermesh {

/// Rounds positions of index space to those that the mesh file can represent. Every geometric test in this
/// directory uses rounded() points, so that its result holds for the mesh as written. (An affine map changes
/// no orientation; its own rounding is 2^-29 of the file's, which is at most an eighth of a margin:
/// CellBlocks::margin().)
class FilePoints {
 public:
  /// @param placement of the volume
  /// @param caps box of index coordinates that all points are clamped to before rounding
  explicit FilePoints(const IndexToWorld& placement, const Bounds& caps = Bounds::unbounded())
      : placement_(placement), to_index_(placement.linear.inverse()) {
    for (int axis = 0; axis < 3; ++axis) {
      lower_[axis] = caps.lower[axis] - placement.base[axis];
      upper_[axis] = caps.upper[axis] - placement.base[axis];
    }
  }

  /// Returns the file's coordinates of a position in index space: world units, relative to the placement's
  /// origin.
  Eigen::Vector3f in_file(const Eigen::Vector3d& index) const {
    return placement_.local(index).cast<float>();
  }
  /// Returns the representable point nearest to the position clamped to the caps, in index coordinates
  /// relative to the placement's base. It stays in its cell: each cell of the surface has a part within the
  /// caps.
  Eigen::Vector3d rounded(const Eigen::Vector3d& index) const {
    const Eigen::Vector3d within = index.cwiseMax(lower_).cwiseMin(upper_);
    const Eigen::Vector3d written = placement_.origin + in_file(within).cast<double>();
    // The difference is exact: the origin is zero or several times as far from zero as points are from it.
    return to_index_ * ((written - placement_.origin) - placement_.offset);
  }
  const IndexToWorld& placement() const { return placement_; }

 private:
  IndexToWorld placement_;
  Eigen::Matrix3d to_index_;
  Eigen::Vector3d lower_, upper_;  ///< caps, relative to the placement's base
};

}  // namespace hermesh
