// A narrow-band sphere without any polygons, so that a micro-benchmark of extraction depends on no voxelizer.
#pragma once

#include "algorithms/core/level_set.h"

namespace hermesh {

/// The exact signed distance to a sphere whose diameter is `resolution` voxels of size 1, centred off the
/// lattice, within three voxels on either side.
LevelSet sphere_level_set(int resolution);

}  // namespace hermesh
