// What values a volume has, for sentences about isovalues.
#pragma once

#include <utility>

#include "algorithms/core/level_set.h"

namespace hermesh {

/// The least and the greatest active value, tiles included; of a volume without active voxels the background
/// twice.
std::pair<float, float> value_range(const LevelSet& volume);

}  // namespace hermesh
