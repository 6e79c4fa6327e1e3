#include "algorithms/extraction/manifold_dual_contouring/block_decimation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "algorithms/extraction/manifold_dual_contouring/triangle_contact.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_grid.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_reach.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How strongly a point is drawn to the middle of its edge, against the planes: enough to decide on a plane.
constexpr double kPull = 1e-6;
/// Shape of a triangle, 1 for equilateral and 0 for degenerate: a collapse makes none below this unless there was a worse
/// one in its place.
constexpr double kPoorShape = 0.1;
/// An edge of the fine mesh is looked at in at most 2^kMostParts parts.
constexpr int kMostParts = 4;
/// Steps along a new edge get no shorter than this, in voxels.
constexpr double kShortestStep = 0.03;
/// A triangle may not turn by more than some 84 degrees in one collapse.
constexpr double kLeastCosine = 0.1;

double shape(const Corners& t) {
  const double twice_area = (t[1] - t[0]).cross(t[2] - t[0]).norm();
  const double squares = (t[1] - t[0]).squaredNorm() + (t[2] - t[1]).squaredNorm() + (t[0] - t[2]).squaredNorm();
  return squares > 0 ? 2.0 * std::sqrt(3.0) * twice_area / squares : 0.0;
}

class CubeDecimation {
  static constexpr std::uint32_t kNone = 0xffffffffu;

  struct Vertex {
    Vector3d point;
    std::uint32_t global;
    std::uint32_t first_corner = kNone;
    std::uint32_t version = 0;
    bool here = false;  ///< in the cube, so that all its triangles are known
    bool free = false;  ///< all its triangles belong to the cube, so that it may move
    bool gone = false;
  };
  struct Face {
    std::array<std::uint32_t, 3> corners;
    std::uint32_t global;
    Box3 box;  ///< empty when it is gone
    bool own = false;
    std::uint32_t seen = 0;  ///< number of the last question that it was looked at for
    bool gone() const { return box.lower[0] > box.upper[0]; }
  };
  struct Proposal {
    float cost;
    std::uint32_t u, v, version_u, version_v;
    /// For a heap with the cheapest on top; ties by number, so that there is one order.
    bool operator<(const Proposal& other) const {
      if (cost != other.cost) return cost > other.cost;
      return u != other.u ? u > other.u : v > other.v;
    }
  };
  struct Attached {
    std::uint32_t sample;
    std::uint32_t triangle;  ///< index among the new ones
  };

 public:
  CubeDecimation(DecimatedMesh& mesh, const FilePoints& file, const DecimationCube& cube,
                 std::span<const std::uint32_t> triangles, const RunContext& context)
      : mesh_(mesh),
        file_(file),
        cube_(cube),
        context_(context),
        triangles_(triangles) {
    load(triangles);
  }

  void run() {
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      if (!faces_[f].own) continue;
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t u = faces_[f].corners[i], v = faces_[f].corners[(i + 1) % 3];
        if (u < v && (is_stirred(u) || is_stirred(v))) propose(u, v);
      }
    }
    std::make_heap(heap_.begin(), heap_.end());
    heaped_ = true;
    for (std::size_t step = 0; !heap_.empty(); ++step) {
      if (step % 256 == 0) context_.check();
      std::pop_heap(heap_.begin(), heap_.end());
      const Proposal next = heap_.back();
      heap_.pop_back();
      if (vertices_[next.u].gone || vertices_[next.v].gone) continue;
      if (vertices_[next.u].version != next.version_u || vertices_[next.v].version != next.version_v) continue;
      try_collapse(next.u, next.v);
    }
  }

 private:
  void load(std::span<const std::uint32_t> triangles) {
    std::vector<std::uint32_t> ids;
    ids.reserve(3 * triangles.size());
    for (const std::uint32_t t : triangles) ids.insert(ids.end(), mesh_.triangles[t].begin(), mesh_.triangles[t].end());
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    vertices_.resize(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
      Vertex& vertex = vertices_[i];
      vertex.global = ids[i];
      vertex.point = mesh_.points[ids[i]];
      vertex.here = vertex.free = cube_.holds(vertex.point);
    }
    faces_.resize(triangles.size());
    next_corner_.resize(3 * triangles.size());
    double widths = 0;
    for (std::uint32_t f = 0; f < faces_.size(); ++f) {
      Face& face = faces_[f];
      face.global = triangles[f];
      for (int i = 0; i < 3; ++i)
        face.corners[i] = static_cast<std::uint32_t>(
            std::lower_bound(ids.begin(), ids.end(), mesh_.triangles[face.global][i]) - ids.begin());
      face.box = box_of(face.corners);
      face.own = true;
      for (const std::uint32_t v : face.corners) face.own = face.own && vertices_[v].here;
      for (int i = 0; i < 3; ++i) {
        Vertex& vertex = vertices_[face.corners[i]];
        vertex.free = vertex.free && face.own;
        next_corner_[3 * f + i] = vertex.first_corner;
        vertex.first_corner = 3 * f + static_cast<std::uint32_t>(i);
      }
      widths += (face.box.upper - face.box.lower).maxCoeff();
    }
    for (std::uint32_t v = 0; v < vertices_.size(); ++v)
      if (vertices_[v].here && !vertices_[v].free) stir(v);
    grid_.emplace(std::max(1e-3, 1.5 * widths / double(faces_.size())), faces_.size());
    for (std::uint32_t f = 0; f < faces_.size(); ++f) grid_->add(f, faces_[f].box);
  }

  Box3 box_of(const std::array<std::uint32_t, 3>& corners) const {
    Box3 box;
    for (const std::uint32_t v : corners) box.add(vertices_[v].point);
    return box;
  }

  WideQuadric quadric_about(std::uint32_t u, std::uint32_t v, const Vector3d& anchor) const {
    WideQuadric sum;
    for (const std::uint32_t w : {u, v}) sum.add(mesh_.quadrics[vertices_[w].global], vertices_[w].point - anchor);
    return sum;
  }

  /// Where the ends of an edge would go; an end that may not move stays.
  Vector3d target(std::uint32_t u, std::uint32_t v, double* cost = nullptr) const {
    const Vector3d middle = 0.5 * (vertices_[u].point + vertices_[v].point);
    const WideQuadric q = quadric_about(u, v, middle);
    Vector3d x = !vertices_[u].free   ? Vector3d(vertices_[u].point - middle)
                 : !vertices_[v].free ? Vector3d(vertices_[v].point - middle)
                                      : q.minimiser(Vector3d::Zero(), kPull);
    const double length = (vertices_[u].point - vertices_[v].point).norm();
    // Planes that are nearly parallel meet far away: no farther than the edge is long.
    if (x.squaredNorm() > length * length) x *= length / x.norm();
    if (cost) *cost = q(x) + kPull * q.a.trace() * length * length;
    return middle + x;
  }

  bool is_stirred(std::uint32_t v) const { return mesh_.stirred[vertices_[v].global] != 0; }
  /// What failed at this point may succeed in the next round.
  void stir(std::uint32_t v) { mesh_.stirred_next[vertices_[v].global] = 1; }

  void propose(std::uint32_t u, std::uint32_t v) {
    if (!vertices_[u].here || !vertices_[v].here || (!vertices_[u].free && !vertices_[v].free)) return;
    if (u > v) std::swap(u, v);
    double cost = 0;
    target(u, v, &cost);
    heap_.push_back({static_cast<float>(cost), u, v, vertices_[u].version, vertices_[v].version});
    if (heaped_) std::push_heap(heap_.begin(), heap_.end());
  }

  void try_collapse(std::uint32_t u, std::uint32_t v) {
    if (!vertices_[u].free) std::swap(u, v);  // u goes, v stays
    if (!keeps_topology(u, v)) return;
    const Vector3d best = file_.rounded(target(u, v));
    if (try_at(u, v, best) || !vertices_[v].free) return;
    // Where the best place will not do, one end may.
    const WideQuadric q = quadric_about(u, v, vertices_[v].point);
    const bool u_is_better = q(vertices_[u].point - vertices_[v].point) < q(Vector3d::Zero());
    try_at(u, v, vertices_[u_is_better ? u : v].point);
  }

  template <class F>
  void for_each_face(std::uint32_t v, F&& f) const {
    for (std::uint32_t corner = vertices_[v].first_corner; corner != kNone; corner = next_corner_[corner])
      if (!faces_[corner / 3].gone()) f(corner / 3, static_cast<int>(corner % 3));
  }

  /// The link condition.
  bool keeps_topology(std::uint32_t u, std::uint32_t v) {
    ring_.clear();
    for_each_face(u, [&](std::uint32_t f, int i) { ring_.push_back(faces_[f].corners[(i + 1) % 3]); });
    int common = 0, valence = 0;
    for_each_face(v, [&](std::uint32_t f, int i) {
      common += std::find(ring_.begin(), ring_.end(), faces_[f].corners[(i + 1) % 3]) != ring_.end();
      ++valence;
    });
    return common == 2 && (ring_.size() > 3 || valence > 3);
  }

  bool try_at(std::uint32_t u, std::uint32_t v, const Vector3d& x) {
    if (!cube_.holds(x)) {
      stir(v);
      return false;
    }
    new_.clear();
    old_.clear();
    const bool v_moves = vertices_[v].point != x;
    if (!gather_new(u, v, x) || (v_moves && !gather_new(v, u, x))) return false;
    if (!reattach(u, v, v_moves) || !is_near_fine_mesh(x) || !is_embedded(v, x, v_moves)) return false;
    if (!edges_are_near() || !new_edges_are_near(x)) return false;
    apply(u, v, x);
    return true;
  }

  struct NewFace {
    std::uint32_t face;
    int corner;  ///< of x
    Corners at;  ///< x first, in the order of the face
    std::array<std::uint32_t, 2> others;
    Box3 box;
    Vector3d normal;
    TriangleReach reach;
  };

  /// The faces of `moved` that remain when it goes to x. False if one turns over, degenerates or gets too long.
  bool gather_new(std::uint32_t moved, std::uint32_t other_end, const Vector3d& x) {
    bool good = true;
    for_each_face(moved, [&](std::uint32_t f, int i) {
      if (!good) return;
      const Face& face = faces_[f];
      const std::uint32_t a = face.corners[(i + 1) % 3], b = face.corners[(i + 2) % 3];
      old_.push_back(f);
      if (a == other_end || b == other_end) return;
      NewFace made{f, i, {x, vertices_[a].point, vertices_[b].point}, {a, b}, {}, {}, {}};
      const Vector3d e = made.at[1] - x, g = made.at[2] - x;
      made.normal = e.cross(g);
      const Corners before = {vertices_[moved].point, made.at[1], made.at[2]};
      const Vector3d normal_before = (before[1] - before[0]).cross(before[2] - before[0]);
      good = e.squaredNorm() <= cube_.longest_edge * cube_.longest_edge &&
             g.squaredNorm() <= cube_.longest_edge * cube_.longest_edge;
      if (!good) stir(moved);
      const double size = made.normal.norm();
      good = good && size > 1e-9 * (e.squaredNorm() + g.squaredNorm());
      good = good && made.normal.dot(normal_before) >= kLeastCosine * size * normal_before.norm();
      if (good) {
        const double now = shape(made.at);
        good = now >= kPoorShape || now >= shape(before);
      }
      for (const Vector3d& p : made.at) made.box.add(p);
      new_.push_back(made);
    });
    return good;
  }

  /// Finds a triangle within the tolerance for every sample of the old ones and for the ends that move.
  bool reattach(std::uint32_t u, std::uint32_t v, bool v_moves) {
    attached_.clear();
    for (NewFace& made : new_) made.reach = TriangleReach(made.at);
    std::sort(old_.begin(), old_.end());
    old_.erase(std::unique(old_.begin(), old_.end()), old_.end());
    for (const std::uint32_t w : {u, v})
      if ((w == u || v_moves) && mesh_.unmoved[vertices_[w].global] && !attach(vertices_[w].global)) return false;
    for (const std::uint32_t f : old_)
      for (std::uint32_t s = mesh_.first_sample[faces_[f].global]; s != kNoSample; s = mesh_.next_sample[s])
        if (!attach(s)) return false;
    return true;
  }

  /// To the triangle below or above the sample, or else to any that is near.
  bool attach(std::uint32_t sample) {
    const Vector3d& p = mesh_.fine->points()[sample];
    const double within = mesh_.tolerance[sample];
    std::uint32_t found = kNone;
    for (std::uint32_t n = 0; n < new_.size(); ++n) {
      if (!new_[n].reach.near(p, within)) continue;
      found = n;
      if (new_[n].reach.beyond(p).maxCoeff() <= 0) break;
    }
    if (found != kNone) attached_.push_back({sample, found});
    return found != kNone;
  }

  /// Every edge of the fine mesh at a sample that was attached anew.
  bool edges_are_near() {
    ++question_;
    for (const std::uint32_t f : old_) faces_[f].seen = question_;
    for (std::uint32_t i = 0; i < attached_.size(); ++i) std::atomic_ref(mesh_.proposed[attached_[i].sample]).store(i, std::memory_order_relaxed);
    const FineMesh& fine = *mesh_.fine;
    for (const Attached& entry : attached_)
      for (const std::uint32_t t : fine.around(entry.sample))
        if (!edge_is_near(entry, fine.next(t, entry.sample))) return false;
    return true;
  }

  bool edge_is_near(const Attached& entry, std::uint32_t neighbour) {
    const NewFace& mine = new_[entry.triangle];
    const Part part{mesh_.fine->points()[entry.sample], mesh_.fine->points()[neighbour],
                    std::min(mesh_.tolerance[entry.sample], mesh_.tolerance[neighbour])};
    const std::uint32_t there = std::atomic_ref(mesh_.attached_to[neighbour]).load(std::memory_order_relaxed);
    const std::uint32_t f = there == kNoTriangle ? kNone : local_face(there);
    if (there == kNoTriangle || (f != kNone && faces_[f].seen == question_)) {
      // Ours to read: it was attached to a triangle that goes, or it is a point of the mesh.
      const std::uint32_t at = std::atomic_ref(mesh_.proposed[neighbour]).load(std::memory_order_relaxed);
      if (at < attached_.size() && attached_[at].sample == neighbour) {
        const std::uint32_t other = attached_[at].triangle;
        return other == entry.triangle || part_is_near(part, mine.reach, new_[other].reach, 0);
      }
    }
    if (there == kNoTriangle) return edge_to_point_is_near(part, mine, neighbour);
    return f != kNone && part_is_near(part, mine.reach, TriangleReach(corners_of(f)), 0);
  }

  struct Part {
    Vector3d from, to;
    double tolerance;
  };

  /// To a sample that still is a point of the mesh: on all triangles around it.
  bool edge_to_point_is_near(const Part& part, const NewFace& mine, std::uint32_t sample) {
    const auto at = std::lower_bound(vertices_.begin(), vertices_.end(), sample,
                                     [](const Vertex& vertex, std::uint32_t id) { return vertex.global < id; });
    if (at == vertices_.end() || at->global != sample) return false;
    const auto vertex = static_cast<std::uint32_t>(at - vertices_.begin());
    if (mine.others[0] == vertex || mine.others[1] == vertex) return true;
    for (const NewFace& made : new_)
      if ((made.others[0] == vertex || made.others[1] == vertex) && part_is_near(part, mine.reach, made.reach, 0)) return true;
    bool near = false;
    for_each_face(vertex, [&](std::uint32_t f, int) {
      if (!near && faces_[f].seen != question_) near = part_is_near(part, mine.reach, TriangleReach(corners_of(f)), 0);
    });
    return near;
  }

  /// The start is near `a` and the end near `b`. Both distances are convex along the part, so it is enough to find a
  /// place that is near both; or one near a third triangle, and so on for either half.
  bool part_is_near(const Part& part, const TriangleReach& a, const TriangleReach& b, int depth) {
    const double within = part.tolerance;
    if (a.near(part.to, within) || b.near(part.from, within)) return true;
    // First where the part leaves the prism over `a`; from there on by halving.
    const Vector3d at_start = a.beyond(part.from), at_end = a.beyond(part.to);
    double low = 0, high = 1, middle = 0.5;
    for (int i = 0; i < 3; ++i)
      if (at_start[i] < 0 && at_end[i] > 0) middle = std::min(middle, at_start[i] / (at_start[i] - at_end[i]));
    for (int step = 0; step < 7; ++step, middle = 0.5 * (low + high)) {
      const Vector3d p = part.from + middle * (part.to - part.from);
      const bool near_a = a.near(p, within), near_b = b.near(p, within);
      if (near_a && near_b) return true;
      if (!near_a && !near_b) {
        TriangleReach third;
        if (depth == kMostParts || !triangle_near(p, within, third)) return false;
        const Part first{part.from + low * (part.to - part.from), p, within};
        const Part second{p, part.from + high * (part.to - part.from), within};
        return part_is_near(first, a, third, depth + 1) && part_is_near(second, third, b, depth + 1);
      }
      (near_a ? low : high) = middle;
    }
    return false;
  }

  /// Among the new triangles and those that stay.
  bool triangle_near(const Vector3d& p, double within, TriangleReach& found) {
    for (const NewFace& made : new_)
      if (made.reach.near(p, within)) {
        found = made.reach;
        return true;
      }
    const Box3 box{p - Vector3d::Constant(within), p + Vector3d::Constant(within)};
    bool any = false;
    grid_->visit(
        box, [&](std::uint32_t f) { return faces_[f].gone(); },
        [&](std::uint32_t f) {
          if (any || faces_[f].seen == question_ || !box.overlaps(faces_[f].box)) return;
          const TriangleReach reach(corners_of(f));
          if (!reach.near(p, within)) return;
          found = reach;
          any = true;
        });
    return any;
  }

  Corners corners_of(std::uint32_t f) const {
    const auto& c = faces_[f].corners;
    return {vertices_[c[0]].point, vertices_[c[1]].point, vertices_[c[2]].point};
  }

  std::uint32_t local_face(std::uint32_t triangle) const {
    const auto at = std::lower_bound(triangles_.begin(), triangles_.end(), triangle);
    if (at == triangles_.end() || *at != triangle) return kNone;
    return static_cast<std::uint32_t>(at - triangles_.begin());
  }

  /// The new point, by the triangles around the sample next to it.
  bool is_near_fine_mesh(const Vector3d& x) {
    if (attached_.empty()) return false;  // no place to start from; rare, for ends that move leave samples behind
    const FineMesh& fine = *mesh_.fine;
    below_ = fine.walk(fine.around(attached_.front().sample).front(), x);
    return near_fine_around(x, 0.0);
  }

  /// Whether p, or a ball about it, is near the fine triangle `below_` or one that touches it.
  bool near_fine_around(const Vector3d& p, double radius) {
    if (near_fine(below_, p, radius)) return true;
    const FineMesh& fine = *mesh_.fine;
    for (const std::uint32_t corner : fine.triangles()[below_])
      for (const std::uint32_t t : fine.around(corner))
        if (t != below_ && near_fine(t, p, radius)) {
          below_ = t;
          return true;
        }
    return false;
  }

  bool near_fine(std::uint32_t t, const Vector3d& p, double radius) const {
    const FineMesh& fine = *mesh_.fine;
    const Triangle& c = fine.triangles()[t];
    const double within = std::min({mesh_.tolerance[c[0]], mesh_.tolerance[c[1]], mesh_.tolerance[c[2]]}) - radius;
    const Vector3d& corner = fine.points()[c[0]];
    constexpr double kRounding = 1e-4;  // of the normals' single precision, over a triangle's size
    if (within < 0 || std::abs(fine.normal(t).cast<double>().dot(p - corner)) > within + kRounding) return false;
    return squared_distance(p, corner, fine.points()[c[1]], fine.points()[c[2]]) <= within * within;
  }

  /// The new edges. A narrow ridge could rise above the fine mesh and yet have its flanks near every edge of that.
  bool new_edges_are_near(const Vector3d& x) {
    const std::uint32_t below_x = below_;
    for (const NewFace& made : new_) {
      below_ = below_x;
      if (!segment_is_near(x, vertices_[made.others[0]].point)) return false;
    }
    return true;
  }

  /// In steps, each near one fine triangle as a whole, that are found by a walk over the fine mesh beside the segment.
  bool segment_is_near(const Vector3d& from, const Vector3d& to) {
    const double length = (to - from).norm();
    double done = 0, step = 1.0;
    while (done < length) {
      step = std::min(step, length - done);
      const Vector3d begin = from + (done / length) * (to - from), end = from + ((done + step) / length) * (to - from);
      if (near_fine(below_, begin, 0.0) && near_fine(below_, end, 0.0)) {
        done += step;
        step *= 2;
        continue;
      }
      const Vector3d middle = 0.5 * (begin + end);
      below_ = mesh_.fine->walk(below_, middle);
      if ((near_fine(below_, begin, 0.0) && near_fine(below_, end, 0.0)) || near_fine_around(middle, 0.5 * step)) {
        done += step;
        step *= 2;
      } else if ((step *= 0.5) < kShortestStep) {
        return false;
      }
    }
    return true;
  }

  bool is_embedded(std::uint32_t v, const Vector3d& x, bool v_moves) {
    if (!fan_is_embedded(x, v_moves)) return false;
    ++question_;
    for (const std::uint32_t f : old_) faces_[f].seen = question_;
    Box3 box;
    for (const NewFace& made : new_) {
      box.lower = box.lower.cwiseMin(made.box.lower);
      box.upper = box.upper.cwiseMax(made.box.upper);
    }
    bool apart = true;
    grid_->visit(
        box, [&](std::uint32_t f) { return faces_[f].gone(); },
        [&](std::uint32_t f) {
          if (!apart || faces_[f].seen == question_) return;
          faces_[f].seen = question_;
          if (!box.overlaps(faces_[f].box)) return;
          for (const NewFace& made : new_)
            if (apart && made.box.overlaps(faces_[f].box)) apart = is_apart(made, v, faces_[f]);
        });
    return apart;
  }

  /// The new triangles and one another. Seen along their mean normal they cannot meet if all face the viewer and go round
  /// the point once.
  bool fan_is_embedded(const Vector3d& x, bool whole_ring) const {
    Vector3d mean = Vector3d::Zero();
    for (const NewFace& made : new_) mean += made.normal;
    bool facing = whole_ring && mean.norm() > 0;
    for (const NewFace& made : new_) facing = facing && made.normal.dot(mean) > 0.05 * made.normal.norm() * mean.norm();
    if (facing) {
      const Vector3d side = mean.unitOrthogonal(), up = mean.cross(side);
      int turns = 0;  // steps of the ring from below to above on the side of `side`
      for (const NewFace& made : new_) {
        const Vector3d a = made.at[1] - x, b = made.at[2] - x;
        const double ya = a.dot(up), yb = b.dot(up);
        if (ya < 0 && yb >= 0) ++turns;
      }
      if (turns == 1) return true;
    }
    for (std::size_t i = 0; i < new_.size(); ++i)
      for (std::size_t j = i + 1; j < new_.size(); ++j) {
        const NewFace &a = new_[i], &b = new_[j];
        const bool follows = a.others[1] == b.others[0], precedes = a.others[0] == b.others[1];
        if (follows && precedes) return false;
        const Corners at_a = follows ? Corners{x, a.at[2], a.at[1]} : a.at;
        const Corners at_b = precedes ? Corners{x, b.at[2], b.at[1]} : b.at;
        if (!certainly_apart(at_a, at_b, follows || precedes ? 2 : 1)) return false;
      }
    return true;
  }

  /// `v` is the vertex that the new triangles' first corner belongs to; if it moved, no other triangle has it.
  bool is_apart(const NewFace& made, std::uint32_t v, const Face& face) const {
    // Shared corners to the front, in the same order in both.
    std::array<std::uint32_t, 3> mine = {v, made.others[0], made.others[1]}, theirs = face.corners;
    Corners a = made.at, b;
    int shared = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = shared; j < 3; ++j)
        if (mine[i] == theirs[j]) {
          std::swap(theirs[j], theirs[shared]);
          std::swap(mine[i], mine[shared]);
          std::swap(a[i], a[shared]);
          ++shared;
          break;
        }
    for (int j = 0; j < 3; ++j) b[j] = vertices_[theirs[j]].point;
    return certainly_apart(a, b, shared);
  }

  void apply(std::uint32_t u, std::uint32_t v, const Vector3d& x) {
    const WideQuadric q = quadric_about(u, v, x);
    for (const std::uint32_t f : old_) {
      mesh_.first_sample[faces_[f].global] = kNoSample;
      faces_[f].box = Box3();
    }
    for (const NewFace& made : new_) {
      Face& face = faces_[made.face];
      face.corners[made.corner] = v;
      face.box = made.box;
      mesh_.triangles[face.global][made.corner] = vertices_[v].global;
    }
    for (const std::uint32_t f : old_)
      if (faces_[f].gone()) mesh_.triangles[faces_[f].global] = {kNoTriangle, kNoTriangle, kNoTriangle};
    for (const Attached& entry : attached_) {
      const std::uint32_t triangle = faces_[new_[entry.triangle].face].global;
      mesh_.next_sample[entry.sample] = mesh_.first_sample[triangle];
      mesh_.first_sample[triangle] = entry.sample;
      std::atomic_ref(mesh_.attached_to[entry.sample]).store(triangle, std::memory_order_relaxed);
    }
    move(u, v, x, q);
    for (const NewFace& made : new_) grid_->add(made.face, made.box);
    stir(v);
    for_each_face(v, [&](std::uint32_t f, int i) {
      const std::uint32_t neighbour = faces_[f].corners[(i + 1) % 3];
      propose(v, neighbour);
      if (vertices_[neighbour].here) stir(neighbour);
    });
  }

  void move(std::uint32_t u, std::uint32_t v, const Vector3d& x, const WideQuadric& q) {
    Vertex &going = vertices_[u], &staying = vertices_[v];
    if (staying.point != x) mesh_.unmoved[staying.global] = 0;
    mesh_.unmoved[going.global] = 0;
    staying.point = mesh_.points[staying.global] = x;
    mesh_.quadrics[staying.global] = q.about(Vector3d::Zero());
    ++staying.version;
    going.gone = true;
    // One list of the corners that are left: dead ones would make the walk around a point longer and longer.
    std::uint32_t kept = kNone;
    for (const std::uint32_t first : {going.first_corner, staying.first_corner})
      for (std::uint32_t corner = first, next; corner != kNone; corner = next) {
        next = next_corner_[corner];
        if (faces_[corner / 3].gone()) continue;
        next_corner_[corner] = kept;
        kept = corner;
      }
    staying.first_corner = kept;
  }

  DecimatedMesh& mesh_;
  const FilePoints& file_;
  const DecimationCube& cube_;
  const RunContext& context_;
  const std::span<const std::uint32_t> triangles_;
  std::vector<Vertex> vertices_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> next_corner_;  ///< by corner, 3 × face + i: the next one at the same vertex
  std::optional<TriangleGrid> grid_;
  std::vector<Proposal> heap_;
  bool heaped_ = false;
  std::uint32_t question_ = 0;
  // Of the collapse under way.
  std::vector<std::uint32_t> ring_, old_;
  std::vector<NewFace> new_;
  std::vector<Attached> attached_;
  std::uint32_t below_ = 0;  ///< a fine triangle near the place looked at
};

}  // namespace

void decimate_cube(DecimatedMesh& mesh, const FilePoints& file, const DecimationCube& cube,
                   std::span<const std::uint32_t> triangles, const RunContext& context) {
  CubeDecimation(mesh, file, cube, triangles, context).run();
}

}  // namespace hermesh
