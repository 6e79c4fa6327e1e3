// The columns that tell whether meshes bound the solid of the polygons that they were made from.
#pragma once

#include <vector>

#include "algorithms/io/mesh_file.h"
#include "experiments/harness/measurement.h"
#include "validation/mesh_report.h"

namespace hermesh {

std::vector<MeasuredColumn> solid_columns();

/// Their values of one mesh.
void set_solid(Json& values, const validation::SolidComparison& solid);

/// All pieces of something broken as one mesh beside what was broken; their seams are no walls. World units.
/// @throws Cancelled; Error like validation::judge().
validation::SolidComparison compare_pieces(const std::vector<MeshFile>& pieces, const MeshFile& whole,
                                           double voxel_size, RunContext& context);

}  // namespace hermesh
