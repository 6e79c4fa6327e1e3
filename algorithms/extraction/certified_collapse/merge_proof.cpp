#include "algorithms/extraction/certified_collapse/merge_proof.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <utility>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_collapse/distance_certificate.h"
#include "algorithms/extraction/contact/triangle_grid.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kNone = MergeForest::kNone;
/// What the bound is at least, in voxels: what rounding makes of the distance of a triangle to itself.
constexpr double kRounding = 1e-6;

/// What is known of a fine triangle, as bits.
enum Proof : std::uint8_t {
  kStays = 1,    ///< it is a triangle of the merged mesh
  kNear = 2,     ///< the merged triangle is near the fine mesh
  kApart = 4,    ///< the merged triangle meets no other one that is marked so
  kCovered = 8,  ///< the fine triangle is near the merged mesh
  kFar = 16,     ///< the proof of kCovered looked at a merged triangle that has none of its sets for a corner
  kOpen = 32     ///< it waits for the proof of kCovered
};

/// Sets to be split are few if there is one in so many merged triangles.
constexpr std::size_t kFew = 512;

/// After so many rounds of splits all sets of what fails are split, and not only the worst.
constexpr int kPatience = 8;

/// Splits sets of a forest until the merged mesh is proved. What was proved of a triangle is kept until a set near it
/// is split. Sets are called unproven from many threads, by bits that are only ever set, and split by one: so the outcome
/// does not depend on threads.
class MergeProof {
 public:
  MergeProof(MergeForest& forest, std::size_t proved, const FineMesh& fine, std::span<const float> tolerance,
             RunContext& context)
      : forest_(forest),
        proved_(proved),
        fine_(fine),
        tolerance_(tolerance),
        context_(context),
        proofs_(fine.triangles().size()),
        unproven_(forest.size()),
        overlays_([&fine] { return TriangleOverlay(fine.triangles().size()); }) {
    parallel_blocks(proofs_.size(), context_, [&](std::size_t i) {
      const auto t = static_cast<std::uint32_t>(i);
      if (fine_.triangles()[t][0] != FineMesh::kNone) proofs_[t] = stays(t) ? kStays | kOpen : kOpen;
    });
    open_.reserve(proofs_.size());
    for (std::uint32_t t = 0; t < proofs_.size(); ++t) {
      if (proofs_[t] & kOpen) open_.push_back(t);
      if (proofs_[t] & kStays) merged_.origin.push_back(t);
    }
    build();
  }

  /// Looks and splits until nothing fails; `geometry` asks for more than the topology. The tests that cost least come
  /// first, and the next ones once these have little left to say. The mesh returned has passed all tests in one round:
  /// where none calls a set unproven, none is left out.
  MergedMesh run(bool geometry) {
    do {
      look_at_topology();
      if (geometry) look_at_merged();
      if (geometry && few_are_unproven()) look_at_fine();
      if (geometry && few_are_unproven()) look_at_contacts();
    } while (split());
    return std::move(merged_);
  }

 private:
  bool stays(std::uint32_t t) const {
    const Triangle& c = fine_.triangles()[t];
    const std::uint32_t p = forest_.leader(c[0]), q = forest_.leader(c[1]), r = forest_.leader(c[2]);
    return p != q && q != r && r != p;
  }
  bool is_single(std::uint32_t t) const {
    const Triangle& c = fine_.triangles()[t];
    return forest_.set_of(c[0]) == kNone && forest_.set_of(c[1]) == kNone && forest_.set_of(c[2]) == kNone;
  }
  std::uint32_t merged_point(std::uint32_t p) const { return merged_.number[forest_.leader(p)]; }

  /// Makes the merged mesh. Its points are numbered in the order of the fine ones that they go by.
  void build() {
    merged_.number.assign(fine_.points().size(), kNone);
    const auto for_each_corner = [&](auto&& f) {
      parallel_blocks(merged_.origin.size(), context_, [&](std::size_t i) {
        const Triangle& fine = fine_.triangles()[merged_.origin[i]];
        for (int corner = 0; corner < 3; ++corner) f(i, corner, forest_.leader(fine[corner]));
      });
    };
    for_each_corner([&](std::size_t, int, std::uint32_t leader) {
      // Several triangles have one leader, and all of them write the same.
      std::atomic_ref(merged_.number[leader]).store(0, std::memory_order_relaxed);
    });
    merged_.leaders.clear();
    for (std::uint32_t p = 0; p < merged_.number.size(); ++p) {
      if (merged_.number[p] == kNone) continue;
      merged_.number[p] = static_cast<std::uint32_t>(merged_.leaders.size());
      merged_.leaders.push_back(p);
    }
    std::vector<Vector3d> points(merged_.leaders.size());
    parallel_blocks(points.size(), context_, [&](std::size_t i) {
      const std::uint32_t set = forest_.set_of(merged_.leaders[i]);
      points[i] = set == kNone ? fine_.points()[merged_.leaders[i]] : forest_.node(set).place;
    });
    std::vector<Triangle> triangles(merged_.origin.size());
    for_each_corner([&](std::size_t i, int corner, std::uint32_t leader) { triangles[i][corner] = merged_.number[leader]; });
    merged_.mesh.emplace(std::move(points), std::move(triangles));
  }

  /// Calls one set at a fine triangle's corners unproven: the one with the largest error, among the new ones if there are
  /// any, for without them the mesh is what was proved before.
  void call_unproven(std::uint32_t t) {
    std::array<std::uint32_t, 3> sets;
    int count = 0;
    bool any_new = false;
    for (const std::uint32_t p : fine_.triangles()[t])
      if (const std::uint32_t set = forest_.set_of(p); set != kNone) {
        sets[count++] = set;
        any_new = any_new || set >= proved_;
      }
    std::uint32_t worst = kNone;
    for (int i = 0; i < count; ++i) {
      if (any_new && sets[i] < proved_) continue;
      if (splits_ >= kPatience) std::atomic_ref(unproven_[sets[i]]).store(1, std::memory_order_relaxed);
      const float error = forest_.node(sets[i]).error, most = worst == kNone ? 0.0f : forest_.node(worst).error;
      // Ties by number; the first one if its error is no number. So there always is a worst set, and the proof goes on.
      if (worst == kNone || error > most || (error == most && sets[i] > worst)) worst = sets[i];
    }
    if (worst != kNone) std::atomic_ref(unproven_[worst]).store(1, std::memory_order_relaxed);
  }

  /// Calls sets unproven where an edge goes from one point to another twice. Every set is a disc: a block's by its Euler
  /// characteristic, two that an edge joined by the link condition. Two sets share one piece of border at most if there
  /// is no such edge; then the merged mesh is a triangulation of the same surface. (Edges of the fine mesh itself may
  /// be those of several patches.)
  void look_at_topology() {
    const FineMesh& mesh = *merged_.mesh;
    const auto is_set = [&](std::uint32_t p) { return forest_.set_of(merged_.leaders[p]) != kNone; };
    parallel_blocks(mesh.points().size(), context_, [&](std::size_t p) {
      const auto point = static_cast<std::uint32_t>(p);
      const auto around = mesh.around(point);
      for (std::size_t i = 0; i < around.size(); ++i)
        for (std::size_t j = i + 1; j < around.size(); ++j) {
          const std::uint32_t next = mesh.next(around[i], point);
          if (next != mesh.next(around[j], point) || (!is_set(point) && !is_set(next))) continue;
          call_unproven(merged_.origin[around[i]]);
          call_unproven(merged_.origin[around[j]]);
        }
    });
  }

  /// How near the other mesh has to be to a fine triangle, voxels: the least tolerance of its corners.
  double bound(std::uint32_t fine_triangle) const {
    const Triangle& c = fine_.triangles()[fine_triangle];
    return std::max(kRounding, double(std::min({tolerance_[c[0]], tolerance_[c[1]], tolerance_[c[2]]})));
  }

  /// Proves that merged triangles are near the fine mesh. That mesh does not change, so neither does the proof. Many
  /// fine triangles turn out to lie right above or below a merged one, and are covered by it.
  void look_at_merged() {
    parallel_blocks(merged_.origin.size(), context_, [&](std::size_t i) {
      const std::uint32_t t = merged_.origin[i];
      if (proofs_of(t) & kNear) return;
      const auto covered = [&](std::uint32_t f) {
        if (touches(static_cast<std::uint32_t>(i), merged_points(f))) prove(f, kCovered);
      };
      // A triangle that stays as it was is near itself.
      if (is_single(t) || DistanceCertificate(fine_, overlays_.local())
                              .holds(merged_.mesh->corners(static_cast<std::uint32_t>(i)), t,
                                     [&](std::uint32_t f) { return bound(f); }, covered))
        prove(t, kNear);
      else
        call_unproven(t);
    });
  }

  std::array<std::uint32_t, 3> merged_points(std::uint32_t t) const {
    const Triangle& c = fine_.triangles()[t];
    return {merged_point(c[0]), merged_point(c[1]), merged_point(c[2])};
  }
  bool touches(std::uint32_t face, const std::array<std::uint32_t, 3>& points) const {
    for (const std::uint32_t p : merged_.mesh->triangles()[face])
      if (p == points[0] || p == points[1] || p == points[2]) return true;
    return false;
  }
  /// Whether a corner of the face is one of the points or next to one.
  bool is_known(std::uint32_t face, const std::array<std::uint32_t, 3>& points) const {
    if (touches(face, points)) return true;
    for (const std::uint32_t p : merged_.mesh->triangles()[face])
      for (const std::uint32_t t : merged_.mesh->around(p))
        if (touches(t, points)) return true;
    return false;
  }

  /// Proves that fine triangles are near the merged mesh.
  void look_at_fine() {
    const FineMesh& mesh = *merged_.mesh;
    parallel_blocks(open_.size(), context_, [&](std::size_t i) {
      const std::uint32_t t = open_[i];
      if (proofs_of(t) & kCovered) return;
      if (is_single(t)) return prove(t, kCovered);
      const std::array<std::uint32_t, 3> points = merged_points(t);
      // Not from a single point, which may be one of other patches too.
      int in_set = 0;
      while (forest_.set_of(fine_.triangles()[t][in_set]) == kNone) ++in_set;
      if (points[in_set] == kNone) return call_unproven(t);  // all that hangs together here has vanished
      // The proof is kept only if it rests on triangles that forget_covered() finds again when one of them changes.
      bool known = true;
      const double within = bound(t);
      bool touched = true;
      const auto hear = [&](std::uint32_t face) {
        if (touches(face, points)) return within;
        touched = false;
        known = known && is_known(face, points);
        return within;
      };
      if (!DistanceCertificate(mesh, overlays_.local())
               .holds(fine_.corners(t), mesh.around(points[in_set]).front(), hear, [](std::uint32_t) {}))
        call_unproven(t);
      else if (known)
        prove(t, touched ? kCovered : Proof(kCovered | kFar));
    });
    std::erase_if(open_, [&](std::uint32_t t) {
      const bool done = proofs_[t] & kCovered;
      if (done) proofs_[t] &= static_cast<std::uint8_t>(~kOpen);
      return done;
    });
  }

  // Several merged triangles may cover one fine triangle.
  std::uint8_t proofs_of(std::uint32_t t) { return std::atomic_ref(proofs_[t]).load(std::memory_order_relaxed); }
  void prove(std::uint32_t t, Proof what) { std::atomic_ref(proofs_[t]).fetch_or(what, std::memory_order_relaxed); }

  /// Tests pairs of merged triangles of which one has changed.
  void look_at_contacts() {
    const FineMesh& mesh = *merged_.mesh;
    const std::size_t n = mesh.triangles().size();
    std::vector<Box3> boxes(n);
    for (std::uint32_t t = 0; t < n; ++t)
      for (const Vector3d& p : mesh.corners(t)) boxes[t].add(p);
    const TriangleGrid grid(boxes);
    const auto is_new = [&](std::uint32_t t) { return !(proofs_[merged_.origin[t]] & kApart); };
    parallel_blocks(n, context_, [&](std::size_t i) {
      const auto t = static_cast<std::uint32_t>(i);
      // Of two triangles of different levels the smaller one asks; of one level a new one, of two new ones the first.
      grid.visit(t, grid.level(t) + !is_new(t), [&](std::uint32_t u) {
        const bool asks = grid.level(u) > grid.level(t) ? is_new(t) || is_new(u) : !is_new(u) || t < u;
        if (u == t || !asks || !boxes[t].overlaps(boxes[u])) return;
        if (certainly_apart(mesh.triangles()[t], mesh.triangles()[u], mesh.points())) return;
        call_unproven(merged_.origin[t]);
        call_unproven(merged_.origin[u]);
      });
    });
    // Those that did meet have an unproven set, and lose the mark when it is split.
    for (const std::uint32_t t : merged_.origin) proofs_[t] |= kApart;
  }

  /// Whether so few sets are to be split that the other tests can be had in the same round, and not one after a split
  /// for every handful.
  bool few_are_unproven() const {
    return kFew * static_cast<std::size_t>(std::ranges::count(unproven_, 1)) <= merged_.origin.size();
  }

  std::vector<std::uint32_t> unproven_sets() const {
    std::vector<std::uint32_t> sets;
    for (std::uint32_t s = 0; s < unproven_.size(); ++s)
      if (unproven_[s]) sets.push_back(s);
    return sets;
  }

  /// Splits the unproven sets and makes the mesh anew; false if there is nothing to split. A merged triangle stays when its
  /// sets become smaller, and others come anew.
  bool split() {
    const std::vector<std::uint32_t> sets = unproven_sets();
    if (sets.empty()) return false;
    ++splits_;
    std::vector<std::uint32_t> changed;
    for (const std::uint32_t set : sets) {
      unproven_[set] = 0;
      forest_.split(set);
      const auto members = forest_.members(set);
      changed.insert(changed.end(), members.begin(), members.end());
    }
    const std::size_t stayed = merged_.origin.size();
    for (const std::uint32_t p : changed)
      for (const std::uint32_t t : fine_.around(p)) {
        // A triangle with a corner in a set that was split may have moved: only that it stays, and what
        // forget_covered() looks after, is kept.
        const bool new_one = !(proofs_[t] & kStays) && stays(t);
        if (new_one) merged_.origin.push_back(t);
        proofs_[t] = (proofs_[t] & (kStays | kCovered | kFar | kOpen)) | (new_one ? kStays : 0);
      }
    std::sort(merged_.origin.begin() + static_cast<std::ptrdiff_t>(stayed), merged_.origin.end());
    std::inplace_merge(merged_.origin.begin(), merged_.origin.begin() + static_cast<std::ptrdiff_t>(stayed),
                       merged_.origin.end());
    build();
    forget_covered(changed);
    return true;
  }

  /// Takes back the proofs of fine triangles that may rest on merged triangles that have changed. Such a proof rests on
  /// merged triangles that have one of the fine triangle's sets for a corner, or (kFar) a set next to one of those. If
  /// such a triangle changes, one of its corners was split; its other corners are next to a part of that. (A proof that
  /// rests on others yet is never marked, and so asked for again each time.)
  void forget_covered(const std::vector<std::uint32_t>& changed) {
    const FineMesh& mesh = *merged_.mesh;
    std::vector<std::uint8_t> found(mesh.points().size());
    std::vector<std::uint32_t> points;
    const auto add = [&](std::uint32_t p) {
      if (p != kNone && !std::exchange(found[p], 1)) points.push_back(p);
    };
    for (const std::uint32_t p : changed)
      for (const std::uint32_t t : fine_.around(p))
        for (const std::uint32_t q : fine_.triangles()[t]) add(merged_point(q));
    const std::size_t next_to_them = points.size();
    for (std::size_t i = 0; i < next_to_them; ++i)
      for (const std::uint32_t t : mesh.around(points[i]))
        for (const std::uint32_t q : mesh.triangles()[t]) add(q);
    for (const std::uint32_t p : changed) forget_covered(p, kCovered);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::uint32_t leader = merged_.leaders[points[i]], set = forest_.set_of(leader);
      const Proof which = i < next_to_them ? kCovered : kFar;
      if (set == kNone) forget_covered(leader, which);
      else for (const std::uint32_t p : forest_.members(set)) forget_covered(p, which);
    }
  }
  void forget_covered(std::uint32_t p, Proof which) {
    for (const std::uint32_t t : fine_.around(p)) {
      if (!(proofs_[t] & which)) continue;
      if (!(proofs_[t] & kOpen)) open_.push_back(t);
      proofs_[t] = static_cast<std::uint8_t>((proofs_[t] & ~(kCovered | kFar)) | kOpen);
    }
  }

  MergeForest& forest_;
  const std::size_t proved_;  ///< sets that were proved before
  const FineMesh& fine_;
  const std::span<const float> tolerance_;
  RunContext& context_;
  std::vector<std::uint8_t> proofs_;
  std::vector<std::uint8_t> unproven_;   ///< sets to be split
  std::vector<std::uint32_t> open_;  ///< fine triangles that are not proved to be covered
  int splits_ = 0;
  MergedMesh merged_;
  tbb::enumerable_thread_specific<TriangleOverlay> overlays_;
};

}  // namespace

MergedMesh prove_merges(MergeForest& forest, const FineMesh& fine, std::span<const float> tolerance, RunContext& context,
                        std::size_t proved) {
  return MergeProof(forest, proved, fine, tolerance, context).run(true);
}

MergedMesh sort_out_merges(MergeForest& forest, const FineMesh& fine, RunContext& context) {
  return MergeProof(forest, 0, fine, {}, context).run(false);
}

}  // namespace hermesh
