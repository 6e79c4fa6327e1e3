// Relaxation of a merged mesh. Collapses put a vertex where it is nearest to the *planes* that it represents
// (quadric.h). On a curved surface the triangles between such vertices lie on one side of it: on a paraboloid
// with the triangles of a regular lattice the root mean square distance is twice that of vertices a little
// farther out. Here all vertices are moved to reduce the sum of squared distances of the fine mesh to the
// triangles; each sweep projects the fine mesh onto the triangles again.
#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_collapse/merge_proposals.h"
#include "algorithms/extraction/certified_collapse/quadric.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Gauss-Seidel iterations over all vertices in one sweep. (Twice as many change the distance by less than a
/// hundredth.)
constexpr int kRounds = 10;
/// Weight that holds a vertex in its position of the last iteration, as a share of the weights around it:
/// along a plane or a crease nothing else determines the position.
constexpr double kHold = 1e-2;
/// Longest move of a vertex in one sweep, as a share of its shortest edge.
constexpr double kLongestMove = 0.5;
/// Limit of a vertex's distance, in tolerances. The optimum lies beyond it on round surfaces: collapses go on
/// until the middles of triangles are a tolerance away, and the vertices should then be farther on the other
/// side.
constexpr double kNearTolerance = 0.95;
/// Parts of its path at which a vertex may stop if the proof does not admit more.
constexpr double kParts[] = {0.25, 0.5, 1.0};

/// A position on the fine mesh with the share of its area that it represents, and the triangle under it.
struct Sample {
  std::uint32_t face = FineMesh::kNone;
  float weight = 0;             ///< square voxels
  Eigen::Vector3f barycentric;  ///< approximate, of the nearest position within the triangle
  float height = 0;             ///< above the triangle's plane, voxels
};

/// The sum of weight × (barycentric · heights of the corners − height)² over a triangle's samples, without
/// its constant.
struct TriangleSum {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  Vector3d heights = Vector3d::Zero();
};

/// The constraint that keeps a vertex near the fine mesh, along that mesh's normal.
struct Ceiling {
  std::uint32_t below = 0;  ///< the fine triangle
  Vector3d up;
  double height = 0, limit = 0;
};

/// The sweeps, over positions of the merged mesh's vertices.
class Relaxation {
 public:
  Relaxation(const MergeForest& forest, const MergedMesh& merged, const DecimationInput& input,
             const RunContext& context)
      : forest_(forest),
        merged_(merged),
        in_(input),
        fine_(input.fine),
        context_(context),
        samples_(fine_.points().size() + fine_.triangles().size()),
        ceilings_(merged.leaders.size()),
        places_(merged.mesh->points()) {
    // Three quarters of a triangle's area at its middle and a twelfth at each corner is a quadrature rule of
    // degree two, exact for squared distances of flat triangles to planes.
    const std::size_t points = fine_.points().size();
    for (std::uint32_t t = 0; t < fine_.triangles().size(); ++t) {
      const Triangle& c = fine_.triangles()[t];
      if (c[0] == FineMesh::kNone) continue;
      const Corners at = fine_.corners(t);
      const auto area = static_cast<float>(0.5 * (at[1] - at[0]).cross(at[2] - at[0]).norm());
      samples_[points + t].weight = 0.75f * area;
      for (const std::uint32_t p : c) samples_[p].weight += area / 12.0f;
    }
  }

  void sweep() {
    std::optional<FineMesh> moved;
    if (sweeps_++ > 0) moved.emplace(places_, merged_.mesh->triangles(), context_);
    const FineMesh& mesh = moved ? *moved : *merged_.mesh;
    project_samples(mesh);
    sum_up(mesh);
    find_ceilings();
    std::vector<Vector3d> moves(places_.size(), Vector3d::Zero());
    for (int round = 0; round < kRounds; ++round) {
      context_.check();
      for (std::uint32_t v = 0; v < moves.size(); ++v)
        if (!is_pinned(v)) improve(mesh, v, moves);
    }
    for (std::uint32_t v = 0; v < moves.size(); ++v) places_[v] += limited(mesh, v, moves[v]);
  }

  bool is_pinned(std::uint32_t v) const { return in_.pinned[merged_.leaders[v]] != 0; }
  const std::vector<Vector3d>& places() const { return places_; }

 private:
  Vector3d position(std::size_t sample) const {
    const std::size_t points = fine_.points().size();
    if (sample < points) return fine_.points()[sample];
    const Corners at = fine_.corners(static_cast<std::uint32_t>(sample - points));
    return (at[0] + at[1] + at[2]) / 3.0;
  }

  /// Finds the triangle under each sample. A wrong one impairs a position, but no guarantee, so a walk is
  /// sufficient, from the vertex that the sample was merged into or from the last triangle.
  void project_samples(const FineMesh& mesh) {
    const std::size_t points = fine_.points().size();
    parallel_blocks(samples_.size(), context_, [&](std::size_t i) {
      Sample& sample = samples_[i];
      if (!(sample.weight > 0)) return;
      if (sample.face == FineMesh::kNone) {
        const std::uint32_t at =
            i < points ? static_cast<std::uint32_t>(i) : fine_.triangles()[i - points][0];
        const std::uint32_t point = merged_.number[forest_.leader(at)];
        if (point == MergeForest::kNone) return;  // the component has vanished; the proof restores it
        sample.face = mesh.around(point).front();
      }
      const Vector3d p = position(i);
      double squared;
      sample.face = mesh.nearest_around(mesh.walk(sample.face, p), p, squared);
      const Corners c = mesh.corners(sample.face);
      const Vector3d e = c[0] - c[2], f = c[1] - c[2], d = p - c[2], normal = e.cross(f);
      const double size = normal.squaredNorm();
      if (!(size > 0)) {
        sample.barycentric.setConstant(1.0f / 3.0f);
        sample.height = 0;
        return;
      }
      const double u = std::clamp(normal.dot(d.cross(f)) / size, 0.0, 1.0),
                   v = std::clamp(normal.dot(e.cross(d)) / size, 0.0, 1.0 - u);
      sample.barycentric = Eigen::Vector3f(float(u), float(v), float(1.0 - u - v));
      sample.height = static_cast<float>(d.dot(normal) / std::sqrt(size));
    });
  }

  /// Sums over the samples of each triangle, in one thread, so that the order of the summands is fixed.
  void sum_up(const FineMesh& mesh) {
    sums_.assign(mesh.triangles().size(), {});
    for (const Sample& sample : samples_) {
      if (sample.face == FineMesh::kNone) continue;
      const Vector3d share = sample.barycentric.cast<double>();
      sums_[sample.face].products += double(sample.weight) * share * share.transpose();
      sums_[sample.face].heights += double(sample.weight) * double(sample.height) * share;
    }
  }

  void find_ceilings() {
    parallel_blocks(ceilings_.size(), context_, [&](std::size_t v) {
      Ceiling& ceiling = ceilings_[v];
      const std::uint32_t start = sweeps_ > 1 ? ceiling.below : fine_.around(merged_.leaders[v]).front();
      double squared;
      ceiling.below = fine_.nearest_around(fine_.walk(start, places_[v]), places_[v], squared);
      const Triangle& c = fine_.triangles()[ceiling.below];
      ceiling.up = fine_.normal(ceiling.below).cast<double>();
      ceiling.height = ceiling.up.dot(places_[v] - fine_.points()[c[0]]);
      ceiling.limit =
          kNearTolerance * double(std::min({in_.tolerance[c[0]], in_.tolerance[c[1]], in_.tolerance[c[2]]}));
    });
  }

  /// Solves for one vertex's move, with the current moves of all others.
  void improve(const FineMesh& mesh, std::uint32_t v, std::vector<Vector3d>& moves) const {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Vector3d b = Vector3d::Zero();
    for (const std::uint32_t t : mesh.around(v)) {
      const Triangle& c = mesh.triangles()[t];
      const int i = c[0] == v ? 0 : c[1] == v ? 1 : 2, j = (i + 1) % 3, k = (i + 2) % 3;
      const TriangleSum& sum = sums_[t];
      const Vector3d n = mesh.normal(t).cast<double>();
      // The height of a triangle's corner is its move along the normal.
      a += sum.products(i, i) * n * n.transpose();
      b += n * (sum.heights[i] - sum.products(i, j) * n.dot(moves[c[j]]) -
                sum.products(i, k) * n.dot(moves[c[k]]));
    }
    const double hold = kHold * a.trace();
    if (!(hold > 0)) return;
    a.diagonal().array() += hold;
    Vector3d& move = moves[v];
    move = a.ldlt().solve(b + hold * move);
    const Ceiling& ceiling = ceilings_[v];
    const double height = ceiling.height + ceiling.up.dot(move);
    move += (std::clamp(height, -ceiling.limit, ceiling.limit) - height) * ceiling.up;
  }

  Vector3d limited(const FineMesh& mesh, std::uint32_t v, const Vector3d& move) const {
    double shortest = std::numeric_limits<double>::max();
    for (const std::uint32_t t : mesh.around(v))
      shortest = std::min(shortest, (mesh.points()[mesh.next(t, v)] - places_[v]).norm());
    const double length = move.norm(), longest = kLongestMove * shortest;
    return length > longest ? Vector3d(longest / length * move) : move;
  }

  const MergeForest& forest_;
  const MergedMesh& merged_;
  const DecimationInput& in_;
  const FineMesh& fine_;
  const RunContext& context_;
  std::vector<Sample> samples_;  ///< the fine vertices, then the middles of the fine triangles
  std::vector<TriangleSum> sums_;
  std::vector<Ceiling> ceilings_;  ///< by vertex of the merged mesh
  std::vector<Vector3d> places_;
  int sweeps_ = 0;
};

/// Joins the set of a vertex of the merged mesh to one that has moved to `place`.
void move(MergeForest& forest, std::uint32_t p, const Vector3d& place, const DecimationInput& input) {
  const std::uint32_t set = forest.set_of(p);
  const bool single = set == MergeForest::kNone;
  const Vector3d last = single ? input.fine.points()[p] : forest.node(set).place;
  if (place == last) return;
  WideQuadric moved;
  moved.add(single ? quadric_at(input.fine, p) : forest.node(set).quadric, last - place);
  forest.join(
      p,
      {.first = p, .merges = true, .moves = true, .place = place, .quadric = moved.about(Vector3d::Zero())});
}

/// Largest distance of propose_members(), voxels.
constexpr double kNearMember = 0.02;

}  // namespace

void propose_relaxation(MergeForest& forest, const MergedMesh& merged, const DecimationInput& input,
                        int sweeps, const RunContext& context) {
  if (sweeps <= 0) return;
  Relaxation relaxation(forest, merged, input, context);
  for (int i = 0; i < sweeps; ++i) relaxation.sweep();
  // All first parts come before all second ones: of the sets at a failure the last is split first, and so the
  // longest move.
  for (const double part : kParts)
    for (std::uint32_t v = 0; v < merged.leaders.size(); ++v) {
      if (relaxation.is_pinned(v)) continue;
      const Vector3d& before = merged.mesh->points()[v];
      const Vector3d place = input.file.rounded(before + part * (relaxation.places()[v] - before));
      if (input.admits(place)) move(forest, merged.leaders[v], place, input);
    }
  forest.settle();
}

void propose_members(MergeForest& forest, const MergedMesh& merged, const DecimationInput& input,
                     const RunContext& context) {
  std::vector<std::uint32_t> nearest(merged.leaders.size(), FineMesh::kNone);
  parallel_blocks(nearest.size(), context, [&](std::size_t v) {
    const std::uint32_t leader = merged.leaders[v], set = forest.set_of(leader);
    // Collapses may have merged it into another vertex since.
    if (set == MergeForest::kNone || forest.leader(leader) != leader || input.pinned[leader]) return;
    double squared = kNearMember * kNearMember;
    for (const std::uint32_t p : forest.members(set)) {
      const double here = (input.fine.points()[p] - forest.node(set).place).squaredNorm();
      if (here < squared) squared = here, nearest[v] = p;
    }
  });
  for (std::size_t v = 0; v < nearest.size(); ++v) {
    const std::uint32_t p = nearest[v];
    if (p == FineMesh::kNone) continue;
    const auto missed = std::ranges::lower_bound(input.missed, p, {}, &MissedTarget::point);
    const bool found = missed != input.missed.end() && missed->point == p;
    move(forest, merged.leaders[v], found ? missed->place : input.fine.points()[p], input);
  }
  forest.settle();
}

}  // namespace hermesh
