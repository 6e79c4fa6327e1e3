#include "reference/winding_oracle.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace hermesh {
namespace {

using Eigen::Vector3d;

double solid_angle(const Corners& triangle, const Vector3d& point) {
  const Vector3d a = triangle[0] - point, b = triangle[1] - point, c = triangle[2] - point;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return 2.0 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
}

/// The crossing of a ray and a triangle: 1 if the ray leaves by the triangle's front, −1 if it enters by the
/// front, 0 if it misses.
int crossing(const Corners& triangle, const Vector3d& point, const Vector3d& direction) {
  const Vector3d a = triangle[0] - point, b = triangle[1] - point, c = triangle[2] - point;
  const double u = direction.dot(a.cross(b)), v = direction.dot(b.cross(c)), w = direction.dot(c.cross(a));
  const bool front = u > 0.0 && v > 0.0 && w > 0.0, back = u < 0.0 && v < 0.0 && w < 0.0;
  if (!front && !back) return 0;
  const double volume = a.dot(b.cross(c));  // its sign is the side of the plane on which the point lies
  return front ? (volume > 0.0 ? 1 : 0) : (volume < 0.0 ? -1 : 0);
}

bool before(const Vector3d& a, const Vector3d& b) {
  return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
}

struct DirectedEdge {
  Vector3d low, high;
  int direction;  ///< 1: from low to high; −1: the other way; sums of these in a boundary
};

/// The boundary of the chain of triangles: edges with the number of their uses from low to high less the
/// number of uses from high to low, where that is not 0.
std::vector<DirectedEdge> boundary_of(const std::vector<Corners>& triangles) {
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * triangles.size());
  for (const Corners& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d &from = t[i], &to = t[(i + 1) % 3];
      if (before(from, to))
        edges.push_back({from, to, 1});
      else
        edges.push_back({to, from, -1});
    }
  std::sort(edges.begin(), edges.end(), [](const DirectedEdge& a, const DirectedEdge& b) {
    return a.low == b.low ? before(a.high, b.high) : before(a.low, b.low);
  });
  std::vector<DirectedEdge> boundary;
  for (const DirectedEdge& edge : edges)
    if (!boundary.empty() && boundary.back().low == edge.low && boundary.back().high == edge.high)
      boundary.back().direction += edge.direction;
    else {
      if (!boundary.empty() && boundary.back().direction == 0) boundary.pop_back();
      boundary.push_back(edge);
    }
  if (!boundary.empty() && boundary.back().direction == 0) boundary.pop_back();
  return boundary;
}

/// Returns true if the volume of the cone from an apex to the triangles is negative for every apex in the
/// box. The volume is linear in the apex, so it suffices to test the box's corners.
bool is_inside_out(const std::vector<Corners>& triangles, const Vector3d& lower, const Vector3d& upper) {
  bool negative = true;
  for (int i = 0; i < 8; ++i) {
    const Vector3d apex(i & 1 ? upper.x() : lower.x(), i & 2 ? upper.y() : lower.y(),
                        i & 4 ? upper.z() : lower.z());
    double volume = 0.0;
    for (const auto& [a, b, c] : triangles) volume += (a - apex).dot((b - apex).cross(c - apex));
    negative = negative && volume < 0.0;
  }
  return negative;
}

}  // namespace

double winding_number(const std::vector<Corners>& triangles, const Vector3d& point) {
  double sum = 0.0;
  for (const Corners& triangle : triangles) sum += solid_angle(triangle, point);
  return sum / (4.0 * std::numbers::pi);
}

WindingOracle::WindingOracle(const DistanceOracle& surface) : surface_(surface) {
  Vector3d lower = surface.triangles()[0][0], upper = lower;
  for (const Corners& t : surface.triangles())
    for (const Vector3d& corner : t) {
      lower = lower.cwiseMin(corner);
      upper = upper.cwiseMax(corner);
    }
  // In general position, so that no sample lies on the cone: holes are often plane and parallel to the grid.
  const Vector3d apex = 0.5 * (lower + upper) + 0.1 * (upper - lower).norm() * DistanceOracle::direction(4);
  for (const DirectedEdge& edge : boundary_of(surface.triangles()))
    cone_.push_back({{apex, edge.low, edge.high}, edge.direction});
  orientation_ = is_inside_out(surface.triangles(), lower, upper) ? -1.0 : 1.0;
}

/// The winding number of the soup less its cone. Two rays that agree are enough; else the most frequent
/// answer of nine counts.
int WindingOracle::closed_winding(const Vector3d& point) const {
  std::map<int, int> votes;
  for (int number = 0; number < 9; ++number) {
    const Vector3d direction = DistanceOracle::direction(number);
    int sum = surface_.signed_crossings(point, number);
    for (const ConeTriangle& t : cone_) sum -= t.multiplicity * crossing(t.corners, point, direction);
    if (++votes[sum] == 2 && number == 1) return sum;
  }
  return std::max_element(votes.begin(), votes.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

double WindingOracle::operator()(const Vector3d& point) const {
  double angles = 0.0;
  for (const ConeTriangle& t : cone_) angles += t.multiplicity * solid_angle(t.corners, point);
  return orientation_ * (closed_winding(point) + angles / (4.0 * std::numbers::pi));
}

bool WindingOracle::bounds_solid(const DistanceOracle& surface, const Vector3d& on_surface) const {
  constexpr double kStep = 1e-3, kSamePoint = 1e-6;  // voxels
  bool found_inside = false, found_outside = false;
  for (const std::uint32_t i : surface.triangles_within(on_surface, kSamePoint)) {
    const auto& [a, b, c] = surface.triangles()[i];
    // A step from an edge or a corner may end on the neighbour; one from a little way into the triangle does
    // not.
    const Vector3d inwards = (a + b + c) / 3.0 - on_surface;
    const double way = std::min(0.5 * inwards.norm(), 10.0 * kStep);
    const Vector3d foot = on_surface + way * inwards.stableNormalized();
    const Vector3d step = std::min(kStep, 0.1 * way) * (b - a).cross(c - a).stableNormalized();
    for (const Vector3d& probe : {Vector3d(foot + step), Vector3d(foot - step)})
      (inside(probe) ? found_inside : found_outside) = true;
    if (found_inside && found_outside) return true;
  }
  return false;
}

bool WindingOracle::differs_across(const Corners& triangle, const Vector3d& on_triangle) const {
  const auto& [a, b, c] = triangle;
  const Vector3d step = 1e-3 * (b - a).cross(c - a).stableNormalized();
  return inside(on_triangle + step) != inside(on_triangle - step);
}

namespace {

double longest_edge(const Corners& t) {
  return std::max({(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()});
}

void add_boundary(const Corners& t, const WindingOracle& solid, double finest,
                  std::vector<Corners>& boundary) {
  const Vector3d middle = (t[0] + t[1] + t[2]) / 3.0;
  const bool bounds = solid.differs_across(t, middle);
  const bool small = longest_edge(t) < finest;
  const auto as_middle = [&](const Vector3d& corner) {
    return solid.differs_across(t, 0.95 * corner + 0.05 * middle) == bounds;
  };
  if (small || std::all_of(t.begin(), t.end(), as_middle)) {
    if (bounds) boundary.push_back(t);
    return;
  }
  const Vector3d ab = 0.5 * (t[0] + t[1]), bc = 0.5 * (t[1] + t[2]), ca = 0.5 * (t[2] + t[0]);
  for (const Corners& part :
       {Corners{t[0], ab, ca}, Corners{ab, t[1], bc}, Corners{ca, bc, t[2]}, Corners{ab, bc, ca}})
    add_boundary(part, solid, finest, boundary);
}

}  // namespace

std::vector<Corners> solid_boundary(const DistanceOracle& surface, const WindingOracle& solid, double finest,
                                    const RunContext& context) {
  std::vector<std::vector<Corners>> parts(surface.triangles().size());
  tbb::parallel_for(std::size_t(0), parts.size(), [&](std::size_t i) {
    context.check();
    add_boundary(surface.triangles()[i], solid, finest, parts[i]);
  });
  std::vector<Corners> boundary;
  for (const std::vector<Corners>& part : parts) boundary.insert(boundary.end(), part.begin(), part.end());
  return boundary;
}

}  // namespace hermesh
