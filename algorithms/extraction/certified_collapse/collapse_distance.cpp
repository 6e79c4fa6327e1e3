#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "algorithms/extraction/certified_collapse/domain_mesh.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Steps along a new edge get no shorter than this, in voxels.
constexpr double kShortestStep = 0.03;

}  // namespace

bool CollapseDistance::passes() { return attach_samples() && point_is_near() && new_edges_are_near(); }

/// Attaches to a new triangle within its tolerance every sample of the faces that are removed or change, and
/// the ends that move, unless they have moved before and are samples of a face already. So each vertex of the
/// fine mesh has the new mesh near it.
bool CollapseDistance::attach_samples() {
  reach_.clear();
  for (const Collapse::NewFace& made : collapse_.made) reach_.emplace_back(made.at);
  const auto attach_own = [&](std::uint32_t vertex) {
    const std::uint32_t global = domain_.vertices[vertex].global;
    return !mesh_.unmoved[global] || attach(mesh_.leaders[global]);
  };
  if (collapse_.v_moves && !attach_own(collapse_.v)) return false;
  if (!attach_own(collapse_.going)) return false;
  for (const std::uint32_t f : collapse_.old)
    for (std::uint32_t s = mesh_.first_sample[domain_.faces[f].global]; s != FineMesh::kNone;
         s = mesh_.next_sample[s])
      if (!attach(s)) return false;
  return true;
}

/// Attaches a sample to the new triangle directly below or above it, otherwise to any that is near.
bool CollapseDistance::attach(std::uint32_t sample) {
  const Vector3d& p = mesh_.input.fine.points()[sample];
  const double within = mesh_.input.tolerance[sample];
  std::uint32_t found = DomainMesh::kNone;
  for (std::uint32_t n = 0; n < collapse_.made.size(); ++n) {
    if (!reach_[n].near(p, within)) continue;
    found = n;
    if (reach_[n].beyond(p).maxCoeff() <= 0) break;
  }
  if (found != DomainMesh::kNone) collapse_.attached.push_back({sample, found});
  return found != DomainMesh::kNone;
}

/// Returns true if the new vertex is near the fine mesh, searched from a triangle around an adjacent sample.
bool CollapseDistance::point_is_near() {
  if (collapse_.attached.empty()) return false;  // no start; rare, since ends that move leave samples behind
  const FineMesh& fine = mesh_.input.fine;
  below_ = fine.walk(fine.around(collapse_.attached.front().sample).front(), collapse_.x);
  return near_fine_around(collapse_.x, 0.0);
}

/// Returns true if p, or a ball about it, is near the fine triangle `below_` or one that touches it.
bool CollapseDistance::near_fine_around(const Vector3d& p, double radius) {
  if (near_fine(below_, p, radius)) return true;
  const FineMesh& fine = mesh_.input.fine;
  for (const std::uint32_t corner : fine.triangles()[below_])
    for (const std::uint32_t t : fine.around(corner))
      if (t != below_ && near_fine(t, p, radius)) {
        below_ = t;
        return true;
      }
  return false;
}

/// Returns true if a ball about p lies within the tolerance of a fine triangle, the least of its corners'.
bool CollapseDistance::near_fine(std::uint32_t t, const Vector3d& p, double radius) const {
  const FineMesh& fine = mesh_.input.fine;
  const Triangle& c = fine.triangles()[t];
  const double within =
      std::min({mesh_.input.tolerance[c[0]], mesh_.input.tolerance[c[1]], mesh_.input.tolerance[c[2]]}) -
      radius;
  const Vector3d& corner = fine.points()[c[0]];
  constexpr double kRounding = 1e-4;  // of the normals' single precision, over a triangle's size
  if (within < 0 || std::abs(fine.normal(t).cast<double>().dot(p - corner)) > within + kRounding)
    return false;
  return squared_distance(p, corner, fine.points()[c[1]], fine.points()[c[2]]) <= within * within;
}

/// Returns true if the new edges are near the fine mesh. Samples are not sufficient: a narrow ridge could
/// rise above the fine mesh although its flanks are near every edge of that.
bool CollapseDistance::new_edges_are_near() {
  const std::uint32_t below_x = below_;
  for (const Collapse::NewFace& made : collapse_.made) {
    below_ = below_x;
    // The faces surround the new vertex, so the first of the other corners of each gives every edge once.
    const Vector3d& to = domain_.vertices[made.others[0]].point;
    if (!is_near_below(to, made.normal) && !segment_is_near(collapse_.x, to)) return false;
  }
  return true;
}

/// A fast test of the edge from the new vertex, which may reject what segment_is_near() accepts: visits the
/// fine edges directly below or above it, seen along a new triangle's normal.
bool CollapseDistance::is_near_below(const Vector3d& to, const Vector3d& normal) const {
  constexpr int kMostSteps = 256;
  const FineMesh& fine = mesh_.input.fine;
  const Vector3d along = to - collapse_.x, across = normal.cross(along);
  const double squared = along.squaredNorm(), height = 1.0 / normal.norm();
  // All relative to the new vertex. `across` is perpendicular to the plane through the edge and the normal:
  // its sign gives the side of the edge on which a fine vertex is seen.
  std::uint32_t t = below_;
  int entry = -1;
  for (int step = 0; step < kMostSteps; ++step) {
    const Triangle& c = fine.triangles()[t];
    std::array<Vector3d, 3> at;
    std::array<double, 3> side;
    for (int i = 0; i < 3; ++i) {
      at[i] = fine.points()[c[i]] - collapse_.x;
      side[i] = across.dot(at[i]);
    }
    // Counter-clockwise seen from outside, so the path leaves by the side from its right to its left.
    int exit = -1;
    for (int i = 0; i < 3; ++i)
      if (i != entry && side[i] < 0 && side[(i + 1) % 3] >= 0) exit = i;
    if (exit < 0) return false;
    const int j = (exit + 1) % 3;
    const double share = side[exit] / (side[exit] - side[j]);
    const Vector3d q = at[exit] + share * (at[j] - at[exit]);
    // The position along the edge where it passes over the fine one, and its height there. Between two such
    // positions the fine mesh is flat and the edge straight, so nothing in between is farther.
    const double way = q.dot(along) / squared;
    if (way >= 1.0) return true;
    const double within = std::min(mesh_.input.tolerance[c[exit]], mesh_.input.tolerance[c[j]]);
    if (std::abs(normal.dot(q - way * along)) * height > within) return false;
    const std::uint32_t next = fine.side_across(t, exit);
    if (next == FineMesh::kNone) return false;
    t = next / 3;
    entry = static_cast<int>(next % 3);
  }
  return false;
}

/// Returns true if a segment is near the fine mesh: in steps, each near one fine triangle as a whole, found
/// by a walk over the fine mesh along the segment.
bool CollapseDistance::segment_is_near(const Vector3d& from, const Vector3d& to) {
  const double length = (to - from).norm();
  double done = 0, step = 1.0;
  while (done < length) {
    step = std::min(step, length - done);
    const Vector3d begin = from + (done / length) * (to - from),
                   end = from + ((done + step) / length) * (to - from);
    // The distance to a triangle is convex: if both ends of the step are within the bound, all of it is.
    if (near_fine(below_, begin, 0.0) && near_fine(below_, end, 0.0)) {
      done += step;
      step *= 2;
      continue;
    }
    const Vector3d middle = 0.5 * (begin + end);
    below_ = mesh_.input.fine.walk(below_, middle);
    if ((near_fine(below_, begin, 0.0) && near_fine(below_, end, 0.0)) ||
        near_fine_around(middle, 0.5 * step)) {
      done += step;
      step *= 2;
    } else if ((step *= 0.5) < kShortestStep) {
      return false;
    }
  }
  return true;
}

}  // namespace hermesh
