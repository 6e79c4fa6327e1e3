#include "algorithms/core/level_set.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Count.h>

#include <cmath>
#include <mutex>

#include "algorithms/core/level_set_grid.h"

namespace hermesh {

// The transform may mirror, which makes the signed volume of a voxel negative.
double LevelSet::voxel_size() const { return std::cbrt(std::abs(grid_->grid->transform().voxelVolume())); }

double LevelSet::background() const { return grid_->grid->background(); }

std::size_t LevelSet::active_voxels() const { return grid_->grid->activeVoxelCount(); }

std::size_t LevelSet::memory_bytes() const { return grid_->grid->memUsage(); }

std::array<int, 3> LevelSet::dimensions() const {
  const openvdb::Coord size = grid_->grid->evalActiveVoxelDim();
  return {size.x(), size.y(), size.z()};
}

std::pair<float, float> value_range(const LevelSet& volume) {
  const openvdb::FloatTree& tree = volume.grid().grid->tree();
  if (tree.empty() || !tree.cbeginValueOn()) return {tree.background(), tree.background()};
  const openvdb::math::MinMax<float> range = openvdb::tools::minMax(tree);
  return {range.min(), range.max()};
}

void initialize_openvdb() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

}  // namespace hermesh
