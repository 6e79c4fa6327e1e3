// What is too bold among the merges of a forest is taken back, until the rest is proved.
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
  std::vector<std::uint32_t> leaders;  ///< by its point: the fine one that its set goes by
  std::vector<std::uint32_t> origin;   ///< by its triangle: the fine one; ascending
  std::vector<std::uint32_t> number;   ///< by fine point, of leaders: its point; else kNone
};

/// Splits sets until the mesh keeps its promises, and returns it.
/// @param tolerance by point of `fine`, voxels
/// @param proved number of sets, the first ones, with which alone the mesh kept its promises: those of later ones are split
///   first, so that the mesh does not become finer than it was before them (but for rare failures away from them)
MergedMesh prove_merges(MergeForest& forest, const FineMesh& fine, std::span<const float> tolerance, RunContext& context,
                        std::size_t proved = 0);

/// The topology alone.
MergedMesh sort_out_merges(MergeForest& forest, const FineMesh& fine, RunContext& context);

}  // namespace hermesh
