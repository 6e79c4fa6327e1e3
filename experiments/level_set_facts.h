// What a row says of a level set besides what OpenVDB counts itself.
#pragma once

#include <cstdint>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// FNV-1a over the background, the tiles, and of every leaf the origin, the mask of active voxels and the
/// bits of all values.
std::uint64_t fingerprint(const LevelSet& level_set);

/// Connected components of the zero set, polygonised by marching cubes; 0 where it is empty.
std::int64_t count_surface_components(const LevelSet& level_set, RunContext& context);

}  // namespace hermesh
