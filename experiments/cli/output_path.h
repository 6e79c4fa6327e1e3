// Whether a result can be written, asked before the work that makes it.
#pragma once

#include <filesystem>

namespace hermesh::cli {

/// Checks that a mesh can be written there.
/// @throws Error if the path is not one that meshes are written to (kMeshEndings), or check_writable()
/// throws.
void check_mesh_output(const std::filesystem::path& path);

/// Checks that a file of that kind keeps attributes. @throws UsageError if meshes lose the attributes of
/// their points in files of that kind: all but .ply and .ply.gz.
void check_keeps_attributes(const std::filesystem::path& path);

/// Checks that a volume can be written there. @throws Error if the path does not end in
/// .vdb, or check_writable() throws.
void check_volume_output(const std::filesystem::path& path);

/// Checks that a file can be written there.
/// @throws Error if the folder does not exist or cannot be written, or if something other than a plain file
/// is there.
void check_writable(const std::filesystem::path& path);

}  // namespace hermesh::cli
