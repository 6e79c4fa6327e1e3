// Dual contouring straight from the samples of a level set, a leaf at a time and without Hermite data in
// between.
#pragma once

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"

namespace hermesh {

/// The polygons of dual_contouring() on what sample_level_set() gives, in another order: leaf by leaf in the
/// order of the tree. Points agree to a few thousandths of a voxel, for they are solved for in single
/// precision; where two diagonals of a quad are equally good to rounding, the other one may be taken. The
/// bytes are the same for every number of threads and every level of vector code.
/// @throws Error for an isovalue or a sample that is not finite, for a grid with perspective, and for more
/// points or quads than 32-bit indices can number; Cancelled.
PolygonMesh contour_level_set(const LevelSet& level_set, double isovalue,
                              const DualContouringOptions& options, RunContext& context);

/// False for a truncation so small that single precision would not do.
bool can_contour_level_set(const DualContouringOptions& options);

}  // namespace hermesh
