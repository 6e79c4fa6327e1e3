// Where the bytes of a glTF file's buffers are. Private to algorithms/io.
#pragma once

#include <string>
#include <string_view>

#include "algorithms/io/mesh_file_formats.h"

namespace hermesh::mesh_formats {

/// The two chunks of a .glb file; the second one may be missing, and is empty then.
struct GlbChunks {
  std::string_view json, binary;
};

/// Splits a .glb file into its chunks. @throws Error for a version other than 2, or lengths that are not
/// those of the bytes.
GlbChunks split_glb(std::string_view bytes, MeshBuilder& builder);

/// The bytes that a buffer's URI stands for: base64 in the URI itself, or a file in the folder of the mesh
/// file or beneath it.
/// @throws Error for any other place, for damaged base64, and for a file that cannot be read.
std::string bytes_of_uri(std::string_view uri, const MeshBuilder& builder);

}  // namespace hermesh::mesh_formats
