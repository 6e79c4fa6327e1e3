// THE table of our own variants. Adding one is an entry in variants.cpp, of a voxelizer in voxelizers.cpp,
// and its sources in algorithms/CMakeLists.txt.
#pragma once

#include <span>

#include "algorithms/core/variant.h"

namespace hermesh {

/// The extractors of our own, in the order in which they are listed; the table lives as long as the program.
std::span<const Extractor> our_extractors();
/// The voxelizers of our own, in the order in which they are listed; the table lives as long as the program.
std::span<const Voxelizer> our_voxelizers();

}  // namespace hermesh
