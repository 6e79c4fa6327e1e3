// Volumes of exact shapes without the error of polygons: level sets of exact distances, and exact Hermite
// data.
#pragma once

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "experiments/accuracy/exact_shapes.h"

namespace hermesh {

/// Returns the level set with the exact distance at every sample within `half_width` voxels, rounded to
/// single precision; sample (0, 0, 0) is the world's origin. @throws Error where the shape does not know
/// distances that large; Cancelled.
LevelSet exact_level_set(const PlacedShape& shape, double voxel_size, double half_width, RunContext& context);

/// Returns exact crossings and normals on that level set's lattice and with its signs. @throws Cancelled.
FloatHermite exact_hermite(const PlacedShape& shape, const LevelSet& level_set, RunContext& context);

/// How far a level set is from the truth, over its active voxels.
struct BandErrors {
  std::size_t voxels = 0;
  double rms = 0.0, max = 0.0;  ///< of the values, world units
  std::size_t wrong_signs = 0;  ///< of samples farther than `near` from the surface
};
/// `near`: world units. Values where the shape does not know the distance, or that lie where it is not
/// described, are left out. @throws Cancelled.
BandErrors band_errors(const PlacedShape& shape, const LevelSet& level_set, double near,
                       const RunContext& context);

}  // namespace hermesh
