// A picture of the pieces of a fracture, moved apart.
#pragma once

#include <filesystem>

#include "algorithms/core/run_context.h"

namespace hermesh {

/// Writes exploded.png into a directory with pieces.json and the files of the pieces (fracture_folder.h):
/// each piece is moved away from the middle of the object by half of its distance from it.
/// @throws Error if a file cannot be read or written; Cancelled.
void draw_exploded(const std::filesystem::path& directory, RunContext& context);

}  // namespace hermesh
