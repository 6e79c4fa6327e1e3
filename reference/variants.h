// The table of other people's methods, behind the same structs as ours, and of the slow certain oracles.
#pragma once

#include <span>

#include "algorithms/core/variant.h"

namespace hermesh {

std::span<const Extractor> reference_extractors();
std::span<const Voxelizer> reference_voxelizers();

}  // namespace hermesh
