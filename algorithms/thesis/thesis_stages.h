// The stages of the thesis's voxelizer, in the order of §5.1.
#pragma once

#include "algorithms/thesis/thesis_band.h"

namespace hermesh::thesis {

/// §5.2, algorithms 1 and 2: boundary voxels and their neighbours, with distances and triangles; linked.
Band rasterize(const Triangles& triangles, RunContext& context);

/// §5.3: fills in BandBlock::outside. sign_angle in degrees.
void determine_signs(Band& band, const Triangles& triangles, double sign_angle, RunContext& context);

/// §5.4, algorithms 3 and 4: takes voxels out of BandBlock::set that self-intersections left inside.
void remove_unwanted_voxels(Band& band, RunContext& context);

/// §5.5, algorithm 5: layers of new voxels as long as one lies within its side's width, in voxels.
void expand(Band& band, const Triangles& triangles, double exterior, double interior, RunContext& context);

}  // namespace hermesh::thesis
