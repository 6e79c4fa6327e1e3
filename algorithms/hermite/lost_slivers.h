// What a Boolean combination of Hermite data loses between samples (trap T10, boolean_rule.h).
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "algorithms/hermite/boolean_rule.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh {

/// Parts of edges that both operands cross against each other, between the two crossings: of an intersection
/// or a difference slivers of material that are lost, of a union gaps that are filled. No sample lies in
/// them.
struct LostSlivers {
  std::size_t edges = 0;  ///< number of edges with such a part
  double volume = 0.0;    ///< cubic voxels, about: what the lattice lines along that axis find that find most
  double longest =
      0.0;  ///< length of the longest part, voxels: the thickness there if the edge is at right angles to it
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< middle of the longest part, world units
};

/// What the combination of two operands on one lattice loses, as combine() takes them. Parts of less than a
/// thousandth of a voxel are taken for rounding, and do not count. Symmetric in the operands of a union and
/// an intersection.
LostSlivers lost_slivers(Boolean boolean, const FloatHermite& a, const FloatHermite& b);

/// A sentence on what became of parts of the result that are thinner than a voxel of that size (world units).
/// (Parts that an operand by itself lost are told of when it is voxelized.)
std::string lost_slivers_note(const LostSlivers& lost, Boolean boolean, double voxel_size);

}  // namespace hermesh
