#include "algorithms/extraction/manifold_dual_contouring/block_decimation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>

#include "algorithms/extraction/manifold_dual_contouring/collapse_distance.h"
#include "algorithms/extraction/manifold_dual_contouring/collapse_embedding.h"
#include "algorithms/extraction/manifold_dual_contouring/cube_mesh.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How strongly a point is drawn to the middle of its edge, against the planes: enough to decide on a plane.
constexpr double kPull = 1e-6;
/// Shape of a triangle, 1 for equilateral and 0 for degenerate: a collapse makes none below this unless there was a worse
/// one in its place.
constexpr double kPoorShape = 0.1;
/// A triangle may not turn by more than some 84 degrees in one collapse.
constexpr double kLeastCosine = 0.1;

double shape(const Corners& t) {
  const double twice_area = (t[1] - t[0]).cross(t[2] - t[0]).norm();
  const double squares = (t[1] - t[0]).squaredNorm() + (t[2] - t[1]).squaredNorm() + (t[0] - t[2]).squaredNorm();
  return squares > 0 ? 2.0 * std::sqrt(3.0) * twice_area / squares : 0.0;
}

class CubeDecimation {
  struct Proposal {
    float cost;
    std::uint32_t u, v, version_u, version_v;
    /// For a heap with the cheapest on top; ties by number, so that there is one order.
    bool operator<(const Proposal& other) const {
      if (cost != other.cost) return cost > other.cost;
      return u != other.u ? u > other.u : v > other.v;
    }
  };

 public:
  CubeDecimation(DecimatedMesh& mesh, const FilePoints& file, const DecimationCube& cube,
                 std::span<const std::uint32_t> triangles, const RunContext& context)
      : mesh_(mesh),
        file_(file),
        cube_(cube),
        context_(context),
        local_(mesh, cube, triangles),
        distance_(mesh, local_, collapse_) {
    for (std::uint32_t v = 0; v < local_.vertices.size(); ++v)
      if (local_.vertices[v].here && !local_.vertices[v].free) stir(v);
  }

  void run() {
    for (std::uint32_t f = 0; f < local_.faces.size(); ++f) {
      if (!local_.faces[f].own) continue;
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t u = local_.faces[f].corners[i], v = local_.faces[f].corners[(i + 1) % 3];
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
      if (local_.vertices[next.u].gone || local_.vertices[next.v].gone) continue;
      if (local_.vertices[next.u].version != next.version_u || local_.vertices[next.v].version != next.version_v) continue;
      try_collapse(next.u, next.v);
    }
  }

 private:
  WideQuadric quadric_about(std::uint32_t u, std::uint32_t v, const Vector3d& anchor) const {
    WideQuadric sum;
    for (const std::uint32_t w : {u, v}) sum.add(mesh_.quadrics[local_.vertices[w].global], local_.vertices[w].point - anchor);
    return sum;
  }

  /// Where the ends of an edge would go; an end that may not move stays.
  Vector3d target(std::uint32_t u, std::uint32_t v, double* cost = nullptr) const {
    const Vector3d middle = 0.5 * (local_.vertices[u].point + local_.vertices[v].point);
    const WideQuadric q = quadric_about(u, v, middle);
    Vector3d x = !local_.vertices[u].free   ? Vector3d(local_.vertices[u].point - middle)
                 : !local_.vertices[v].free ? Vector3d(local_.vertices[v].point - middle)
                                      : q.minimiser(Vector3d::Zero(), kPull);
    const double length = (local_.vertices[u].point - local_.vertices[v].point).norm();
    // Planes that are nearly parallel meet far away: no farther than the edge is long.
    if (x.squaredNorm() > length * length) x *= length / x.norm();
    if (cost) *cost = q(x) + kPull * q.a.trace() * length * length;
    return middle + x;
  }

  bool is_stirred(std::uint32_t v) const { return mesh_.stirred[local_.vertices[v].global] != 0; }
  /// What failed at this point may succeed in the next round.
  void stir(std::uint32_t v) { mesh_.stirred_next[local_.vertices[v].global] = 1; }

  void propose(std::uint32_t u, std::uint32_t v) {
    if (!local_.vertices[u].here || !local_.vertices[v].here || (!local_.vertices[u].free && !local_.vertices[v].free)) return;
    if (u > v) std::swap(u, v);
    double cost = 0;
    target(u, v, &cost);
    heap_.push_back({static_cast<float>(cost), u, v, local_.vertices[u].version, local_.vertices[v].version});
    if (heaped_) std::push_heap(heap_.begin(), heap_.end());
  }

  void try_collapse(std::uint32_t u, std::uint32_t v) {
    if (!local_.vertices[u].free) std::swap(u, v);  // u goes, v stays
    if (!keeps_topology(u, v)) return;
    const Vector3d best = file_.rounded(target(u, v));
    if (try_at(u, v, best) || !local_.vertices[v].free) return;
    // Where the best place will not do, one end may.
    const WideQuadric q = quadric_about(u, v, local_.vertices[v].point);
    const bool u_is_better = q(local_.vertices[u].point - local_.vertices[v].point) < q(Vector3d::Zero());
    try_at(u, v, local_.vertices[u_is_better ? u : v].point);
  }

  /// The link condition.
  bool keeps_topology(std::uint32_t u, std::uint32_t v) {
    ring_.clear();
    local_.for_each_face(u, [&](std::uint32_t f, int i) { ring_.push_back(local_.faces[f].corners[(i + 1) % 3]); });
    int common = 0, valence = 0;
    local_.for_each_face(v, [&](std::uint32_t f, int i) {
      common += std::find(ring_.begin(), ring_.end(), local_.faces[f].corners[(i + 1) % 3]) != ring_.end();
      ++valence;
    });
    return common == 2 && (ring_.size() > 3 || valence > 3);
  }

  bool try_at(std::uint32_t u, std::uint32_t v, const Vector3d& x) {
    if (!cube_.holds(x)) {
      stir(v);
      return false;
    }
    collapse_.u = u;
    collapse_.v = v;
    collapse_.x = x;
    collapse_.v_moves = local_.vertices[v].point != x;
    collapse_.made.clear();
    collapse_.old.clear();
    if (!gather_faces(u, v) || (collapse_.v_moves && !gather_faces(v, u))) return false;
    std::sort(collapse_.old.begin(), collapse_.old.end());
    collapse_.old.erase(std::unique(collapse_.old.begin(), collapse_.old.end()), collapse_.old.end());
    if (!distance_.attach_samples() || !distance_.point_is_near() || !is_embedded(local_, collapse_)) return false;
    if (!distance_.edges_are_near()) return false;
    apply();
    return true;
  }

  /// The faces of `moved` that remain when it goes to x. False if one turns over, degenerates or gets too long.
  bool gather_faces(std::uint32_t moved, std::uint32_t other_end) {
    bool good = true;
    local_.for_each_face(moved, [&](std::uint32_t f, int i) {
      if (!good) return;
      const auto& corners = local_.faces[f].corners;
      const std::uint32_t a = corners[(i + 1) % 3], b = corners[(i + 2) % 3];
      collapse_.old.push_back(f);
      if (a == other_end || b == other_end) return;
      const Corners at = {collapse_.x, local_.vertices[a].point, local_.vertices[b].point};
      Collapse::NewFace made{f, i, at, {a, b}, {}, (at[1] - at[0]).cross(at[2] - at[0]), {}};
      for (const Vector3d& p : at) made.box.add(p);
      good = is_short(at, moved) && is_well_shaped(made, {local_.vertices[moved].point, at[1], at[2]});
      collapse_.made.push_back(made);
    });
    return good;
  }

  bool is_short(const Corners& at, std::uint32_t moved) {
    const double limit = cube_.longest_edge * cube_.longest_edge;
    const bool is = (at[1] - at[0]).squaredNorm() <= limit && (at[2] - at[0]).squaredNorm() <= limit;
    if (!is) stir(moved);
    return is;
  }

  static bool is_well_shaped(const Collapse::NewFace& made, const Corners& before) {
    const Vector3d normal_before = (before[1] - before[0]).cross(before[2] - before[0]);
    const double size = made.normal.norm();
    constexpr double kDegenerate = 1e-9;  // of its sides squared
    if (size <= kDegenerate * ((made.at[1] - made.at[0]).squaredNorm() + (made.at[2] - made.at[0]).squaredNorm()))
      return false;
    if (made.normal.dot(normal_before) < kLeastCosine * size * normal_before.norm()) return false;
    const double now = shape(made.at);
    return now >= kPoorShape || now >= shape(before);
  }

  void apply() {
    for (const std::uint32_t f : collapse_.old) {
      mesh_.first_sample[local_.faces[f].global] = kNoSample;
      local_.faces[f].box = Box3();
    }
    for (const Collapse::NewFace& made : collapse_.made) {
      CubeMesh::Face& face = local_.faces[made.face];
      face.corners[made.corner] = collapse_.v;
      face.box = made.box;
      mesh_.triangles[face.global][made.corner] = local_.vertices[collapse_.v].global;
    }
    for (const std::uint32_t f : collapse_.old)
      if (local_.faces[f].gone()) mesh_.triangles[local_.faces[f].global] = {kNoTriangle, kNoTriangle, kNoTriangle};
    for (const Collapse::Attached& entry : collapse_.attached) {
      const std::uint32_t triangle = local_.faces[collapse_.made[entry.triangle].face].global;
      mesh_.next_sample[entry.sample] = mesh_.first_sample[triangle];
      mesh_.first_sample[triangle] = entry.sample;
      std::atomic_ref(mesh_.attached_to[entry.sample]).store(triangle, std::memory_order_relaxed);
    }
    merge_ends();
    for (const Collapse::NewFace& made : collapse_.made) local_.grid->add(made.face, made.box);
    stir(collapse_.v);
    local_.for_each_face(collapse_.v, [&](std::uint32_t f, int i) {
      const std::uint32_t neighbour = local_.faces[f].corners[(i + 1) % 3];
      propose(collapse_.v, neighbour);
      if (local_.vertices[neighbour].here) stir(neighbour);
    });
  }

  void merge_ends() {
    const WideQuadric q = quadric_about(collapse_.u, collapse_.v, collapse_.x);
    CubeMesh::Vertex &going = local_.vertices[collapse_.u], &staying = local_.vertices[collapse_.v];
    if (collapse_.v_moves) mesh_.unmoved[staying.global] = 0;
    mesh_.unmoved[going.global] = 0;
    staying.point = mesh_.points[staying.global] = collapse_.x;
    mesh_.quadrics[staying.global] = q.about(Vector3d::Zero());
    ++staying.version;
    going.gone = true;
    local_.merge_corners(collapse_.u, collapse_.v);
  }

  DecimatedMesh& mesh_;
  const FilePoints& file_;
  const DecimationCube& cube_;
  const RunContext& context_;
  CubeMesh local_;
  Collapse collapse_;  ///< the one under way
  CollapseDistance distance_;
  std::vector<Proposal> heap_;
  bool heaped_ = false;
  std::vector<std::uint32_t> ring_;
};

}  // namespace

void decimate_cube(DecimatedMesh& mesh, const FilePoints& file, const DecimationCube& cube,
                   std::span<const std::uint32_t> triangles, const RunContext& context) {
  CubeDecimation(mesh, file, cube, triangles, context).run();
}

}  // namespace hermesh
