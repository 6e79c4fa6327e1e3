// Points as the file will hold them: single precision in world units, seen from index space.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include "algorithms/core/blocks.h"

namespace hermesh {

/// Every test of geometry in this folder looks at rounded() points, so that what it proves holds of the mesh as
/// written. (An affine map changes no orientation; its own rounding, some 1e-13 voxels, is far below the margins.)
class FilePoints {
 public:
  explicit FilePoints(const IndexToWorld& placement)
      : placement_(placement), to_index_(placement.linear.inverse()) {}

  Eigen::Vector3f in_file(const Eigen::Vector3d& index) const { return placement_.local(index).cast<float>(); }
  /// The index coordinates, relative to the placement's base, of the nearest point that the file can hold.
  Eigen::Vector3d rounded(const Eigen::Vector3d& index) const {
    return to_index_ * (in_file(index).cast<double>() - placement_.offset);
  }
  const IndexToWorld& placement() const { return placement_; }

 private:
  IndexToWorld placement_;
  Eigen::Matrix3d to_index_;
};

}  // namespace hermesh
