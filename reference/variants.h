// Tables of third-party methods, with the same interface as ours, and of slow, exact reference methods.
#pragma once

#include <span>

#include "algorithms/core/variant.h"

namespace hermesh {

/// Returns the table of third-party extractors.
std::span<const Extractor> reference_extractors();
/// Returns the table of third-party voxelizers and of the slow, exact ones.
std::span<const Voxelizer> reference_voxelizers();

}  // namespace hermesh
