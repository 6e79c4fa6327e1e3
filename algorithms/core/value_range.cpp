#include "algorithms/core/value_range.h"

#include <openvdb/tools/Count.h>

#include "algorithms/core/level_set_grid.h"

namespace hermesh {

std::pair<float, float> value_range(const LevelSet& volume) {
  const openvdb::FloatTree& tree = volume.grid().grid->tree();
  if (tree.empty() || !tree.cbeginValueOn()) return {tree.background(), tree.background()};
  const openvdb::math::MinMax<float> range = openvdb::tools::minMax(tree);
  return {range.min(), range.max()};
}

}  // namespace hermesh
