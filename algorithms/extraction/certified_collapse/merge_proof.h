// What is unproven among the merges of a forest is taken back, until the rest is proved.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"

namespace hermesh {

/// The mesh that the merges of a forest make of a fine one: a triangle whose corners go into three sets stays, the others
/// vanish.
struct MergedMesh {
  std::optional<FineMesh> mesh;
  std::vector<std::uint32_t> leaders;  ///< for each of its points the fine one that its set goes by
  std::vector<std::uint32_t> origin;   ///< for each of its triangles the fine one; ascending
  std::vector<std::uint32_t> number;   ///< for each fine point that is a leader its point here; else kNone
};

/// Splits sets until the mesh keeps its promises, and returns it: the topology of `fine`, no two triangles that meet,
/// and each mesh within the tolerance of the other (certified_decimation.h).
/// @param forest whose sets are split
/// @param fine the fine mesh
/// @param tolerance by point of `fine`, voxels
/// @param context asked whether to stop
/// @param proved number of sets, the first ones, with which alone the mesh kept its promises: later ones are split
///   first, so that the mesh does not become finer than it was before them (but for rare failures away from them)
/// @throws Cancelled
MergedMesh prove_merges(MergeForest& forest, const FineMesh& fine, std::span<const float> tolerance, RunContext& context,
                        std::size_t proved = 0);

/// Splits sets until the mesh has the topology of `fine`, and returns it; nothing is promised of distances and
/// contacts. @throws Cancelled
MergedMesh sort_out_merges(MergeForest& forest, const FineMesh& fine, RunContext& context);

}  // namespace hermesh
