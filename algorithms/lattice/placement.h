// Positions of the samples of a lattice in the world.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <cstdint>

namespace hermesh {

/// Affine map from samples to the world.
struct IndexToWorld {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();  ///< voxel to world; any regular affine map
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();      ///< world position of `base`, less `origin`
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< origin of the meshes made from the grid, world units
  std::array<std::int32_t, 3> base{};                ///< index coordinates near the grid's middle or zero

  /// Returns the position relative to `origin`, from index coordinates relative to `base`.
  Eigen::Vector3d local(const Eigen::Vector3d& index) const { return linear * index + offset; }
  /// Returns true if the map mirrors, so that polygons must be reversed.
  bool mirrors() const { return linear.determinant() < 0; }
};

}  // namespace hermesh
