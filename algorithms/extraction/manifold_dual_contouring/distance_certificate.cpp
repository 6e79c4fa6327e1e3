#include "algorithms/extraction/manifold_dual_contouring/distance_certificate.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_overlay.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_reach.h"
#include "algorithms/voxelization/triangle_tree.h"

namespace hermesh {
namespace {

static_assert(kNoTriangle == TriangleTree::kNone);

using Eigen::Vector3d;

/// What the bound may be exceeded by, voxels: so that pieces need not get smaller than this.
constexpr double kSlack = 0.005;
/// Part of it for a tolerance of 0: what rounding makes of the distance of a triangle to itself.
constexpr double kRounding = 1e-6;

/// One of the two meshes, as the other's triangles are laid over it.
class Target {
 public:
  explicit Target(const FineMesh& mesh)
      : mesh_(mesh), overlays_([&mesh] { return TriangleOverlay(mesh.triangles().size()); }) {}

  const FineMesh& mesh() const { return mesh_; }
  TriangleOverlay& overlay() { return overlays_.local(); }

  /// For nearest(); apart, because it is seldom asked for.
  void plant_tree() {
    points_.resize(mesh_.points().size());
    for (std::size_t i = 0; i < points_.size(); ++i) points_[i] = mesh_.points()[i].cast<float>();
    for (std::uint32_t t = 0; t < mesh_.triangles().size(); ++t)
      if (mesh_.triangles()[t][0] != FineMesh::kNone) {
        numbers_.push_back(t);
        triangles_.push_back(mesh_.triangles()[t]);
      }
    tree_.emplace(points_, triangles_, 1.0);
  }
  NearestTriangle nearest(const Vector3d& p, double within) const {
    NearestTriangle found = tree_->nearest(p, within * within);
    if (found.triangle != TriangleTree::kNone) found.triangle = numbers_[found.triangle];
    return found;
  }

 private:
  const FineMesh& mesh_;
  tbb::enumerable_thread_specific<TriangleOverlay> overlays_;
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::uint32_t> numbers_;  ///< of the triangles in the tree
  std::vector<Triangle> triangles_;
  std::optional<TriangleTree> tree_;
};

bool reaches(const FineMesh& mesh, std::uint32_t triangle, const Corners& piece, double within) {
  const TriangleReach reach(mesh.corners(triangle));
  return reach.near(piece[0], within) && reach.near(piece[1], within) && reach.near(piece[2], within);
}

/// Whether a piece is near the target as a whole: right above or below it, near one triangle of it, or small enough for
/// its middle to tell; else each half of it by itself. `bound(triangle)` says how near it has to be to that one, `widest`
/// is the most that it says.
template <class Bound>
bool is_near(const Corners& piece, Target& target, double widest, const Bound& bound) {
  const Vector3d middle = (piece[0] + piece[1] + piece[2]) / 3.0;
  const NearestTriangle found = target.nearest(middle, widest + kSlack);
  if (found.triangle == kNoTriangle) return false;
  // Once more in double precision: that of the search is single.
  const Corners nearest = target.mesh().corners(found.triangle);
  const double distance = std::sqrt(squared_distance(middle, nearest[0], nearest[1], nearest[2]));
  const double within = bound(found.triangle);
  if (distance > within) return false;
  double radius = 0;
  for (const Vector3d& p : piece) radius = std::max(radius, (p - middle).norm());
  if (distance + radius <= within + kSlack || reaches(target.mesh(), found.triangle, piece, within) ||
      target.overlay().is_near(piece, target.mesh(), found.triangle, bound))
    return true;

  int i = 0;
  for (int side = 1; side < 3; ++side)
    if ((piece[(side + 1) % 3] - piece[side]).squaredNorm() > (piece[(i + 1) % 3] - piece[i]).squaredNorm()) i = side;
  const int j = (i + 1) % 3, k = (i + 2) % 3;
  const Vector3d half = 0.5 * (piece[i] + piece[j]);
  return is_near({piece[i], half, piece[k]}, target, widest, bound) &&
         is_near({half, piece[j], piece[k]}, target, widest, bound);
}

/// What a certificate has to look at.
struct Scope {
  std::vector<std::uint8_t> fine, coarse;
};

Scope everything(const DecimatedMesh& mesh) {
  Scope scope{std::vector<std::uint8_t>(mesh.fine->triangles().size(), 1), {}};
  scope.coarse.resize(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) scope.coarse[t] = mesh.alive(t);
  return scope;
}

/// Coarse triangles that have changed, and fine ones with a sample on one of these, with their neighbours.
Scope changes(const DecimatedMesh& mesh, const DecimatedMesh& before) {
  Scope scope;
  scope.coarse.resize(mesh.triangles.size());
  std::vector<std::uint8_t> samples(mesh.fine->points().size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle &now = mesh.triangles[t], &then = before.triangles[t];
    if (!mesh.alive(t)) continue;
    bool same = now == then;
    for (const std::uint32_t p : now) same = same && mesh.points[p] == before.points[p];
    scope.coarse[t] = !same;
    if (same) continue;
    for (const std::uint32_t p : now) samples[p] = 1;
    for (std::uint32_t s = mesh.first_sample[t]; s != kNoSample; s = mesh.next_sample[s]) samples[s] = 1;
  }
  scope.fine.resize(mesh.fine->triangles().size());
  for (const bool last : {false, true}) {
    for (std::size_t t = 0; t < scope.fine.size(); ++t)
      for (const std::uint32_t s : mesh.fine->triangles()[t]) scope.fine[t] |= samples[s];
    if (last) break;
    for (std::size_t t = 0; t < scope.fine.size(); ++t)
      if (scope.fine[t])
        for (const std::uint32_t s : mesh.fine->triangles()[t]) samples[s] = 1;
  }
  return scope;
}

/// Numbers of the triangles that `start(t, covers)` finds no place for, where covers(face) tries one, and that are not
/// near the target piece by piece either; `open` says which triangles are asked about.
template <class Bound, class Start>
std::vector<std::uint32_t> far_ones(const FineMesh& mesh, std::vector<std::uint8_t> open, Target& target, double widest,
                                    RunContext& context, const Bound& bound, const Start& start) {
  parallel_blocks(open.size(), context, [&](std::size_t t) {
    if (!open[t]) return;
    const auto number = static_cast<std::uint32_t>(t);
    const Corners piece = mesh.corners(number);
    const auto within = [&](std::uint32_t face) { return bound(number, face); };
    open[t] = !start(number, [&](std::uint32_t face) { return target.overlay().is_near(piece, target.mesh(), face, within); });
  });
  std::vector<std::uint32_t> left;
  for (std::uint32_t t = 0; t < open.size(); ++t)
    if (open[t]) left.push_back(t);
  if (left.empty()) return left;
  target.plant_tree();
  parallel_blocks(left.size(), context, [&](std::size_t i) {
    const std::uint32_t t = left[i];
    open[t] = !is_near(mesh.corners(t), target, widest, [&](std::uint32_t face) { return bound(t, face); });
  });
  std::erase_if(left, [&](std::uint32_t t) { return !open[t]; });
  return left;
}

}  // namespace

DistanceCertificate certify_distance(const DecimatedMesh& mesh, std::span<const float> tolerance,
                                     const DecimatedMesh* before, RunContext& context) {
  const Scope scope = before ? changes(mesh, *before) : everything(mesh);
  const FineMesh& fine = *mesh.fine;
  const FineMesh coarse(mesh.points, mesh.triangles);
  Target to_fine(fine), to_coarse(coarse);
  const auto least = [&](std::uint32_t t) {
    const Triangle& corners = fine.triangles()[t];
    return std::max(kRounding, double(std::min({tolerance[corners[0]], tolerance[corners[1]], tolerance[corners[2]]})));
  };
  double widest = kRounding;
  for (const float t : tolerance) widest = std::max(widest, double(t));

  const std::vector<std::uint32_t> far_from_coarse = far_ones(
      fine, scope.fine, to_coarse, widest, context, [&](std::uint32_t t, std::uint32_t) { return least(t); },
      [&](std::uint32_t t, auto&& covers) {
        std::uint32_t last = kNoTriangle;
        for (const std::uint32_t sample : fine.triangles()[t]) {
          const std::uint32_t attached = mesh.attached_to[sample];
          const std::uint32_t face = attached != kNoTriangle ? attached : coarse.around(sample).front();
          if (face != last && covers(face)) return true;
          last = face;
        }
        return false;
      });
  const std::vector<std::uint32_t> far_from_fine = far_ones(
      coarse, scope.coarse, to_fine, widest, context, [&](std::uint32_t, std::uint32_t f) { return least(f); },
      [&](std::uint32_t t, auto&& covers) {
        const Corners at = coarse.corners(t);
        const Vector3d middle = (at[0] + at[1] + at[2]) / 3.0;
        const std::uint32_t sample = mesh.first_sample[t];
        if (sample != kNoSample && covers(fine.walk(fine.around(sample).front(), middle))) return true;
        return covers(fine.walk(mesh.below[coarse.triangles()[t][0]], middle));
      });

  DistanceCertificate result;
  result.fine_triangles = far_from_coarse.size();
  result.coarse_triangles = far_from_fine.size();
  for (const std::uint32_t t : far_from_coarse)
    for (const std::uint32_t p : fine.triangles()[t]) result.samples.push_back(p);
  for (const std::uint32_t t : far_from_fine) {
    for (const std::uint32_t p : mesh.triangles[t]) result.samples.push_back(p);
    for (std::uint32_t s = mesh.first_sample[t]; s != kNoSample; s = mesh.next_sample[s]) result.samples.push_back(s);
  }
  std::sort(result.samples.begin(), result.samples.end());
  result.samples.erase(std::unique(result.samples.begin(), result.samples.end()), result.samples.end());
  return result;
}

}  // namespace hermesh
