// THE table of our own variants. Adding one is an entry in variants.cpp and its sources in
// algorithms/CMakeLists.txt.
#pragma once

#include <span>

#include "algorithms/core/variant.h"

namespace hermesh {

std::span<const Extractor> our_extractors();
std::span<const Voxelizer> our_voxelizers();

}  // namespace hermesh
