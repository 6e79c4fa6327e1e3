// Data of a public volume. Heavy (OpenVDB): include it after inside.h from .cpp files that need it.
#pragma once

#include "algorithms/core/level_set_grid.h"
#include "packages/cpp/inside.h"

namespace hermesh::v1 {

struct HERMESH_INNER Volume::Grid {
  openvdb::GridBase::ConstPtr grid;
  LevelSet level_set;  ///< the same grid, where it is of floats
  std::string name;
};

}  // namespace hermesh::v1
