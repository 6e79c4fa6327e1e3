// A decimation whose distance to the mesh that it began as is proved.
#pragma once

#include <optional>
#include <vector>

#include "algorithms/extraction/manifold_dual_contouring/decimation.h"

namespace hermesh {

/// Collapses (decimation.h) until nothing more passes its tests, and proves the two-sided distance (distance_certificate.h):
/// round by round, where a cube in which the proof fails is done again with less room, and at the end for the whole mesh.
/// Nothing, and a note, if that is not proved after some attempts with less room round what fails.
/// @param asked tolerance by point of `fine`, voxels
/// @param pinned by point of `fine`, or empty: points that stay as and where they are (decimation.h)
std::optional<DecimatedMesh> decimate_certified(const FineMesh& fine, const std::vector<float>& asked,
                                                const std::vector<std::uint8_t>& pinned, const FilePoints& file,
                                                RunContext& context);

}  // namespace hermesh
