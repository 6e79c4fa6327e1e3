#include "algorithms/core/level_set.h"

#include <openvdb/openvdb.h>

#include <cmath>
#include <mutex>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/dense/dense_hermite.h"

namespace hermesh {

// The transform may mirror, which makes the signed volume of a voxel negative: its magnitude counts.
double LevelSet::voxel_size() const { return std::cbrt(std::abs(grid_->grid->transform().voxelVolume())); }

double LevelSet::background() const { return grid_->grid->background(); }

std::size_t LevelSet::active_voxels() const { return grid_->grid->activeVoxelCount(); }

std::size_t LevelSet::memory_bytes() const { return grid_->grid->memUsage(); }

std::array<int, 3> LevelSet::dimensions() const {
  const openvdb::Coord size = grid_->grid->evalActiveVoxelDim();
  return {size.x(), size.y(), size.z()};
}

void initialize_openvdb() {
  static std::once_flag once;
  // Threads that come second wait until all types are there. Our own follow, because openvdb::initialize()
  // clears the registry of grid types before it fills it.
  std::call_once(once, [] {
    openvdb::initialize();
    register_hermite_grids();
  });
}

}  // namespace hermesh
