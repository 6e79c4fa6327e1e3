// Small volumes for tests. Light; the grids are made in the .cpp.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <random>

#include "algorithms/core/level_set.h"

namespace hermesh {

/// Returns a dense block of samples from index (0,0,0) to size − 1, all active, with voxel size 1 and the
/// given background around it. The grid is marked as a level set, so that less than the isovalue is inside.
LevelSet make_volume(const std::array<int, 3>& size, float background,
                     const std::function<float(int, int, int)>& value);

/// Returns many small sign patterns in one volume, each with outside all around it: the lowest bits of
/// pattern(i) specify which of its size³ samples are inside; the values are random.
LevelSet make_patterns(int per_axis, int size, const std::function<std::uint32_t(int)>& pattern,
                       std::mt19937 random);

/// Returns a narrow-band level set of a sphere about a point, band of three voxels, inside filled with tiles.
/// `translation` is the world position of index zero.
LevelSet make_sphere(double radius_in_voxels, double voxel_size,
                     const std::array<double, 3>& translation = {0, 0, 0});

}  // namespace hermesh
