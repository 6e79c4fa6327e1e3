// The table of other people's methods, behind the same structs as ours, and of the slow certain oracles.
#pragma once

#include <span>

#include "algorithms/core/variant.h"

namespace hermesh {

/// The table of extractors of other people.
std::span<const Extractor> reference_extractors();
/// The table of voxelizers of other people, and of the slow certain ones.
std::span<const Voxelizer> reference_voxelizers();

}  // namespace hermesh
