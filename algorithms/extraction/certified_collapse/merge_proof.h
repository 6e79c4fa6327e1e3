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
#include "algorithms/extraction/certified_collapse/shell_volumes.h"
#include "algorithms/extraction/contact/triangle_overlay.h"

namespace hermesh {

/// The mesh that the merges of a forest make of a fine one: a triangle stays if its corners go into three
/// points, be they sets or single points; the others vanish.
struct MergedMesh {
  std::optional<FineMesh> mesh;  ///< nothing before the first call of sort_out() or prove()
  std::vector<std::uint32_t>
      leaders;  ///< for each of its points the fine one that it goes by (MergeForest::leader())
  std::vector<std::uint32_t> origin;  ///< for each of its triangles the fine one; ascending
  /// For each fine point that a point here goes by, that point; else FineMesh::kNone, as for a leader without
  /// triangles.
  std::vector<std::uint32_t> number;
};

/// Splits sets of a forest until the merged mesh is proved. Who makes and joins sets sees to it that each is
/// a disc, and no two triangles of the fine mesh may meet, for what fails at single points has no set to
/// split. What was proved of a triangle is kept until a set near it is split or joined. Many threads call
/// sets unproven, by flags that they only set, and one thread splits these sets: so the outcome does not
/// depend on threads.
class MergeProof {
 public:
  /// @param forest whose sets are split; between calls others may join some, and settle() it; must outlive
  ///   this
  /// @param fine the fine mesh; must outlive this
  /// @param tolerance by point of `fine`, voxels; not copied, and empty only if prove() is never called
  /// @param context asked whether to stop
  /// @param pieces of each triangle of `fine`, as ShellVolumes takes them; read by the constructor only
  MergeProof(MergeForest& forest, const FineMesh& fine, std::span<const float> tolerance, RunContext& context,
             std::span<const TrianglePieces> pieces = {});

  /// Splits sets until no edge leads from one point to another twice, and returns the mesh. As sets are
  /// discs, it has the topology of the fine one, but for parts of which no triangle is left, which only
  /// prove() brings back. Nothing is promised of distances and contacts. @throws Cancelled
  const MergedMesh& sort_out();
  /// Splits sets until the merged mesh keeps its promises, and returns it: the topology of the fine one, no
  /// two triangles that meet but in shared corners and edges, each mesh within the tolerance and
  /// kDistanceSlack of the other (certified_decimation.h), and each shell facing outwards or inwards as in
  /// the fine mesh (shell_volumes.h). Of the sets at a triangle that fails, the one that was joined last is
  /// split, and moves before any other; after three rounds of splits all that may be to blame are split at
  /// once. sort_out() need not have been called. @throws Cancelled
  const MergedMesh& prove();

  const MergedMesh& merged() const { return merged_; }
  /// Flags by point of the fine mesh: 1 for the leaders of all parts of sets that were split in the last call
  /// of sort_out() or prove(), also for those that were there before. The next call overwrites them.
  std::span<const std::uint8_t> brought_back() const { return brought_back_; }

 private:
  using Places = std::array<OverTriangle::Place, 3>;
  /// What is known of a fine triangle, as bits.
  enum Proof : std::uint8_t {
    kStays = 1,  ///< it is a triangle of the merged mesh
    kNear = 2,   ///< the merged triangle is near the fine mesh
    kApart =
        4,  ///< the merged triangle has been tested against all others; it meets none, or waits for a split
    kCovered = 8,  ///< the fine triangle is near the merged mesh
    kFar = 16,     ///< the proof of kCovered rests on a merged triangle, too, with no corner in the fine
                   ///< triangle's sets
    kOpen = 32     ///< the fine triangle is in `open_`
  };
  /// Takes fine triangles that lie over a merged triangle as proved to be near it, where they are.
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
  void look_at_signs();
  bool few_are_unproven() const;
  std::vector<std::uint32_t> unproven_sets() const;
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
  std::size_t known_ = 0;     ///< how many nodes the forest had in the last call; later ones are new
  bool any_covered_ = false;  ///< whether anything has been proved to be covered
  int splits_ = 0;            ///< rounds of splits in this call
  MergedMesh merged_;
  tbb::enumerable_thread_specific<TriangleOverlay> overlays_;
};

}  // namespace hermesh
