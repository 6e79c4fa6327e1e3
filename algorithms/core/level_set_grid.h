// The OpenVDB grid inside a LevelSet. Heavy (seconds a translation unit): include it from .cpp files that
// need it.
#pragma once

#include <Eigen/Core>

#include "algorithms/core/level_set.h"
#include "algorithms/core/openvdb_trees.h"

namespace hermesh {

/// The grid behind a LevelSet: values in world units, placement by its transform.
struct LevelSetGrid {
  openvdb::FloatGrid::ConstPtr grid;
};

/// Wraps a grid, which nobody may change from then on.
inline LevelSet make_level_set(openvdb::FloatGrid::ConstPtr grid) {
  return LevelSet(std::make_shared<const LevelSetGrid>(LevelSetGrid{std::move(grid)}));
}

/// The vector as Eigen has it.
inline Eigen::Vector3d to_eigen(const openvdb::Vec3d& v) { return {v.x(), v.y(), v.z()}; }

/// Registers OpenVDB's types and ours, once; call it before a grid is made, read or written.
void initialize_openvdb();

}  // namespace hermesh
