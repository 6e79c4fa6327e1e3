#include "algorithms/extraction/certified_collapse/certified_decimation.h"

#include <span>

#include "algorithms/extraction/certified_collapse/block_forest.h"
#include "algorithms/extraction/certified_collapse/decimation.h"
#include "algorithms/extraction/certified_collapse/merge_proof.h"
#include "algorithms/extraction/certified_collapse/relaxation.h"

namespace hermesh {
namespace {

/// Once more is worth its time where a pass and its proof had this share fewer points in the end than before.
constexpr double kWorthAnother = 0.05;
constexpr int kMostPasses = 3;

}  // namespace

CertifiedMesh decimate_certified(const FineMesh& fine, const std::vector<float>& tolerance,
                                 std::vector<std::uint8_t> pinned, const FilePoints& file,
                                 RunContext& context, const Nearness& nearness,
                                 std::span<const TrianglePieces> pieces) {
  // Where no distance is allowed nothing may move, whatever the caller has pinned.
  pinned.resize(tolerance.size());
  for (std::size_t p = 0; p < tolerance.size(); ++p)
    if (!(tolerance[p] > 0)) pinned[p] = 1;
  const auto timed = [&](const char* name, auto&& work) {
    Stage stage(context, name);
    return work();
  };
  // *Propose* by blocks, the cheapest way by far to be rid of most points, and by collapses that look at the
  // quadrics alone. Only the topology is looked at yet: distances are proved once edges have been collapsed
  // with care, too.
  MergeForest forest = timed(
      "decimate", [&] { return block_forest(fine, tolerance, pinned, nearness.moment, file, context); });
  MergeProof proof(forest, fine, tolerance, context, pieces);
  const auto collapse = [&](std::span<const std::uint8_t> where, Collapses kind) {
    timed("decimate", [&] {
      collapse_edges(forest, proof.merged(), where, fine, tolerance, pinned, kind, nearness.moment, file,
                     context);
    });
  };
  timed("decimate", [&] { proof.sort_out(); });
  collapse({}, Collapses::bold);
  timed("decimate", [&] { proof.sort_out(); });
  collapse({}, Collapses::careful);
  timed("certify", [&] { proof.prove(); });
  // Where the proof has split sets there is room again.
  for (int i = 0; i < kMostPasses; ++i) {
    const double before = double(proof.merged().leaders.size());
    const std::vector<std::uint8_t> brought_back(proof.brought_back().begin(), proof.brought_back().end());
    collapse(brought_back, Collapses::careful);
    timed("certify", [&] { proof.prove(); });
    if (double(proof.merged().leaders.size()) > (1.0 - kWorthAnother) * before) break;
  }
  if (nearness.relaxation > 0) {
    timed("relax", [&] {
      propose_relaxation(forest, proof.merged(), fine, tolerance, pinned, nearness.relaxation, file, context);
    });
    timed("certify", [&] { proof.prove(); });
  }
  const MergedMesh& merged = proof.merged();
  return {merged.mesh->points(), merged.mesh->triangles(), merged.origin};
}

}  // namespace hermesh
