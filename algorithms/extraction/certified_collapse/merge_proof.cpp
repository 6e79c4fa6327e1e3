#include "algorithms/extraction/certified_collapse/merge_proof.h"

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

/// Least bound, voxels: rounding of the distance of a triangle to itself.
constexpr double kLeastBound = 1e-6;

/// Sets to be split are few if there is at most one for this many merged triangles.
constexpr std::size_t kFew = 512;

/// Rounds of splits after which all sets at a failure are split, and not only the last one joined.
constexpr int kPatience = 3;

}  // namespace

MergeProof::MergeProof(MergeForest& forest, const FineMesh& fine, std::span<const float> tolerance,
                       RunContext& context, std::span<const TrianglePieces> pieces)
    : forest_(forest),
      fine_(fine),
      tolerance_(tolerance),
      context_(context),
      shells_(fine, pieces),
      proofs_(fine.triangles().size()),
      brought_back_(fine.points().size()),
      overlays_([&fine] { return TriangleOverlay(fine.triangles().size()); }) {
  if (const auto [least, most] = std::ranges::minmax_element(tolerance_);
      least != tolerance_.end() && *least == *most)
    one_bound_ = std::max(kLeastBound, double(*least));
  // As if nothing were merged yet: all sets are joins not known so far.
  parallel_blocks(proofs_.size(), context_, [&](std::size_t t) {
    if (fine_.triangles()[t][0] != FineMesh::kNone) proofs_[t] = kStays | kOpen;
  });
  for (std::uint32_t t = 0; t < proofs_.size(); ++t)
    if (proofs_[t] & kOpen) open_.push_back(t);
  merged_.origin = open_;
}

/// Tests and splits until nothing fails; `geometry` includes the tests beyond the topology. Cheap tests come
/// first, and the others once few of their failures are left; if none fails, none is omitted.
const MergedMesh& MergeProof::run(bool geometry) {
  take_in_joins();
  splits_ = 0;
  do {
    check_topology();
    if (geometry) check_merged();
    // In the same round only if few sets are to be split, and not once per handful of splits.
    if (geometry && few_are_unproven()) check_fine();
    if (geometry && few_are_unproven()) check_contacts();
    if (geometry && few_are_unproven()) check_signs();
  } while (split());
  return merged_;
}

/// Rebuilds the mesh with the sets joined since the last call, and invalidates the proofs near these.
void MergeProof::take_in_joins() {
  std::fill(brought_back_.begin(), brought_back_.end(), 0);
  const std::size_t known = std::exchange(known_, forest_.size());
  unproven_.assign(known_, 0);
  const auto is_new = [&](std::uint32_t p) {
    return forest_.set_of(p) != MergeForest::kNone && forest_.set_of(p) >= known;
  };
  parallel_blocks(proofs_.size(), context_, [&](std::size_t i) {
    const auto t = static_cast<std::uint32_t>(i);
    const Triangle& c = fine_.triangles()[t];
    if (c[0] == FineMesh::kNone || !(is_new(c[0]) || is_new(c[1]) || is_new(c[2]))) return;
    proofs_[t] = (proofs_[t] & (kCovered | kFar | kOpen)) | (stays(t) ? kStays : 0);
  });
  std::erase_if(merged_.origin, [&](std::uint32_t t) { return !(proofs_[t] & kStays); });
  merged_.origin.shrink_to_fit();  // of the first call, which begins with all triangles
  build();
  if (!any_covered_) return;
  std::vector<std::uint32_t> changed;
  for (auto set = static_cast<std::uint32_t>(known); set < known_; ++set)
    if (forest_.set_of(forest_.node(set).first) == set) {
      const auto members = forest_.members(set);
      changed.insert(changed.end(), members.begin(), members.end());
    }
  forget_covered(changed);
}

bool MergeProof::stays(std::uint32_t t) const {
  const Triangle& c = fine_.triangles()[t];
  const std::uint32_t p = forest_.leader(c[0]), q = forest_.leader(c[1]), r = forest_.leader(c[2]);
  return p != q && q != r && r != p;
}

bool MergeProof::is_single(std::uint32_t t) const {
  const Triangle& c = fine_.triangles()[t];
  return forest_.set_of(c[0]) == MergeForest::kNone && forest_.set_of(c[1]) == MergeForest::kNone &&
         forest_.set_of(c[2]) == MergeForest::kNone;
}

/// Builds the merged mesh. Its vertices are in the order of the fine ones that represent them.
void MergeProof::build() {
  merged_.number.assign(fine_.points().size(), MergeForest::kNone);
  merged_.mesh.reset();
  std::vector<Triangle> triangles(merged_.origin.size());  // of leaders first
  parallel_blocks(triangles.size(), context_, [&](std::size_t i) {
    const Triangle& fine = fine_.triangles()[merged_.origin[i]];
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t leader = triangles[i][corner] = forest_.leader(fine[corner]);
      // Several triangles share a leader, and all write the same value.
      std::atomic_ref(merged_.number[leader]).store(0, std::memory_order_relaxed);
    }
  });
  merged_.leaders.clear();
  for (std::uint32_t p = 0; p < merged_.number.size(); ++p) {
    if (merged_.number[p] == MergeForest::kNone) continue;
    merged_.number[p] = static_cast<std::uint32_t>(merged_.leaders.size());
    merged_.leaders.push_back(p);
  }
  std::vector<Vector3d> points(merged_.leaders.size());
  parallel_blocks(points.size(), context_, [&](std::size_t i) {
    const std::uint32_t set = forest_.set_of(merged_.leaders[i]);
    points[i] = set == MergeForest::kNone ? fine_.points()[merged_.leaders[i]] : forest_.node(set).place;
  });
  parallel_blocks(triangles.size(), context_, [&](std::size_t i) {
    for (std::uint32_t& p : triangles[i]) p = merged_.number[p];
  });
  merged_.mesh.emplace(std::move(points), std::move(triangles));
}

/// Marks as unproven the set at a fine triangle's corners that was joined last: the merged triangle before
/// that join most likely was good. (The fandisk at 400 voxels gets 4 % fewer triangles than if the set with
/// the largest error is split, scans as many.) Moves are undone before any other set.
void MergeProof::call_unproven(std::uint32_t t) {
  const auto moves = [&](std::uint32_t p) {
    const std::uint32_t set = forest_.set_of(p);
    return set != MergeForest::kNone && forest_.node(set).moves;
  };
  const bool any_moves = std::ranges::any_of(fine_.triangles()[t], moves);
  std::uint32_t last = MergeForest::kNone;
  for (const std::uint32_t p : fine_.triangles()[t]) {
    const std::uint32_t set = forest_.set_of(p);
    if (set == MergeForest::kNone || (any_moves && !moves(p))) continue;
    if (splits_ >= kPatience) std::atomic_ref(unproven_[set]).store(1, std::memory_order_relaxed);
    if (last == MergeForest::kNone || set > last) last = set;
  }
  if (last != MergeForest::kNone) std::atomic_ref(unproven_[last]).store(1, std::memory_order_relaxed);
}

/// Marks sets as unproven at directed edges that occur twice.
void MergeProof::check_topology() {
  const FineMesh& mesh = *merged_.mesh;
  const auto is_set = [&](std::uint32_t p) {
    return forest_.set_of(merged_.leaders[p]) != MergeForest::kNone;
  };
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

/// Returns the largest distance of the other mesh from a fine triangle, voxels: the least tolerance of its
/// corners.
double MergeProof::bound(std::uint32_t fine_triangle) const {
  if (one_bound_ > 0) return one_bound_;
  const Triangle& c = fine_.triangles()[fine_triangle];
  return std::max(kLeastBound, double(std::min({tolerance_[c[0]], tolerance_[c[1]], tolerance_[c[2]]})));
}

/// Proves that fine triangles over a merged triangle are near it.
///
/// **Why it holds.** The part of a fine triangle over the merged triangle is within the bound
/// (TriangleOverlay::is_near()), so all of it is if it lies over that completely. If it reaches across one
/// side only, it is cut in two there: where its edges pass over the side they are within the bound of that,
/// because they are over the merged triangle. The side also belongs to the merged triangle beyond it; so if
/// the corners beyond are within the bound of that one, the part beyond is, because the distance to a
/// triangle is convex.
class MergeProof::Above {
 public:
  Above(MergeProof& proof, std::uint32_t face) : proof_(proof), face_(face) {}

  /// Called for each fine triangle that is_near() visits, with its corners seen from the merged triangle.
  void operator()(std::uint32_t fine_triangle, const Places& places) {
    if (proof_.proofs_of(fine_triangle) & kCovered) return;
    int out = -1;
    for (int side = 0; side < 3; ++side) {
      if (places[0][side] <= 0 && places[1][side] <= 0 && places[2][side] <= 0) continue;
      if (out >= 0) return;
      out = side;
    }
    // Only proofs that forget_covered() finds are reused.
    const std::array<std::uint32_t, 3> leaders = proof_.leaders(fine_triangle);
    if (!proof_.touches(face_, leaders) || (out >= 0 && !is_near_beyond(fine_triangle, places, out, leaders)))
      return;
    proof_.mark_proved(fine_triangle, kCovered);
  }

 private:
  bool is_near_beyond(std::uint32_t fine_triangle, const Places& places, int side,
                      const std::array<std::uint32_t, 3>& leaders) {
    const FineMesh& mesh = *proof_.merged_.mesh;
    const std::uint32_t next = mesh.across(face_, side);
    if (next == FineMesh::kNone || !proof_.touches(next, leaders)) return false;
    if (!beyond_[side]) beyond_[side].emplace(mesh.corners(next));
    const double within = proof_.bound(fine_triangle);
    const Corners corners = proof_.fine_.corners(fine_triangle);
    for (int i = 0; i < 3; ++i)
      if (places[i][side] > 0 && !beyond_[side]->near(corners[i], within)) return false;
    return true;
  }

  MergeProof& proof_;
  const std::uint32_t face_;                            ///< of the merged mesh
  std::array<std::optional<TriangleReach>, 3> beyond_;  ///< the merged triangles across its sides, on demand
};

/// Proves that merged triangles are near the fine mesh, and on the way that most fine triangles are covered.
void MergeProof::check_merged() {
  any_covered_ = true;
  parallel_blocks(merged_.origin.size(), context_, [&](std::size_t i) {
    const std::uint32_t t = merged_.origin[i];
    if (proofs_of(t) & kNear) return;
    const auto face = static_cast<std::uint32_t>(i);
    // An unchanged triangle is near itself.
    if (is_single(t) || DistanceCertificate(fine_, overlays_.local())
                            .holds(
                                merged_.mesh->corners(face), t, [&](std::uint32_t f) { return bound(f); },
                                Above(*this, face)))
      mark_proved(t, kNear);
    else
      call_unproven(t);
  });
}

/// Returns the leaders of a fine triangle's corners.
std::array<std::uint32_t, 3> MergeProof::leaders(std::uint32_t t) const {
  const Triangle& c = fine_.triangles()[t];
  return {forest_.leader(c[0]), forest_.leader(c[1]), forest_.leader(c[2])};
}
/// Returns true if a corner of the face has one of the leaders.
bool MergeProof::touches(std::uint32_t face, const std::array<std::uint32_t, 3>& leaders) const {
  for (const std::uint32_t p : merged_.mesh->triangles()[face]) {
    const std::uint32_t leader = merged_.leaders[p];
    if (leader == leaders[0] || leader == leaders[1] || leader == leaders[2]) return true;
  }
  return false;
}
/// Returns true if a corner of the face has one of the leaders or is adjacent to one that does.
bool MergeProof::is_known(std::uint32_t face, const std::array<std::uint32_t, 3>& leaders) const {
  if (touches(face, leaders)) return true;
  for (const std::uint32_t p : merged_.mesh->triangles()[face])
    for (const std::uint32_t t : merged_.mesh->around(p))
      if (touches(t, leaders)) return true;
  return false;
}

/// Proves that fine triangles are near the merged mesh.
void MergeProof::check_fine() {
  const FineMesh& mesh = *merged_.mesh;
  parallel_blocks(open_.size(), context_, [&](std::size_t i) {
    const std::uint32_t t = open_[i];
    if (proofs_of(t) & kCovered) return;
    if (is_single(t)) return mark_proved(t, kCovered);
    const std::array<std::uint32_t, 3> leaders = this->leaders(t);
    // Not from a single vertex, which may belong to other patches too.
    int in_set = 0;
    while (forest_.set_of(fine_.triangles()[t][in_set]) == MergeForest::kNone) ++in_set;
    const std::uint32_t point = merged_.number[leaders[in_set]];
    if (point == MergeForest::kNone) return call_unproven(t);  // the component has vanished
    bool known = true, touched = true;  // true if forget_covered() finds all faces, and as kCovered
    const double within = bound(t);
    const auto bound_of = [&](std::uint32_t face) {
      if (touches(face, leaders)) return within;
      touched = false;
      known = known && is_known(face, leaders);
      return within;
    };
    if (!DistanceCertificate(mesh, overlays_.local())
             .holds(fine_.corners(t), mesh.around(point).front(), bound_of,
                    [](std::uint32_t, const Places&) {}))
      call_unproven(t);
    else if (known)
      mark_proved(t, touched ? kCovered : Proof(kCovered | kFar));
  });
  std::erase_if(open_, [&](std::uint32_t t) {
    const bool done = proofs_[t] & kCovered;
    if (done) proofs_[t] &= static_cast<std::uint8_t>(~kOpen);
    return done;
  });
}

// Atomic, because several merged triangles may cover one fine triangle.
std::uint8_t MergeProof::proofs_of(std::uint32_t t) {
  return std::atomic_ref(proofs_[t]).load(std::memory_order_relaxed);
}
void MergeProof::mark_proved(std::uint32_t t, Proof what) {
  std::atomic_ref(proofs_[t]).fetch_or(what, std::memory_order_relaxed);
}

/// Tests pairs of merged triangles of which one has changed.
void MergeProof::check_contacts() {
  const FineMesh& mesh = *merged_.mesh;
  const std::size_t n = mesh.triangles().size();
  std::vector<Bounds> boxes(n);
  for (std::uint32_t t = 0; t < n; ++t)
    for (const Vector3d& p : mesh.corners(t)) boxes[t].add(p);
  const TriangleGrid grid(boxes);
  const auto is_new = [&](std::uint32_t t) { return !(proofs_[merged_.origin[t]] & kApart); };
  parallel_blocks(n, context_, [&](std::size_t i) {
    const auto t = static_cast<std::uint32_t>(i);
    // Each pair once: from the triangle of the smaller level; at equal levels from a new one, of two new ones
    // from the first.
    grid.visit(t, grid.level(t) + !is_new(t), [&](std::uint32_t u) {
      const bool tests = grid.level(u) > grid.level(t) ? is_new(t) || is_new(u) : !is_new(u) || t < u;
      if (u == t || !tests || !boxes[t].overlaps(boxes[u])) return;
      if (certainly_apart(mesh.triangles()[t], mesh.triangles()[u], mesh.points())) return;
      call_unproven(merged_.origin[t]);
      call_unproven(merged_.origin[u]);
    });
  });
  // Triangles that intersect have an unproven set, and lose the mark when it is split.
  for (const std::uint32_t t : merged_.origin) proofs_[t] |= kApart;
}

/// Marks sets as unproven in shells that are inside out.
void MergeProof::check_signs() {
  const std::vector<std::uint8_t> reversed =
      shells_.changed(merged_.mesh->points(), merged_.mesh->triangles(), merged_.origin);
  if (std::ranges::find(reversed, 1) == reversed.end()) return;
  for (const std::uint32_t t : merged_.origin)
    if (shells_.is_in(reversed, t)) call_unproven(t);
}

bool MergeProof::few_are_unproven() const {
  return kFew * static_cast<std::size_t>(std::ranges::count(unproven_, 1)) <= merged_.origin.size();
}

/// Splits the unproven sets and rebuilds the mesh; false if there are none. A merged triangle stays when its
/// sets become smaller, and others appear.
bool MergeProof::split() {
  std::vector<std::uint32_t> changed;
  bool any = false;
  for (std::uint32_t set = 0; set < unproven_.size(); ++set) {
    if (!std::exchange(unproven_[set], 0)) continue;
    any = true;
    forest_.split(set);
    const auto members = forest_.members(set);
    changed.insert(changed.end(), members.begin(), members.end());
  }
  if (!any) return false;
  ++splits_;
  const std::size_t stayed = merged_.origin.size();
  for (const std::uint32_t p : changed)
    for (const std::uint32_t t : fine_.around(p)) {
      // A triangle with a corner in a split set may have moved: only that it stays, and the facts that
      // forget_covered() handles, are preserved.
      const bool new_one = !(proofs_[t] & kStays) && stays(t);
      if (new_one) merged_.origin.push_back(t);
      proofs_[t] = (proofs_[t] & (kStays | kCovered | kFar | kOpen)) | (new_one ? kStays : 0);
    }
  std::sort(merged_.origin.begin() + static_cast<std::ptrdiff_t>(stayed), merged_.origin.end());
  std::inplace_merge(merged_.origin.begin(), merged_.origin.begin() + static_cast<std::ptrdiff_t>(stayed),
                     merged_.origin.end());
  for (const std::uint32_t p : changed) brought_back_[forest_.leader(p)] = 1;
  build();
  if (any_covered_) forget_covered(changed);
  return true;
}

/// Invalidates the proofs of fine triangles that may rest on changed merged triangles. If a merged triangle
/// changes, one of its corners was split or joined; its other corners are adjacent to a part of that, or to
/// the set that it is part of now.
void MergeProof::forget_covered(const std::vector<std::uint32_t>& changed) {
  const FineMesh& mesh = *merged_.mesh;
  std::vector<std::uint8_t> found(mesh.points().size());
  std::vector<std::uint32_t> points;
  const auto add = [&](std::uint32_t p) {
    if (p != MergeForest::kNone && !std::exchange(found[p], 1)) points.push_back(p);
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
    if (set == MergeForest::kNone)
      forget_covered(leader, which);
    else
      for (const std::uint32_t p : forest_.members(set)) forget_covered(p, which);
  }
}
void MergeProof::forget_covered(std::uint32_t p, Proof which) {
  for (const std::uint32_t t : fine_.around(p)) {
    if (!(proofs_[t] & which)) continue;
    if (!(proofs_[t] & kOpen)) open_.push_back(t);
    proofs_[t] = static_cast<std::uint8_t>((proofs_[t] & ~(kCovered | kFar)) | kOpen);
  }
}

}  // namespace hermesh
