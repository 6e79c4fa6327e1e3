// Precision of mesh files: coordinates are coarser the farther they are from the world's zero.
#pragma once

#include <filesystem>

#include "algorithms/core/level_set.h"

namespace hermesh {

/// Returns true for the format that stores world coordinates in single precision: STL.
bool is_written_in_single(const std::filesystem::path& path);

/// Refuses a file in which points of a mesh of this volume would be rounded by more than a hundredth of a
/// voxel: by single precision about the mesh's own origin (PolygonMesh), or by that of the file.
/// @throws Error with the amount, and advice.
void check_written_precision(const std::filesystem::path& path, const LevelSet& level_set);

}  // namespace hermesh
