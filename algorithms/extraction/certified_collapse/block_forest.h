// Which points of a fine mesh hang together within blocks of 16, 8, 4 and 2 voxels: the first step of a
// decimation, and an unproven one, for nothing is proved of it yet.
#pragma once

#include <span>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"

namespace hermesh {

/// The sets of points that edges connect within lattice-aligned blocks of 2, 4, 8 and 16 voxels, each made of
/// those of the next smaller blocks. A set merges if its points, edges and triangles are a disc or a tree and
/// their planes pass well within the tolerance of one place.
/// @param fine the mesh, in index space
/// @param tolerance by point, voxels
/// @param pinned by point: points that are in no set
/// @param moment greatest cost of a collapse, voxels⁴ (decimation.h), of which a set may take its share; 0
/// for none
/// @param file rounds places to the file's precision
/// @param context asked whether to stop
/// @throws Cancelled
MergeForest block_forest(const FineMesh& fine, std::span<const float> tolerance,
                         std::span<const std::uint8_t> pinned, double moment, const FilePoints& file,
                         const RunContext& context);

}  // namespace hermesh
