#include "algorithms/extraction/certified_collapse/certified_decimation.h"

#include "algorithms/extraction/certified_collapse/block_forest.h"
#include "algorithms/extraction/certified_collapse/decimation.h"
#include "algorithms/extraction/certified_collapse/merge_proof.h"

namespace hermesh {
namespace {

/// Where a proof has taken this share of its points out of sets there is room again, on large flat faces above all; and
/// another pass is worth its time if the one before had this share fewer points left than the one before that.
constexpr double kWorthAnother = 0.1;
constexpr int kMostPasses = 3;

}  // namespace

CertifiedMesh decimate_certified(const FineMesh& fine, const std::vector<float>& tolerance,
                                 std::vector<std::uint8_t> pinned, const FilePoints& file, RunContext& context) {
  // Where no distance is allowed nothing may move, whatever the caller has pinned.
  pinned.resize(tolerance.size());
  for (std::size_t p = 0; p < tolerance.size(); ++p)
    if (!(tolerance[p] > 0)) pinned[p] = 1;
  const auto timed = [&](const char* name, auto&& work) {
    Stage stage(context, name);
    return work();
  };
  // *Propose* by blocks, the cheapest way by far to be rid of most points. Only the topology is looked at yet:
  // distances are proved once edges have been collapsed, too.
  MergeForest forest = timed("decimate", [&] { return block_forest(fine, tolerance, pinned, file, context); });
  MergedMesh merged = timed("decimate", [&] { return sort_out_merges(forest, fine, context); });
  // Points that the proof brought back, of those that the mesh has then.
  const auto brought_back = [&](Collapses kind, bool was_proved) {
    const std::size_t points = merged.mesh->points().size(), sets = forest.size();
    timed("decimate", [&] { collapse_edges(forest, merged, fine, tolerance, pinned, kind, file, context); });
    const std::size_t proposed = points - (forest.size() - sets);
    merged = timed("certify", [&] { return prove_merges(forest, fine, tolerance, context, was_proved ? sets : 0); });
    const std::size_t now = merged.mesh->points().size();
    return now <= proposed ? 0.0 : double(now - proposed) / double(now);
  };
  // All sets are new to the proof now, those of blocks as well. Later passes begin with a mesh that is proved, and the
  // proof takes their own sets back first.
  brought_back(Collapses::bold, false);
  for (int i = 0; i < kMostPasses; ++i) {
    const double before = double(merged.mesh->points().size());
    if (brought_back(Collapses::careful, true) < kWorthAnother) break;
    if (double(merged.mesh->points().size()) > (1.0 - kWorthAnother) * before) break;
  }
  return {merged.mesh->points(), merged.mesh->triangles(), std::move(merged.origin)};
}

}  // namespace hermesh
