// Which points of a fine mesh hang together within blocks of 16, 8, 4 and 2 voxels: the first, bold step of a decimation.
#pragma once

#include <span>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"

namespace hermesh {

/// A set is what edges connect within a lattice-aligned block; it merges if its points, edges and triangles are a disc or a
/// tree and their planes pass well within the tolerance of one point. Pinned points are in none. The greatest blocks
/// are 16 voxels wide.
MergeForest block_forest(const FineMesh& fine, std::span<const float> tolerance, std::span<const std::uint8_t> pinned,
                         const FilePoints& file, const RunContext& context);

}  // namespace hermesh
