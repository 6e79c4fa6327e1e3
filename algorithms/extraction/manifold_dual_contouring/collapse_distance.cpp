#include "algorithms/extraction/manifold_dual_contouring/collapse_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// An edge of the fine mesh is looked at in at most 2^kMostParts parts.
constexpr int kMostParts = 4;
/// Steps along a new edge get no shorter than this, in voxels.
constexpr double kShortestStep = 0.03;

}  // namespace

bool CollapseDistance::attach_samples() {
  collapse_.attached.clear();
  for (Collapse::NewFace& made : collapse_.made) made.reach = TriangleReach(made.at);
  const auto attach_own = [&](std::uint32_t vertex) {
    const std::uint32_t sample = cube_.vertices[vertex].global;
    return !mesh_.unmoved[sample] || attach(sample);
  };
  if (collapse_.v_moves && !attach_own(collapse_.v)) return false;
  for (const std::uint32_t vertex : collapse_.going)
    if (!attach_own(vertex)) return false;
  for (const std::uint32_t f : collapse_.old)
    for (std::uint32_t s = mesh_.first_sample[cube_.faces[f].global]; s != kNoSample; s = mesh_.next_sample[s])
      if (!attach(s)) return false;
  return true;
}

/// To the triangle below or above the sample, or else to any that is near.
bool CollapseDistance::attach(std::uint32_t sample) {
  const Vector3d& p = mesh_.fine->points()[sample];
  const double within = mesh_.tolerance[sample];
  std::uint32_t found = CubeMesh::kNone;
  for (std::uint32_t n = 0; n < collapse_.made.size(); ++n) {
    if (!collapse_.made[n].reach.near(p, within)) continue;
    found = n;
    if (collapse_.made[n].reach.beyond(p).maxCoeff() <= 0) break;
  }
  if (found != CubeMesh::kNone) collapse_.attached.push_back({sample, found});
  return found != CubeMesh::kNone;
}

/// Every edge of the fine mesh at a sample that was attached anew.
bool CollapseDistance::edges_are_near() {
  question_ = cube_.ask();
  for (const std::uint32_t f : collapse_.old) cube_.faces[f].seen = question_;
  for (std::uint32_t i = 0; i < collapse_.attached.size(); ++i)
    std::atomic_ref(mesh_.proposed[collapse_.attached[i].sample]).store(i, std::memory_order_relaxed);
  const FineMesh& fine = *mesh_.fine;
  for (const Collapse::Attached& entry : collapse_.attached)
    for (const std::uint32_t t : fine.around(entry.sample))
      if (!edge_is_near(entry, fine.next(t, entry.sample))) return false;
  return new_edges_are_near();
}

bool CollapseDistance::edge_is_near(const Collapse::Attached& entry, std::uint32_t neighbour) {
  const Collapse::NewFace& mine = collapse_.made[entry.triangle];
  const Part part{mesh_.fine->points()[entry.sample], mesh_.fine->points()[neighbour],
                  std::min(mesh_.tolerance[entry.sample], mesh_.tolerance[neighbour])};
  // What another cube has written here is the number of no entry for this sample.
  const std::uint32_t at = std::atomic_ref(mesh_.proposed[neighbour]).load(std::memory_order_relaxed);
  if (at < collapse_.attached.size() && collapse_.attached[at].sample == neighbour) {
    const std::uint32_t other = collapse_.attached[at].triangle;
    return other == entry.triangle || part_is_near(part, mine.reach, collapse_.made[other].reach, 0);
  }
  const std::uint32_t there = std::atomic_ref(mesh_.attached_to[neighbour]).load(std::memory_order_relaxed);
  const std::uint32_t f = there == kNoTriangle ? CubeMesh::kNone : cube_.find_face(there);
  if (there == kNoTriangle) return edge_to_point_is_near(part, mine, neighbour);
  return f != CubeMesh::kNone && part_is_near(part, mine.reach, TriangleReach(cube_.corners_of(f)), 0);
}

/// To a sample that still is a point of the mesh: on all triangles around it.
bool CollapseDistance::edge_to_point_is_near(const Part& part, const Collapse::NewFace& mine, std::uint32_t sample) {
  const std::uint32_t vertex = cube_.find_vertex(sample);
  if (vertex == CubeMesh::kNone) return false;
  // The new point is a corner of every new face.
  if (vertex == collapse_.v || mine.others[0] == vertex || mine.others[1] == vertex) return true;
  for (const Collapse::NewFace& made : collapse_.made)
    if ((made.others[0] == vertex || made.others[1] == vertex) && part_is_near(part, mine.reach, made.reach, 0))
      return true;
  bool near = false;
  cube_.for_each_face(vertex, [&](std::uint32_t f, int) {
    if (!near && cube_.faces[f].seen != question_)
      near = part_is_near(part, mine.reach, TriangleReach(cube_.corners_of(f)), 0);
  });
  return near;
}

/// The start is near `a` and the end near `b`. Both distances are convex along the part, so it is enough to find a
/// place that is near both; or one near a third triangle, and so on for either half.
bool CollapseDistance::part_is_near(const Part& part, const TriangleReach& a, const TriangleReach& b, int depth) {
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
bool CollapseDistance::triangle_near(const Vector3d& p, double within, TriangleReach& found) {
  for (const Collapse::NewFace& made : collapse_.made)
    if (made.reach.near(p, within)) {
      found = made.reach;
      return true;
    }
  const Box3 box{p - Vector3d::Constant(within), p + Vector3d::Constant(within)};
  bool any = false;
  cube_.grid->visit(
      box, [&](std::uint32_t f) { return cube_.faces[f].gone(); },
      [&](std::uint32_t f) {
        if (any || cube_.faces[f].seen == question_ || !box.overlaps(cube_.faces[f].box)) return;
        const TriangleReach reach(cube_.corners_of(f));
        if (!reach.near(p, within)) return;
        found = reach;
        any = true;
      });
  return any;
}

/// The new point, by the triangles around the sample next to it.
bool CollapseDistance::point_is_near() {
  if (collapse_.attached.empty()) return false;  // no place to start from; rare, for ends that move leave samples behind
  const FineMesh& fine = *mesh_.fine;
  below_ = fine.walk(fine.around(collapse_.attached.front().sample).front(), collapse_.x);
  const bool near = near_fine_around(collapse_.x, 0.0);
  below_x_ = below_;
  return near;
}

/// Whether p, or a ball about it, is near the fine triangle `below_` or one that touches it.
bool CollapseDistance::near_fine_around(const Vector3d& p, double radius) {
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

bool CollapseDistance::near_fine(std::uint32_t t, const Vector3d& p, double radius) const {
  const FineMesh& fine = *mesh_.fine;
  const Triangle& c = fine.triangles()[t];
  const double within = std::min({mesh_.tolerance[c[0]], mesh_.tolerance[c[1]], mesh_.tolerance[c[2]]}) - radius;
  const Vector3d& corner = fine.points()[c[0]];
  constexpr double kRounding = 1e-4;  // of the normals' single precision, over a triangle's size
  if (within < 0 || std::abs(fine.normal(t).cast<double>().dot(p - corner)) > within + kRounding) return false;
  return squared_distance(p, corner, fine.points()[c[1]], fine.points()[c[2]]) <= within * within;
}

/// The new edges. A narrow ridge could rise above the fine mesh and yet have its flanks near every edge of that.
bool CollapseDistance::new_edges_are_near() {
  const std::uint32_t below_x = below_;
  for (const Collapse::NewFace& made : collapse_.made) {
    below_ = below_x;
    const Vector3d& to = cube_.vertices[made.others[0]].point;
    if (!is_near_below(to, made.normal) && !segment_is_near(collapse_.x, to)) return false;
  }
  return true;
}

/// A quick answer for the edge from the new point, which may be no where a longer look says yes: the fine edges right below
/// or above it, one after another, seen along a new triangle's normal.
bool CollapseDistance::is_near_below(const Vector3d& to, const Vector3d& normal) const {
  constexpr int kMostSteps = 256;
  const FineMesh& fine = *mesh_.fine;
  const Vector3d along = to - collapse_.x, across = normal.cross(along);
  const double squared = along.squaredNorm(), height = 1.0 / normal.norm();
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
    // Counter-clockwise seen from outside, so the way leaves by the side that leads from its right to its left.
    int exit = -1;
    for (int i = 0; i < 3; ++i)
      if (i != entry && side[i] < 0 && side[(i + 1) % 3] >= 0) exit = i;
    if (exit < 0) return false;
    const int j = (exit + 1) % 3;
    const double share = side[exit] / (side[exit] - side[j]);
    const Vector3d q = at[exit] + share * (at[j] - at[exit]);
    const double way = q.dot(along) / squared;
    if (way >= 1.0) return true;
    const double within = std::min(mesh_.tolerance[c[exit]], mesh_.tolerance[c[j]]);
    if (std::abs(normal.dot(q - way * along)) * height > within) return false;
    const std::uint32_t next = fine.across(t, exit), corner = c[j];
    if (next == FineMesh::kNone) return false;
    const Triangle& n = fine.triangles()[next];
    entry = n[0] == corner ? 0 : n[1] == corner ? 1 : 2;
    t = next;
  }
  return false;
}

/// In steps, each near one fine triangle as a whole, that are found by a walk over the fine mesh beside the segment.
bool CollapseDistance::segment_is_near(const Vector3d& from, const Vector3d& to) {
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

}  // namespace hermesh
