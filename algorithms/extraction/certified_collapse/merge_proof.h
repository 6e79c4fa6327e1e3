// What is unproven among the merges of a forest is taken back, until the rest is proved.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"
#include "algorithms/extraction/contact/triangle_overlay.h"

namespace hermesh {

/// The mesh that the merges of a forest make of a fine one: a triangle whose corners go into three sets
/// stays, the others vanish.
struct MergedMesh {
  std::optional<FineMesh> mesh;
  std::vector<std::uint32_t> leaders;  ///< for each of its points the fine one that its set goes by
  std::vector<std::uint32_t> origin;   ///< for each of its triangles the fine one; ascending
  std::vector<std::uint32_t> number;   ///< for each fine point that is a leader its point here; else kNone
};

/// Splits sets of a forest until the merged mesh is proved. What was proved of a triangle is kept until a set
/// near it is split or joined. Sets are called unproven from many threads, by bits that are only ever set,
/// and split by one: so the outcome does not depend on threads.
class MergeProof {
 public:
  /// @param forest whose sets are split; others may join some between the calls of this
  /// @param fine the fine mesh
  /// @param tolerance by point of `fine`, voxels
  /// @param context asked whether to stop
  MergeProof(MergeForest& forest, const FineMesh& fine, std::span<const float> tolerance,
             RunContext& context);

  /// Splits sets until the merged mesh has the topology of the fine one, and returns it; nothing is promised
  /// of distances and contacts. @throws Cancelled
  const MergedMesh& sort_out();
  /// Splits sets until the merged mesh keeps its promises, and returns it: the topology of the fine one, no
  /// two triangles that meet, and each mesh within the tolerance of the other (certified_decimation.h). Of
  /// the sets that a failure concerns the one that was joined last is split first. @throws Cancelled
  const MergedMesh& prove();

  const MergedMesh& merged() const { return merged_; }
  /// Flags by point of the fine mesh: 1 for points of the merged mesh that splits have brought back in the last call.
  std::span<const std::uint8_t> brought_back() const { return brought_back_; }

 private:
  using Places = std::array<OverTriangle::Place, 3>;
  /// What is known of a fine triangle, as bits.
  enum Proof : std::uint8_t {
    kStays = 1,    ///< it is a triangle of the merged mesh
    kNear = 2,     ///< the merged triangle is near the fine mesh
    kApart = 4,    ///< the merged triangle meets no other one that is marked so
    kCovered = 8,  ///< the fine triangle is near the merged mesh
    kFar = 16,  ///< the proof of kCovered looked at a merged triangle that has none of its sets for a corner
    kOpen = 32  ///< it waits for the proof of kCovered
  };
  class Above;

  void run(bool geometry);
  void take_in_joins();
  void build();
  bool stays(std::uint32_t t) const;
  bool is_single(std::uint32_t t) const;
  std::uint32_t merged_point(std::uint32_t p) const { return merged_.number[forest_.leader(p)]; }
  std::array<std::uint32_t, 3> leaders(std::uint32_t t) const;
  bool touches(std::uint32_t face, const std::array<std::uint32_t, 3>& leaders) const;
  bool is_known(std::uint32_t face, const std::array<std::uint32_t, 3>& leaders) const;
  double bound(std::uint32_t fine_triangle) const;
  void call_unproven(std::uint32_t t);
  void look_at_topology();
  void look_at_merged();
  void look_at_fine();
  void look_at_contacts();
  bool few_are_unproven() const;
  std::vector<std::uint32_t> unproven_sets() const;
  bool split();
  void forget_covered(const std::vector<std::uint32_t>& changed);
  void forget_covered(std::uint32_t p, Proof which);
  std::uint8_t proofs_of(std::uint32_t t);
  void prove(std::uint32_t t, Proof what);

  MergeForest& forest_;
  const FineMesh& fine_;
  const std::span<const float> tolerance_;
  RunContext& context_;
  std::vector<std::uint8_t> proofs_;    ///< of each fine triangle
  std::vector<std::uint8_t> unproven_;  ///< sets to be split
  std::vector<std::uint32_t> open_;     ///< fine triangles that are not proved to be covered
  std::vector<std::uint8_t> brought_back_;
  double one_bound_ = 0;      ///< bound() of all fine triangles, or 0 if they differ
  std::size_t known_ = 0;     ///< sets that the merged mesh was made with
  bool any_covered_ = false;  ///< whether anything has been proved to be covered
  int splits_ = 0;
  MergedMesh merged_;
  tbb::enumerable_thread_specific<TriangleOverlay> overlays_;
};

}  // namespace hermesh
