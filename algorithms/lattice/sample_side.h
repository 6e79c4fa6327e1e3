// The position that defines a sample's side. A sample on a polygon has no side of its own: parts of a model
// that meet in a plane of samples would be separated along it, and a wall one voxel thick, whose samples all
// lie on it, would be lost. So sides are those of the lattice shifted by a small amount in general position,
// and each sample belongs to the solid on that side of the polygon (Edelsbrunner & Mücke, Simulation of
// Simplicity, ACM TOG 9(1), 1990). Of a box from 0 to n the samples 0 … n − 1 are inside: every layer has as
// many samples as it is voxels thick.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

namespace hermesh {

/// The shift, in voxels. It is far above the tolerance of the crossing test (1e-9) and the rounding of
/// coordinates, far below anything visible in a distance, and its components are in no ratio of small
/// integers, so no polygon through samples at small slopes contains the shifted ones, too.
inline constexpr std::array<double, 3> kSideShift = {3.1415927e-6, 2.2182818e-6, 1.2020569e-6};

/// Returns the position whose side sample (x, y, z) has, in voxels.
inline Eigen::Vector3d side_place(double x, double y, double z) {
  return {x + kSideShift[0], y + kSideShift[1], z + kSideShift[2]};
}
inline Eigen::Vector3d side_place(const std::array<std::int32_t, 3>& sample) {
  return side_place(sample[0], sample[1], sample[2]);
}

/// Least distance of a sample inside from the surface, in voxels, so that its distance has a sign.
inline constexpr double kLeastDepth = 0x1p-24;

}  // namespace hermesh
