// The OpenVDB grid inside a LevelSet. Heavy (seconds per translation unit): include it from .cpp files.
#pragma once

#include <Eigen/Core>

#include "algorithms/core/level_set.h"
#include "algorithms/core/openvdb_trees.h"

namespace hermesh {

/// The grid behind a LevelSet: values in world units, placement by its transform.
struct LevelSetGrid {
  openvdb::FloatGrid::ConstPtr grid;
};

/// Wraps a grid, which must not be changed afterwards.
inline LevelSet make_level_set(openvdb::FloatGrid::ConstPtr grid) {
  return LevelSet(std::make_shared<const LevelSetGrid>(LevelSetGrid{std::move(grid)}));
}

inline Eigen::Vector3d to_eigen(const openvdb::Vec3d& v) { return {v.x(), v.y(), v.z()}; }

/// Registers OpenVDB's types, once; call it before creating, reading or writing a grid.
/// thesis/voxels/dense_hermite.h registers the types of dense Hermite data.
void initialize_openvdb();

}  // namespace hermesh
