// Distances of the vertices of meshes to an input, which the page of results shows as colours.
#pragma once

#include <filesystem>
#include <vector>

#include "algorithms/core/run_context.h"
#include "experiments/cases/cases.h"

namespace hermesh {

/// Returns the distances of all vertices of each mesh file to the polygons of the input, in world units.
/// @throws Error if a file cannot be read; Cancelled.
std::vector<std::vector<double>> mesh_distances(const LoadedCase& input,
                                                const std::vector<std::filesystem::path>& meshes,
                                                RunContext& context);

}  // namespace hermesh
