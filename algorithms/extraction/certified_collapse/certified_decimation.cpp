#include "algorithms/extraction/certified_collapse/certified_decimation.h"

#include "algorithms/extraction/certified_collapse/merge_proof.h"
#include "algorithms/extraction/certified_collapse/merge_proposals.h"

namespace hermesh {

CertifiedMesh decimate_certified(const FineMesh& fine, const std::vector<float>& tolerance,
                                 std::vector<std::uint8_t> pinned, const FilePoints& file,
                                 RunContext& context, const Nearness& nearness,
                                 std::span<const TrianglePieces> pieces, const Bounds& within,
                                 std::span<const MissedTarget> missed) {
  // Another pass is worth its time if the last one and its proof removed this share of the vertices.
  constexpr double kWorthAnother = 0.05;
  constexpr int kMostPasses = 3;
  pinned.resize(tolerance.size());
  for (std::size_t p = 0; p < tolerance.size(); ++p)
    if (!(tolerance[p] > 0)) pinned[p] = 1;
  const DecimationInput input{fine, tolerance, pinned, nearness.moment, file, within, missed};
  const auto timed = [&](const char* name, auto&& work) {
    Stage stage(context, name);
    return work();
  };
  // Blocks are by far the cheapest way to remove most vertices. Until verified collapses have run, only the
  // topology is tested.
  MergeForest forest = timed("decimate", [&] { return block_forest(input, context); });
  MergeProof proof(forest, fine, tolerance, context, pieces);
  const auto collapse = [&](std::span<const std::uint8_t> where, Collapses kind) {
    timed("decimate", [&] { collapse_edges(forest, proof.merged(), where, input, kind, context); });
  };
  timed("decimate", [&] { proof.sort_out(); });
  collapse({}, Collapses::bold);
  timed("decimate", [&] { proof.sort_out(); });
  const auto collapse_carefully = [&](std::span<const std::uint8_t> where) {
    collapse(where, Collapses::careful);
    timed("decimate", [&] { propose_members(forest, proof.merged(), input, context); });
  };
  collapse_carefully({});
  timed("certify", [&] { proof.prove(); });
  // Where the proof has split sets, further collapses are possible.
  for (int i = 0; i < kMostPasses; ++i) {
    const double before = double(proof.merged().leaders.size());
    const std::vector<std::uint8_t> brought_back(proof.brought_back().begin(), proof.brought_back().end());
    collapse_carefully(brought_back);
    timed("certify", [&] { proof.prove(); });
    if (double(proof.merged().leaders.size()) > (1.0 - kWorthAnother) * before) break;
  }
  if (nearness.relaxation > 0) {
    timed("relax", [&] { propose_relaxation(forest, proof.merged(), input, nearness.relaxation, context); });
    timed("certify", [&] { proof.prove(); });
  }
  const MergedMesh& merged = proof.merged();
  return {merged.mesh->points(), merged.mesh->triangles(), merged.origin};
}

}  // namespace hermesh
