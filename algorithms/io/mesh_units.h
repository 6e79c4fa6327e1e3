// Mesh files that state the unit of their coordinates.
#pragma once

#include <filesystem>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Writes a mesh as write_mesh() (mesh_file.h) does, but states in a 3MF file that its coordinates are
/// metres. write_mesh() does not know their unit, and states millimetres. A glTF file is in metres always,
/// and the other formats state no unit.
/// @throws Error as write_mesh() does.
void write_mesh_in_metres(const std::filesystem::path& path, const PolygonMesh& mesh, RunContext& context);

}  // namespace hermesh
