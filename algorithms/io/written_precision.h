// Whether a mesh file can hold the points of a volume's mesh: its coordinates are those of the world, and the
// farther from the world's zero they lie, the coarser they are.
#pragma once

#include <filesystem>

#include "algorithms/core/level_set.h"

namespace hermesh {

/// True for the formats that hold world coordinates in single precision: STL.
bool is_written_in_single(const std::filesystem::path& path);

/// Refuses a file in which points of a mesh of this volume would be rounded by more than a hundredth of a
/// voxel: by single precision about the mesh's own origin (PolygonMesh), or by that of the file.
/// @throws Error that says by how much, and what to do.
void check_written_precision(const std::filesystem::path& path, const LevelSet& level_set);

}  // namespace hermesh
