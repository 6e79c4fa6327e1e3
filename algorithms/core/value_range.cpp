#include "algorithms/core/value_range.h"

#include <openvdb/tools/Count.h>

#include "algorithms/core/level_set_grid.h"

namespace hermesh {

std::pair<float, float> value_range(const LevelSet& volume) {
  const openvdb::FloatTree& tree = volume.grid().grid->tree();
  // Of no values there is neither a least nor a greatest, so the background stands in.
  if (tree.empty() || !tree.cbeginValueOn()) return {tree.background(), tree.background()};
  // One sweep in parallel over leaves and tiles; minimum and maximum do not depend on its order.
  const openvdb::math::MinMax<float> range = openvdb::tools::minMax(tree);
  return {range.min(), range.max()};
}

}  // namespace hermesh
