#include "algorithms/extraction/manifold_dual_contouring/distance_certificate.h"

#include <algorithm>
#include <cmath>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/triangle_reach.h"
#include "algorithms/voxelization/triangle_tree.h"

namespace hermesh {
namespace {

static_assert(kNoTriangle == TriangleTree::kNone);

using Eigen::Vector3d;

/// What the bound may be exceeded by, voxels: so that pieces need not get smaller than this, and for the single precision
/// of the search.
constexpr double kSlack = 0.005;

using Piece = std::array<Vector3d, 3>;
/// By corner: a triangle of the other mesh that is likely to be near, or kNone.
using Hints = std::array<std::uint32_t, 3>;
constexpr std::uint32_t kNone = TriangleTree::kNone;

/// A mesh in index space that answers what is near.
class Surface {
 public:
  Surface(const std::vector<Vector3d>& points, const std::vector<Triangle>& triangles)
      : points_(to_float(points)), triangles_(triangles), tree_(points_, triangles_, 1.0) {}

  NearestTriangle nearest(const Vector3d& p, double within) const { return tree_.nearest(p, within * within); }
  bool near(const Piece& piece, std::uint32_t triangle, double within) const {
    const TriangleReach reach(corners(triangle));
    return reach.near(piece[0], within) && reach.near(piece[1], within) && reach.near(piece[2], within);
  }
  Corners corners(std::uint32_t t) const { return {tree_.corner(t, 0), tree_.corner(t, 1), tree_.corner(t, 2)}; }

 private:
  static std::vector<Eigen::Vector3f> to_float(const std::vector<Vector3d>& points) {
    std::vector<Eigen::Vector3f> result(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) result[i] = points[i].cast<float>();
    return result;
  }
  std::vector<Eigen::Vector3f> points_;
  const std::vector<Triangle>& triangles_;
  TriangleTree tree_;
};

/// Where to cut the edge from a to b, as a share of it: where it leaves the prism over the triangle near a, so that what
/// remains on that side is near one triangle; in the middle if there is no such place.
double cut(const Vector3d& a, const Vector3d& b, std::uint32_t hint, const Surface& other) {
  double share = 0.5;
  if (hint == kNone) return share;
  const TriangleReach reach(other.corners(hint));
  const Vector3d at_a = reach.beyond(a), at_b = reach.beyond(b);
  double exit = 1.0;
  for (int i = 0; i < 3; ++i)
    if (at_b[i] > 0) exit = std::min(exit, at_a[i] / (at_a[i] - at_b[i]));
  return exit > 0.1 && exit < 0.9 ? exit : share;
}

/// Whether a piece is near another surface as a whole; `bound(triangle)` says how near it has to be to that one.
template <class Bound>
bool is_near(const Piece& piece, const Hints& hints, const Surface& other, double widest, const Bound& bound) {
  for (int i = 0; i < 3; ++i) {
    const bool again = (i > 0 && hints[i] == hints[0]) || (i > 1 && hints[i] == hints[1]);
    if (hints[i] != kNone && !again && other.near(piece, hints[i], bound(hints[i]))) return true;
  }
  const Vector3d middle = (piece[0] + piece[1] + piece[2]) / 3.0;
  const NearestTriangle found = other.nearest(middle, widest);
  if (found.triangle == kNone) return false;
  const double distance = std::sqrt(found.squared), within = bound(found.triangle);
  if (distance > within) return false;
  double radius = 0;
  for (const Vector3d& p : piece) radius = std::max(radius, (p - middle).norm());
  if (distance + radius <= within + kSlack || other.near(piece, found.triangle, within)) return true;

  int longest = 0;
  double length = -1;
  for (int i = 0; i < 3; ++i) {
    const double squared = (piece[(i + 1) % 3] - piece[i]).squaredNorm();
    if (squared > length) length = squared, longest = i;
  }
  const int i = longest, j = (longest + 1) % 3, k = (longest + 2) % 3;
  constexpr double kLong = 2.0;  // voxels: longer edges pass over many triangles, and are halved
  const double share = length > kLong * kLong ? 0.5 : cut(piece[i], piece[j], hints[i], other);
  const Vector3d at = piece[i] + share * (piece[j] - piece[i]);
  return is_near({piece[i], at, piece[k]}, {hints[i], found.triangle, hints[k]}, other, widest, bound) &&
         is_near({at, piece[j], piece[k]}, {found.triangle, hints[j], hints[k]}, other, widest, bound);
}

Piece piece_of(const std::vector<Vector3d>& points, const Triangle& t) {
  return {points[t[0]], points[t[1]], points[t[2]]};
}

/// What need not be searched because of what decimate() saw to.
class Shortcut {
 public:
  explicit Shortcut(const DecimatedMesh& mesh) : mesh_(mesh), fine_(*mesh.fine), normals_(mesh.triangles.size()) {
    for (std::size_t t = 0; t < normals_.size(); ++t) {
      const Piece p = piece_of(mesh.points, mesh.triangles[t]);
      normals_[t] = (p[1] - p[0]).cross(p[2] - p[0]).stableNormalized().cast<float>();
    }
  }

  /// Its corners are attached to triangles with a corner in common that face as it does.
  bool of_fine(const Triangle& corners, std::uint32_t t) const {
    std::uint32_t first = kNone;
    for (const std::uint32_t c : corners)
      if (const std::uint32_t a = mesh_.attached_to[c]; a != kNone) {
        if (fine_.normal(t).dot(normals_[a]) < kFacing || (first != kNone && !touch(mesh_.triangles[first], a))) return false;
        first = a;
      }
    if (first == kNone) return false;
    for (const std::uint32_t c : corners)
      if (mesh_.attached_to[c] == kNone && !has(mesh_.triangles[first], c)) return false;
    return true;
  }

 private:
  static constexpr float kFacing = 0.5f;
  static bool has(const Triangle& t, std::uint32_t corner) { return t[0] == corner || t[1] == corner || t[2] == corner; }
  bool touch(const Triangle& a, std::uint32_t b) const {
    for (const std::uint32_t corner : mesh_.triangles[b])
      if (has(a, corner)) return true;
    return false;
  }

  const DecimatedMesh& mesh_;
  const FineMesh& fine_;
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace

DistanceCertificate certify_distance(const DecimatedMesh& mesh, std::span<const float> tolerance, RunContext& context) {
  Stage stage(context, "certify");
  const FineMesh& fine = *mesh.fine;
  const Surface coarse_surface(mesh.points, mesh.triangles), fine_surface(fine.points(), fine.triangles());
  const Shortcut shortcut(mesh);
  const auto least = [&](const Triangle& t) {
    return double(std::min({tolerance[t[0]], tolerance[t[1]], tolerance[t[2]]}));
  };
  double widest = 0;
  for (const float t : tolerance) widest = std::max(widest, double(t));

  std::vector<std::uint8_t> fine_fails(fine.triangles().size()), coarse_fails(mesh.triangles.size());
  parallel_blocks(fine_fails.size(), context, [&](std::size_t t) {
    const Triangle& corners = fine.triangles()[t];
    if (shortcut.of_fine(corners, static_cast<std::uint32_t>(t))) return;
    const double within = least(corners);
    fine_fails[t] = !is_near(piece_of(fine.points(), corners),
                             {mesh.attached_to[corners[0]], mesh.attached_to[corners[1]], mesh.attached_to[corners[2]]},
                             coarse_surface, within, [&](std::uint32_t) { return within; });
  });
  parallel_blocks(coarse_fails.size(), context, [&](std::size_t t) {
    coarse_fails[t] = !is_near(piece_of(mesh.points, mesh.triangles[t]), {kNone, kNone, kNone}, fine_surface, widest,
                               [&](std::uint32_t f) { return least(fine.triangles()[f]); });
  });

  DistanceCertificate result;
  for (std::size_t t = 0; t < fine_fails.size(); ++t) {
    if (!fine_fails[t]) continue;
    ++result.fine_triangles;
    for (const std::uint32_t p : fine.triangles()[t]) result.samples.push_back(p);
  }
  for (std::size_t t = 0; t < coarse_fails.size(); ++t) {
    if (!coarse_fails[t]) continue;
    ++result.coarse_triangles;
    for (const std::uint32_t p : mesh.triangles[t]) result.samples.push_back(p);
    for (std::uint32_t s = mesh.first_sample[t]; s != kNoSample; s = mesh.next_sample[s]) result.samples.push_back(s);
  }
  std::sort(result.samples.begin(), result.samples.end());
  result.samples.erase(std::unique(result.samples.begin(), result.samples.end()), result.samples.end());
  return result;
}

}  // namespace hermesh
