#include "algorithms/extraction/certified_collapse/relaxation.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_collapse/quadric.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Rounds over all points in which the equations of one sweep are solved. (Twice as many change the distance
/// by less than a hundredth.)
constexpr int kRounds = 10;
/// How strongly a point is held where a round has it, as a share of the weights around it: along a plane or a
/// crease nothing else says where it is to be.
constexpr double kHold = 1e-2;
/// Longest way of a point in one sweep, as a share of its shortest edge.
constexpr double kLongestWay = 0.5;
/// How near to its tolerance a point may go. The optimum lies beyond it on round surfaces: collapses go on
/// until the middles of triangles are a tolerance away, and the points should then be farther on the other
/// side.
constexpr double kNearTolerance = 0.95;
/// Parts of its way that a point may stop at, where the proof does not let it go on.
constexpr double kParts[] = {0.25, 0.5, 1.0};

/// A place of the fine mesh with the share of its area that it stands for, and the triangle under it.
struct Sample {
  std::uint32_t face = FineMesh::kNone;
  float weight = 0;             ///< square voxels
  Eigen::Vector3f barycentric;  ///< of the nearest place within the triangle, roughly
  float height = 0;             ///< above the triangle's plane, voxels
};

/// The sum of weight × (barycentric · heights of the corners − height)² over a triangle's samples, but for
/// its constant.
struct TriangleSum {
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  Vector3d heights = Vector3d::Zero();
};

/// What keeps a point near the fine mesh, seen along that mesh's normal.
struct Ceiling {
  std::uint32_t below = 0;  ///< the fine triangle
  Vector3d up;
  double height = 0, limit = 0;
};

/// The sweeps, over places of the merged mesh's points.
class Relaxation {
 public:
  Relaxation(const MergeForest& forest, const MergedMesh& merged, const FineMesh& fine,
             std::span<const float> tolerance, std::span<const std::uint8_t> pinned,
             const RunContext& context)
      : forest_(forest),
        merged_(merged),
        fine_(fine),
        tolerance_(tolerance),
        pinned_(pinned),
        context_(context),
        samples_(fine.points().size() + fine.triangles().size()),
        ceilings_(merged.leaders.size()),
        places_(merged.mesh->points()) {
    weigh_samples();
  }

  void sweep() {
    std::optional<FineMesh> moved;
    if (sweeps_++ > 0) moved.emplace(places_, merged_.mesh->triangles(), context_);
    const FineMesh& mesh = moved ? *moved : *merged_.mesh;
    lay_samples(mesh);
    sum_up(mesh);
    find_ceilings();
    std::vector<Vector3d> ways(places_.size(), Vector3d::Zero());
    for (int round = 0; round < kRounds; ++round) {
      context_.check();
      // One after another, each with what the ones before it have become: Gauss and Seidel.
      for (std::uint32_t v = 0; v < ways.size(); ++v)
        if (!is_pinned(v)) improve(mesh, v, ways);
    }
    for (std::uint32_t v = 0; v < ways.size(); ++v) places_[v] += no_longer_than_allowed(mesh, v, ways[v]);
  }

  bool is_pinned(std::uint32_t v) const { return pinned_[merged_.leaders[v]] != 0; }
  const std::vector<Vector3d>& places() const { return places_; }

 private:
  void weigh_samples();
  std::uint32_t fine_point(std::size_t sample) const;
  Vector3d place(std::size_t sample) const;
  void lay_samples(const FineMesh& mesh);
  void sum_up(const FineMesh& mesh);
  void find_ceilings();
  void improve(const FineMesh& mesh, std::uint32_t v, std::vector<Vector3d>& ways) const;
  Vector3d no_longer_than_allowed(const FineMesh& mesh, std::uint32_t v, const Vector3d& way) const;

  const MergeForest& forest_;
  const MergedMesh& merged_;
  const FineMesh& fine_;
  const std::span<const float> tolerance_;
  const std::span<const std::uint8_t> pinned_;
  const RunContext& context_;
  std::vector<Sample> samples_;  ///< the fine points, then the middles of the fine triangles
  std::vector<TriangleSum> sums_;
  std::vector<Vector3d> normals_;
  std::vector<Ceiling> ceilings_;  ///< by point of the merged mesh
  std::vector<Vector3d> places_;
  int sweeps_ = 0;
};

/// Gives each sample its weight. Three quarters of a triangle's area at its middle and a twelfth at each
/// corner is a rule of degree two, so that squared distances of flat triangles to planes are summed up
/// exactly.
void Relaxation::weigh_samples() {
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

/// A fine point at the sample or beside it.
std::uint32_t Relaxation::fine_point(std::size_t sample) const {
  const std::size_t points = fine_.points().size();
  return sample < points ? static_cast<std::uint32_t>(sample) : fine_.triangles()[sample - points][0];
}

Vector3d Relaxation::place(std::size_t sample) const {
  const std::size_t points = fine_.points().size();
  if (sample < points) return fine_.points()[sample];
  const Corners at = fine_.corners(static_cast<std::uint32_t>(sample - points));
  return (at[0] + at[1] + at[2]) / 3.0;
}

/// Finds the triangle under each sample. A wrong one spoils a place and no promise, so a walk will do, from
/// where the sample's point went or where the sample was found last.
void Relaxation::lay_samples(const FineMesh& mesh) {
  parallel_blocks(samples_.size(), context_, [&](std::size_t i) {
    Sample& sample = samples_[i];
    if (!(sample.weight > 0)) return;
    if (sample.face == FineMesh::kNone) {
      const std::uint32_t point = merged_.number[forest_.leader(fine_point(i))];
      if (point == MergeForest::kNone)
        return;  // all that hangs together here has vanished; the proof brings it back
      sample.face = mesh.around(point).front();
    }
    const Vector3d p = place(i);
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

/// Sums up what the samples say of each triangle; in one thread, so that the sums are the same for every
/// number of them.
void Relaxation::sum_up(const FineMesh& mesh) {
  sums_.assign(mesh.triangles().size(), {});
  for (const Sample& sample : samples_) {
    if (sample.face == FineMesh::kNone) continue;
    const Vector3d share = sample.barycentric.cast<double>();
    sums_[sample.face].products += double(sample.weight) * share * share.transpose();
    sums_[sample.face].heights += double(sample.weight) * double(sample.height) * share;
  }
  normals_.resize(sums_.size());
  parallel_blocks(normals_.size(), context_, [&](std::size_t t) {
    normals_[t] = mesh.normal(static_cast<std::uint32_t>(t)).cast<double>();
  });
}

void Relaxation::find_ceilings() {
  parallel_blocks(ceilings_.size(), context_, [&](std::size_t v) {
    Ceiling& ceiling = ceilings_[v];
    const std::uint32_t start = sweeps_ > 1 ? ceiling.below : fine_.around(merged_.leaders[v]).front();
    double squared;
    ceiling.below = fine_.nearest_around(fine_.walk(start, places_[v]), places_[v], squared);
    const Triangle& c = fine_.triangles()[ceiling.below];
    ceiling.up = fine_.normal(ceiling.below).cast<double>();
    ceiling.height = ceiling.up.dot(places_[v] - fine_.points()[c[0]]);
    ceiling.limit = kNearTolerance * double(std::min({tolerance_[c[0]], tolerance_[c[1]], tolerance_[c[2]]}));
  });
}

/// Solves for one point's way, with the ways of all others as they are.
void Relaxation::improve(const FineMesh& mesh, std::uint32_t v, std::vector<Vector3d>& ways) const {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Vector3d b = Vector3d::Zero();
  for (const std::uint32_t t : mesh.around(v)) {
    const Triangle& c = mesh.triangles()[t];
    const int i = c[0] == v ? 0 : c[1] == v ? 1 : 2, j = (i + 1) % 3, k = (i + 2) % 3;
    const TriangleSum& sum = sums_[t];
    const Vector3d& n = normals_[t];
    // The height of a triangle's corner goes with its way along the normal.
    a += sum.products(i, i) * n * n.transpose();
    b += n *
         (sum.heights[i] - sum.products(i, j) * n.dot(ways[c[j]]) - sum.products(i, k) * n.dot(ways[c[k]]));
  }
  const double hold = kHold * a.trace();
  if (!(hold > 0)) return;
  a.diagonal().array() += hold;
  Vector3d& way = ways[v];
  way = a.ldlt().solve(b + hold * way);
  const Ceiling& ceiling = ceilings_[v];
  const double height = ceiling.height + ceiling.up.dot(way);
  way += (std::clamp(height, -ceiling.limit, ceiling.limit) - height) * ceiling.up;
}

Vector3d Relaxation::no_longer_than_allowed(const FineMesh& mesh, std::uint32_t v,
                                            const Vector3d& way) const {
  double shortest = std::numeric_limits<double>::max();
  for (const std::uint32_t t : mesh.around(v))
    shortest = std::min(shortest, (mesh.points()[mesh.next(t, v)] - places_[v]).norm());
  const double length = way.norm(), longest = kLongestWay * shortest;
  return length > longest ? Vector3d(longest / length * way) : way;
}

}  // namespace

void propose_relaxation(MergeForest& forest, const MergedMesh& merged, const FineMesh& fine,
                        std::span<const float> tolerance, std::span<const std::uint8_t> pinned, int sweeps,
                        const FilePoints& file, RunContext& context) {
  if (sweeps <= 0) return;
  Relaxation relaxation(forest, merged, fine, tolerance, pinned, context);
  for (int i = 0; i < sweeps; ++i) relaxation.sweep();
  // All first parts come before all second ones: of the sets at a failure the last is split first, and so the
  // longest way.
  for (const double part : kParts)
    for (std::uint32_t v = 0; v < merged.leaders.size(); ++v) {
      if (relaxation.is_pinned(v)) continue;
      const Vector3d& before = merged.mesh->points()[v];
      const Vector3d place = file.rounded(before + part * (relaxation.places()[v] - before));
      const std::uint32_t p = merged.leaders[v], set = forest.set_of(p);
      const Vector3d last = set == MergeForest::kNone ? fine.points()[p] : forest.node(set).place;
      if (place == last) continue;
      WideQuadric moved;
      moved.add(set == MergeForest::kNone ? quadric_at(fine, p) : forest.node(set).quadric, last - place);
      forest.join(p, {.first = p,
                      .merges = true,
                      .moves = true,
                      .place = place,
                      .quadric = moved.about(Vector3d::Zero())});
    }
  forest.settle();
}

}  // namespace hermesh
