#include "algorithms/extraction/manifold_dual_contouring/certified_decimation.h"

#include "algorithms/extraction/manifold_dual_contouring/block_forest.h"
#include "algorithms/extraction/manifold_dual_contouring/decimation.h"
#include "algorithms/extraction/manifold_dual_contouring/merge_proof.h"

namespace hermesh {

CertifiedMesh decimate_certified(const FineMesh& fine, const std::vector<float>& tolerance,
                                 std::vector<std::uint8_t> pinned, const FilePoints& file, RunContext& context) {
  pinned.resize(tolerance.size());
  for (std::size_t p = 0; p < tolerance.size(); ++p)
    if (!(tolerance[p] > 0)) pinned[p] = 1;
  const auto timed = [&](const char* name, auto&& work) {
    Stage stage(context, name);
    return work();
  };
  MergeForest forest = timed("decimate", [&] { return block_forest(fine, tolerance, pinned, file, context); });
  MergedMesh merged = timed("decimate", [&] { return sort_out_merges(forest, fine, context); });
  for (const Collapses kind : {Collapses::bold, Collapses::careful}) {
    timed("decimate", [&] { collapse_edges(forest, merged, fine, tolerance, pinned, kind, file, context); });
    merged = timed("certify", [&] { return prove_merges(forest, fine, tolerance, context); });
  }
  return {merged.mesh->points(), merged.mesh->triangles(), std::move(merged.origin)};
}

}  // namespace hermesh
