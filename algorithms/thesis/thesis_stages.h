// The stages of the thesis's voxelizer, in the order of §5.1.
#pragma once

#include "algorithms/thesis/thesis_band.h"

namespace hermesh::thesis {

/// Rasterises (§5.2, algorithms 1 and 2): boundary voxels and their neighbours, with distances and triangles.
/// The blocks are linked.
/// @throws Cancelled.
Band rasterize(const Triangles& triangles, RunContext& context);

/// Determines the signs (§5.3): fills in BandBlock::outside. `sign_angle` is in degrees.
/// @throws Cancelled.
void determine_signs(Band& band, const Triangles& triangles, double sign_angle, RunContext& context);

/// Cleans up (§5.4, algorithms 3 and 4): takes voxels out of BandBlock::set that self-intersections left
/// inside.
/// @throws Cancelled.
void remove_unwanted_voxels(Band& band, RunContext& context);

/// Expands the band (§5.5, algorithm 5) by layers of new voxels as long as one lies within its side's width.
/// The widths are in voxels.
/// @throws Cancelled.
void expand(Band& band, const Triangles& triangles, double exterior, double interior, RunContext& context);

}  // namespace hermesh::thesis
