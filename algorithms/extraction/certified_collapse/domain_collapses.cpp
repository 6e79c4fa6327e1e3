#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "algorithms/extraction/certified_collapse/domain_mesh.h"

namespace hermesh {

DomainMesh::DomainMesh(const DecimatedMesh& mesh, const Domain& domain,
                       std::span<const std::uint32_t> triangles, std::vector<std::uint32_t>& local) {
  local.resize(mesh.points.size(), kNone);
  vertices.reserve(triangles.size() / 2 + 64);
  faces.resize(triangles.size());
  next_corner.resize(3 * triangles.size());
  // In the order of the triangles, so local indices do not depend on the thread's earlier domains.
  for (std::uint32_t f = 0; f < faces.size(); ++f) {
    Face& face = faces[f];
    face.global = triangles[f];
    face.own = true;
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t point = mesh.triangles[face.global][i];
      std::uint32_t v = local[point];
      // An entry of another domain refers to no vertex here, or to one of another point.
      if (v >= vertices.size() || vertices[v].global != point) {
        v = local[point] = static_cast<std::uint32_t>(vertices.size());
        const bool here = domain.holds(mesh.points[point]);
        vertices.push_back({.point = mesh.points[point],
                            .global = point,
                            .here = here,
                            .free = here && !mesh.input.pinned[mesh.leaders[point]]});
      }
      face.corners[i] = v;
      face.own = face.own && vertices[v].here;
      next_corner[3 * f + i] = vertices[v].first_corner;
      vertices[v].first_corner = 3 * f + static_cast<std::uint32_t>(i);
    }
    // All triangles of a vertex in the domain are listed, for they touch it. The vertex may move if all of
    // them lie in it: no other domain sees any of them then.
    if (!face.own)
      for (const std::uint32_t v : face.corners) vertices[v].free = false;
  }
}

void DomainMesh::merge_corners(std::uint32_t going, std::uint32_t staying) {
  std::uint32_t kept = kNone;
  for (const std::uint32_t first : {vertices[going].first_corner, vertices[staying].first_corner})
    for (std::uint32_t corner = first, next; corner != kNone; corner = next) {
      next = next_corner[corner];
      if (faces[corner / 3].gone) continue;
      next_corner[corner] = kept;
      kept = corner;
    }
  vertices[staying].first_corner = kept;
}

namespace {

using Eigen::Vector3d;

/// Least shape() of a triangle that a collapse makes, unless it replaces a worse one.
constexpr double kPoorShape = 0.05;
/// A triangle may not rotate by more than about 84 degrees in one collapse.
constexpr double kLeastCosineToOld = 0.1;
/// Largest angle, about 72 degrees, between a triangle of an unverified collapse (Collapses::bold), which
/// tests no distance, and the fine triangle that it originates from. So a triangle that was reversed before
/// can turn back.
constexpr double kLeastCosineToFine = 0.3;
/// Largest mean squared distance of the new vertex to the planes that the ends of an edge represent, in
/// squared tolerances: beyond, the edge is not worth a test. (1 would lose some 4 % of the collapses of a
/// scan, 4 none and save nothing.)
constexpr double kHopeless = 2.0;
/// The same for an unverified collapse, which has no other distance test. (With 0.3 the proof undoes a third
/// of the collapses, with 0.03 nearly all is left to verified collapses, which cost five times as much each.)
constexpr double kBold = 0.12;
/// Rounding of a quadric's sums in squares of distances, as a share of the squared distance between the ends
/// of an edge, and a distance in voxels below which positions are as good as each other.
constexpr double kRounding = 1e-7, kExact = 1e-4;
/// Height of a triangle, in voxels, up to which rounding decides its normal. Where several blocks meet at the
/// corner of a polyhedron, each of them makes a vertex there.
constexpr double kFlat = 1e-5;

/// Returns the shape of a triangle, 1 for equilateral and 0 for degenerate: its area over the sum of its
/// squared sides, scaled.
double shape(const Corners& t) {
  const double twice_area = (t[1] - t[0]).cross(t[2] - t[0]).norm();
  const double squares =
      (t[1] - t[0]).squaredNorm() + (t[2] - t[1]).squaredNorm() + (t[0] - t[2]).squaredNorm();
  return squares > 0 ? 2.0 * std::sqrt(3.0) * twice_area / squares : 0.0;
}

/// Collapses edges of a domain, cheapest first. The heap may contain outdated proposals, which the versions
/// of their ends reveal.
class DomainCollapses {
 public:
  DomainCollapses(DecimatedMesh& mesh, Collapses kind, const Domain& domain,
                  std::span<const std::uint32_t> triangles, std::vector<std::uint32_t>& local)
      : mesh_(mesh),
        kind_(kind),
        domain_(domain),
        local_(mesh, domain, triangles, local),
        distance_(mesh, local_, collapse_) {
    // Collapses prevented by the domain's border are possible in the next round, which has other borders.
    // Of other edges there, those that this round would not test either have failed before.
    for (const DomainMesh::Face& face : local_.faces) {
      if (!is_dirty(face.corners[0]) && !is_dirty(face.corners[1]) && !is_dirty(face.corners[2])) continue;
      for (const std::uint32_t v : face.corners)
        if (at(v).here && !at(v).free) mark_dirty(v);
    }
  }

  std::vector<Join> run(const RunContext& context) {
    for (const DomainMesh::Face& face : local_.faces) {
      if (!face.own || face.gone) continue;
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t u = face.corners[i], v = face.corners[(i + 1) % 3];
        // Each edge between two own faces once. An edge at the border of these may be omitted: both its ends
        // have a face that is not the domain's, and neither may move.
        if (u < v && (is_dirty(u) || is_dirty(v))) propose(u, v);
      }
    }
    for (std::size_t step = 0; !heap_.empty(); ++step) {
      if (step % 256 == 0) context.check();
      std::pop_heap(heap_.begin(), heap_.end());
      const Proposal next = heap_.back();
      heap_.pop_back();
      if (!at(next.u).gone && !at(next.v).gone && at(next.u).version == next.version_u &&
          at(next.v).version == next.version_v)
        try_edge(next.u, next.v);
    }
    return std::move(joins_);
  }

 private:
  struct Proposal {
    float cost;
    std::uint32_t u, v, version_u, version_v;
    /// The order of a heap with the cheapest on top; ties are broken by index, so the order is unique.
    bool operator<(const Proposal& other) const {
      if (cost != other.cost) return cost > other.cost;
      return u != other.u ? u > other.u : v > other.v;
    }
  };
  struct Target {
    Vector3d x;
    double cost;
    bool hopeless;
  };

  const DomainMesh::Vertex& at(std::uint32_t v) const { return local_.vertices[v]; }
  /// Returns true if the edges at a vertex are tested in this round.
  bool is_dirty(std::uint32_t v) const { return mesh_.dirty[at(v).global] != 0; }
  /// Schedules the edges at a vertex for the next round.
  void mark_dirty(std::uint32_t v) { mesh_.dirty_next[at(v).global] = 1; }

  /// Returns the sum of the quadrics of two vertices, about `anchor`.
  WideQuadric quadric_about(std::uint32_t u, std::uint32_t v, const Vector3d& anchor) const {
    WideQuadric sum;
    for (const std::uint32_t w : {u, v}) sum.add(mesh_.quadrics[at(w).global], at(w).point - anchor);
    return sum;
  }

  /// Returns the squared distances to the planes of the faces around two vertices, weighted by area, about
  /// `anchor`.
  WideQuadric quadric_of_faces(std::uint32_t u, std::uint32_t v, const Vector3d& anchor) const {
    WideQuadric sum;
    const auto add = [&](std::uint32_t f) {
      const auto& c = local_.faces[f].corners;
      const Vector3d corner = at(c[0]).point - anchor;
      const Vector3d normal = (at(c[1]).point - at(c[0]).point).cross(at(c[2]).point - at(c[0]).point);
      const double size = normal.norm();
      if (size > 0) sum.add_plane(normal / size, -normal.dot(corner) / size, 0.5 * size);
    };
    local_.for_each_face(u, [&](std::uint32_t f, int) { add(f); });
    // The two faces at the edge are around both ends.
    local_.for_each_face(v, [&](std::uint32_t f, int) {
      const auto& c = local_.faces[f].corners;
      if (c[0] != u && c[1] != u && c[2] != u) add(f);
    });
    return sum;
  }

  /// Returns true if not all planes of a quadric are nearly parallel.
  static bool is_folded(const WideQuadric& q) {
    constexpr double kLeastFold = 1e-5;  // product of two eigenvalues of `a`, of the square of their sum
    const double sum = q.a.trace();
    return sum * sum - q.a.squaredNorm() > 2.0 * kLeastFold * sum * sum;
  }

  /// Returns the position and cost of the merged ends of an edge; an end that may not move stays.
  Target target(std::uint32_t u, std::uint32_t v) const {
    const DomainMesh::Vertex &at_u = at(u), &at_v = at(v);
    const Vector3d middle = 0.5 * (at_u.point + at_v.point);
    const WideQuadric q = quadric_about(u, v, middle);
    const double moment = mesh_.input.moment;
    const WideQuadric cost = moment > 0 ? quadric_of_faces(u, v, middle) : q;
    Vector3d x = !at_u.free   ? Vector3d(at_u.point - middle)
                 : !at_v.free ? Vector3d(at_v.point - middle)
                              : cost.minimiser();
    const double squared = (at_u.point - at_v.point).squaredNorm();
    // Nearly parallel planes meet far away: limited to the length of the edge.
    if (x.squaredNorm() > squared) x *= std::sqrt(squared) / x.norm();
    if (at_u.free && at_v.free && is_folded(q)) {
      // At a crease or corner the minimiser is off by the rounding of the sums and by its pull; an end that
      // is on the planes is exact.
      const Vector3d to_u = at_u.point - middle;
      const double at_ends[2] = {q(to_u), q(-to_u)};
      if (std::min(at_ends[0], at_ends[1]) <= q(x) + (kRounding * squared + kExact * kExact) * q.a.trace())
        x = at_ends[0] <= at_ends[1] ? to_u : Vector3d(-to_u);
    }
    const double tolerance = std::min(mesh_.least_tolerance[at_u.global], mesh_.least_tolerance[at_v.global]);
    const double off = q(x), now = moment > 0 ? cost(x) : off,
                 limit = kind_ == Collapses::bold ? kBold : kHopeless;
    const bool hopeless = off > limit * tolerance * tolerance * q.a.trace() || (moment > 0 && now > moment);
    // Where planes make no difference, as on flat parts, short edges come first.
    return {middle + x, now + kPull * cost.a.trace() * squared, hopeless};
  }

  void propose(std::uint32_t u, std::uint32_t v) {
    if (!at(u).here || !at(v).here || (!at(u).free && !at(v).free)) return;
    if (u > v) std::swap(u, v);
    const Target to = target(u, v);
    if (to.hopeless) return;
    heap_.push_back({static_cast<float>(to.cost), u, v, at(u).version, at(v).version});
    std::push_heap(heap_.begin(), heap_.end());
  }

  void try_edge(std::uint32_t u, std::uint32_t v) {
    if (!at(u).free) std::swap(u, v);  // u goes, v stays
    if (!keeps_topology(u, v)) return;
    // Rounding a vertex again that may not move could move it.
    const bool free = at(v).free;
    if (try_at(u, v, free ? mesh_.input.file.rounded(target(u, v).x) : at(v).point) || !free) return;
    // If the best position fails, one end may succeed.
    const Vector3d &at_u = at(u).point, &at_v = at(v).point;
    const WideQuadric q = quadric_about(u, v, at_v);
    try_at(u, v, q(at_u - at_v) < q(Vector3d::Zero()) ? at_u : at_v);
  }

  /// Returns true if the link condition holds (Dey et al. 1999): the ends have two adjacent vertices in
  /// common, those opposite the edge. A tetrahedron, all of whose vertices have three faces, must not
  /// collapse either.
  bool keeps_topology(std::uint32_t u, std::uint32_t v) {
    ++query_;
    std::size_t at_u = 0, at_v = 0;
    int common = 0;
    local_.for_each_face(u, [&](std::uint32_t f, int i) {
      for (const int k : {1, 2}) local_.vertices[local_.faces[f].corners[(i + k) % 3]].seen = query_;
      ++at_u;
    });
    local_.for_each_face(v, [&](std::uint32_t f, int i) {
      ++at_v;
      for (const int k : {1, 2}) {
        const std::uint32_t w = local_.faces[f].corners[(i + k) % 3];
        if (w != u && std::exchange(local_.vertices[w].seen, 0) == query_) ++common;
      }
    });
    return common == 2 && (at_u > 3 || at_v > 3);
  }

  bool try_at(std::uint32_t u, std::uint32_t v, const Vector3d& x) {
    if (!gather(u, v, x) || (kind_ == Collapses::careful && !distance_.passes())) return false;
    apply();
    // The new edges; earlier proposals at v are outdated.
    local_.for_each_face(v,
                         [&](std::uint32_t f, int i) { propose(v, local_.faces[f].corners[(i + 1) % 3]); });
    return true;
  }

  /// Makes the faces that result when `going` and `v`, two ends of an edge, become the vertex at `x`. v keeps
  /// its index, and moves only if x is not its position; the ends that move must be free. Returns false if x
  /// lies outside of the domain, or if a face turns over, degenerates or gets too long.
  bool gather(std::uint32_t going, std::uint32_t v, const Vector3d& x) {
    // Vertices stay in the domain, or triangles that belong to it could reach into another one.
    if (!domain_.holds(x)) {
      mark_dirty(v);
      return false;
    }
    if (!mesh_.input.admits(x)) return false;
    collapse_.v = v;
    collapse_.going = going;
    collapse_.x = x;
    collapse_.v_moves = at(v).point != x;
    collapse_.made.clear();
    collapse_.old.clear();
    collapse_.attached.clear();
    // The faces at the edge are found from both ends, and counted as old from the one that is removed.
    return make_faces(going) && (!collapse_.v_moves || make_faces(v));
  }

  /// Makes the resulting faces around one end of the edge, without the two at the edge, which are removed.
  bool make_faces(std::uint32_t moved) {
    const std::uint32_t other = moved == collapse_.v ? collapse_.going : collapse_.v;
    bool good = true;
    local_.for_each_face(moved, [&](std::uint32_t f, int i) {
      if (!good) return;
      const auto& corners = local_.faces[f].corners;
      const std::uint32_t a = corners[(i + 1) % 3], b = corners[(i + 2) % 3];
      if (a == other || b == other) {
        if (moved != collapse_.v) collapse_.old.push_back(f);
        return;
      }
      collapse_.old.push_back(f);
      const Corners now = {collapse_.x, at(a).point, at(b).point};
      const Collapse::NewFace made{f, i, now, {a, b}, (now[1] - now[0]).cross(now[2] - now[0])};
      good = is_short(now, moved) && is_well_shaped(made, {at(moved).point, now[1], now[2]});
      collapse_.made.push_back(made);
    });
    return good;
  }

  /// Returns true if the new edges of a face are no longer than the limit for a domain of this round; longer
  /// ones are left to the next round.
  bool is_short(const Corners& now, std::uint32_t moved) {
    const double limit = domain_.longest_edge * domain_.longest_edge;
    const bool is = (now[1] - now[0]).squaredNorm() <= limit && (now[2] - now[0]).squaredNorm() <= limit;
    if (!is) mark_dirty(moved);
    return is;
  }

  /// Returns true if the height of a triangle is at most kFlat. @param size twice its area
  static bool is_flat(double size, const Corners& c) {
    const double longest =
        std::max({(c[1] - c[0]).squaredNorm(), (c[2] - c[1]).squaredNorm(), (c[0] - c[2]).squaredNorm()});
    return size * size <= kFlat * kFlat * longest;
  }

  /// Returns true if a face keeps some area, does not turn over and is not a sliver, or was one already whose
  /// normal rounding decides.
  bool is_well_shaped(const Collapse::NewFace& made, const Corners& before) const {
    const Vector3d own_normal = (before[1] - before[0]).cross(before[2] - before[0]);
    const double size = made.normal.norm();
    const bool was_flat = is_flat(own_normal.norm(), before);
    if (was_flat && is_flat(size, made.at)) return true;
    const bool by_fine = was_flat || kind_ == Collapses::bold;
    const Vector3d normal_before =
        by_fine ? mesh_.input.fine.normal(mesh_.fine_triangle[local_.faces[made.face].global]).cast<double>()
                : own_normal;
    const double least = by_fine ? kLeastCosineToFine : kLeastCosineToOld;
    constexpr double kDegenerate = 1e-9;  // of its squared sides
    if (size <=
        kDegenerate * ((made.at[1] - made.at[0]).squaredNorm() + (made.at[2] - made.at[0]).squaredNorm()))
      return false;
    if (made.normal.dot(normal_before) < least * size * normal_before.norm()) return false;
    const double now = shape(made.at);
    return now >= kPoorShape || now >= shape(before);
  }

  /// Carries out the collapse that was gathered, and records its join.
  void apply() {
    // All old faces are removed first, and those that only change are restored: the two at the edge remain
    // removed. Samples are in the lists of the new faces only.
    for (const std::uint32_t f : collapse_.old) mesh_.first_sample[local_.faces[f].global] = FineMesh::kNone;
    for (const std::uint32_t f : collapse_.old) local_.faces[f].gone = true;
    for (const Collapse::NewFace& made : collapse_.made) {
      DomainMesh::Face& face = local_.faces[made.face];
      face.corners[made.corner] = collapse_.v;
      face.gone = false;
      mesh_.triangles[face.global][made.corner] = at(collapse_.v).global;
    }
    for (const std::uint32_t f : collapse_.old)
      if (local_.faces[f].gone)
        mesh_.triangles[local_.faces[f].global] = {FineMesh::kNone, FineMesh::kNone, FineMesh::kNone};
    for (const Collapse::Attached& entry : collapse_.attached) {
      const std::uint32_t triangle = local_.faces[collapse_.made[entry.triangle].face].global;
      mesh_.next_sample[entry.sample] = mesh_.first_sample[triangle];
      mesh_.first_sample[triangle] = entry.sample;
    }
    merge_vertices();
    // Changed edges are tested again in the next round; vertices of other domains must not be written.
    mark_dirty(collapse_.v);
    for (const Collapse::NewFace& made : collapse_.made)
      if (at(made.others[0]).here) mark_dirty(made.others[0]);
  }

  void merge_vertices() {
    DomainMesh::Vertex &staying = local_.vertices[collapse_.v], &going = local_.vertices[collapse_.going];
    // The vertex represents the planes of both ends.
    const WideQuadric q = quadric_about(collapse_.going, collapse_.v, collapse_.x);
    float& tolerance = mesh_.least_tolerance[staying.global];
    tolerance = std::min(tolerance, mesh_.least_tolerance[going.global]);
    mesh_.unmoved[going.global] = 0;
    if (collapse_.v_moves) {  // otherwise it may be a corner of another domain's triangles, read concurrently
      mesh_.unmoved[staying.global] = 0;
      staying.point = mesh_.points[staying.global] = collapse_.x;
    }
    mesh_.quadrics[staying.global] = q.about(Vector3d::Zero());
    ++staying.version;
    going.gone = true;
    local_.merge_corners(collapse_.going, collapse_.v);
    joins_.push_back({.going = mesh_.leaders[going.global],
                      .node = {.first = mesh_.leaders[staying.global],
                               .merges = true,
                               .place = collapse_.x,
                               .quadric = mesh_.quadrics[staying.global]}});
  }

  DecimatedMesh& mesh_;
  const Collapses kind_;
  const Domain& domain_;
  DomainMesh local_;
  Collapse collapse_;  ///< the current one
  CollapseDistance distance_;
  std::vector<Proposal> heap_;
  std::uint32_t query_ = 0;
  std::vector<Join> joins_;
};

}  // namespace

std::vector<Join> collapse_in_domain(DecimatedMesh& mesh, Collapses kind, const Domain& domain,
                                     std::span<const std::uint32_t> triangles,
                                     std::vector<std::uint32_t>& local, const RunContext& context) {
  // A domain without an edge to test does not change.
  if (std::ranges::none_of(triangles, [&](std::uint32_t t) {
        return std::ranges::any_of(mesh.triangles[t], [&](std::uint32_t p) { return mesh.dirty[p] != 0; });
      }))
    return {};
  return DomainCollapses(mesh, kind, domain, triangles, local).run(context);
}

}  // namespace hermesh
