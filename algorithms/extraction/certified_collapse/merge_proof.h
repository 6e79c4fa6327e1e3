// Undoes merges of a forest that cannot be proved, until the rest is proved.
#pragma once

#include <tbb/enumerable_thread_specific.h>

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/extraction/certified_collapse/fine_mesh.h"
#include "algorithms/extraction/certified_collapse/merge_forest.h"
#include "algorithms/extraction/certified_collapse/shell_volumes.h"
#include "algorithms/extraction/contact/triangle_overlay.h"

namespace hermesh {

/// The mesh that the merges of a forest make of a fine one: a triangle stays if its corners are merged into
/// three vertices (sets or single vertices); the others vanish.
struct MergedMesh {
  std::optional<FineMesh> mesh;        ///< none before the first call of sort_out() or prove()
  std::vector<std::uint32_t> leaders;  ///< fine vertex that represents each of its vertices, as leader()
  std::vector<std::uint32_t> origin;   ///< fine triangle of each of its triangles; ascending
  /// By fine vertex: the vertex here that it represents; otherwise FineMesh::kNone, as for a leader without
  /// triangles.
  std::vector<std::uint32_t> number;
};

/// Splits sets of a forest until the merged mesh is proved. Precondition: each set is a disc or a tree, and
/// no two triangles of the fine mesh intersect, because a failure at single vertices has no set to split.
///
/// **The argument.**
/// - *Topology.* Every set is a disc or a tree: one of a block by its Euler characteristic, two joined by an
///   edge by the link condition, a move because it has one child. If no directed edge of the merged mesh
///   occurs twice, two sets share at most one piece of boundary, and the merged mesh is a triangulation of
///   the fine surface. (Edges of the fine mesh itself may belong to several patches.)
/// - *Merged to fine.* Each merged triangle is certified to be near the fine mesh (distance_certificate.h).
///   The fine mesh does not change, so this proof remains valid as long as the triangle stays.
/// - *Fine to merged.* Each fine triangle is certified to be near the merged mesh, or is covered by a merged
///   triangle whose certificate visited it (class Above). If its sets have no triangle left, they fail. Such
///   a proof rests on merged triangles with a corner in one of the fine triangle's sets, or (kFar) in a set
///   next to one of those; forget_covered() finds all of them when a set changes. A proof that rests on
///   other triangles is not stored, and is repeated in each round.
/// - *Self-intersection.* All pairs of merged triangles of which one is new are tested exactly.
/// - *Orientation.* The signed volume of each shell keeps its sign (shell_volumes.h).
///
/// In the final round no test fails, and none is omitted. The loop ends: each failure splits a set, and the
/// fully split forest is the fine mesh, which passes all tests. Threads only set flags of unproven sets, and
/// one thread splits these sets, so the result does not depend on the thread schedule.
class MergeProof {
 public:
  /// @param forest whose sets are split; between calls others may join some, and settle() it; must outlive
  ///   this
  /// @param fine the fine mesh; must outlive this
  /// @param tolerance by vertex of `fine`, voxels; not copied, and empty only if prove() is never called
  /// @param context for cancellation
  /// @param pieces of each triangle of `fine`, as for ShellVolumes; read by the constructor only
  MergeProof(MergeForest& forest, const FineMesh& fine, std::span<const float> tolerance, RunContext& context,
             std::span<const TrianglePieces> pieces = {});

  /// Splits sets until no directed edge occurs twice, and returns the mesh. As sets are discs, it has the
  /// topology of the fine one, except for components without any triangle left, which only prove() restores.
  /// Distances and self-intersections are not tested. @throws Cancelled
  const MergedMesh& sort_out() { return run(false); }
  /// Splits sets until the merged mesh is proved, and returns it: it has the topology of the fine one, no two
  /// triangles intersect except in shared corners and edges, each mesh is within the tolerance and
  /// kDistanceSlack of the other (certified_decimation.h), and each shell faces outwards or inwards as in the
  /// fine mesh (shell_volumes.h). Of the sets at a triangle that fails, the one joined last is split, and
  /// moves before any other; after three rounds of splits all sets at it are split at once. sort_out() need
  /// not have been called. @throws Cancelled
  const MergedMesh& prove() { return run(true); }

  const MergedMesh& merged() const { return merged_; }
  /// Returns flags by vertex of the fine mesh: 1 for the leaders of all parts of sets that were split in the
  /// last call of sort_out() or prove(), including parts that existed before. The next call overwrites them.
  std::span<const std::uint8_t> brought_back() const { return brought_back_; }

 private:
  using Places = std::array<OverTriangle::Place, 3>;
  /// Known facts on a fine triangle, as bits.
  enum Proof : std::uint8_t {
    kStays = 1,    ///< it is a triangle of the merged mesh
    kNear = 2,     ///< the merged triangle is near the fine mesh
    kApart = 4,    ///< tested against all other triangles; it intersects none, or waits for a split
    kCovered = 8,  ///< the fine triangle is near the merged mesh
    kFar = 16,     ///< kCovered also rests on a merged triangle with no corner in the fine triangle's sets
    kOpen = 32     ///< the fine triangle is in `open_`
  };
  class Above;

  const MergedMesh& run(bool geometry);
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
  void check_topology();
  void check_merged();
  void check_fine();
  void check_contacts();
  void check_signs();
  bool few_are_unproven() const;
  bool split();
  void forget_covered(const std::vector<std::uint32_t>& changed);
  void forget_covered(std::uint32_t p, Proof which);
  std::uint8_t proofs_of(std::uint32_t t);
  void mark_proved(std::uint32_t t, Proof what);

  MergeForest& forest_;
  const FineMesh& fine_;
  const std::span<const float> tolerance_;
  RunContext& context_;
  const ShellVolumes shells_;
  std::vector<std::uint8_t> proofs_;    ///< of each fine triangle
  std::vector<std::uint8_t> unproven_;  ///< by node of the forest: 1 for sets to be split
  std::vector<std::uint32_t> open_;     ///< fine triangles that are not proved to be covered
  std::vector<std::uint8_t> brought_back_;
  double one_bound_ = 0;      ///< bound() of every fine triangle, or 0 where tolerances differ
  std::size_t known_ = 0;     ///< nodes of the forest in the last call; later ones are new
  bool any_covered_ = false;  ///< true if anything was proved to be covered
  int splits_ = 0;            ///< rounds of splits in this call
  MergedMesh merged_;
  tbb::enumerable_thread_specific<TriangleOverlay> overlays_;
};

}  // namespace hermesh
