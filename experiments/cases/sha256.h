// SHA-256, which says that data are the ones that were meant.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// The hash of the file's bytes, in 64 hexadecimal digits. @throws Error if it cannot be read.
std::string sha256_of_file(const std::filesystem::path& path);

/// The hash of the characters.
std::string sha256_of_text(std::string_view text);

/// The hash of the arrays: the numbers of points, triangles and quads (64 bits each), the origin, the points,
/// the triangles, the quads, all little-endian.
std::string sha256_of_mesh(const PolygonMesh& mesh);

}  // namespace hermesh
