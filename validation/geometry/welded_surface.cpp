#include "validation/geometry/welded_surface.h"

#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "validation/geometry/exact_predicates.h"

namespace hermesh::validation {
namespace {

bool precedes(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  if (a.x() != b.x()) return a.x() < b.x();
  return a.y() != b.y() ? a.y() < b.y() : a.z() < b.z();
}

// One side of a triangle, by its ends in increasing order.
struct TriangleSide {
  std::uint32_t low, high, triangle;
  int corner;
  bool operator<(const TriangleSide& o) const {
    if (low != o.low) return low < o.low;
    return high != o.high ? high < o.high : triangle < o.triangle;
  }
};

}  // namespace

WeldedSurface::WeldedSurface(const TriangleSoup& soup) {
  weld(soup);
  connect();
}

void WeldedSurface::weld(const TriangleSoup& soup) {
  std::vector<std::uint32_t> order(soup.points.size()), number(soup.points.size());
  std::iota(order.begin(), order.end(), 0u);
  tbb::parallel_sort(order.begin(), order.end(), [&soup](std::uint32_t a, std::uint32_t b) {
    const Eigen::Vector3d &p = soup.points[a], &q = soup.points[b];
    return p == q ? a < b : precedes(p, q);
  });
  for (std::uint32_t p : order) {
    if (points_.empty() || points_.back() != soup.points[p]) points_.push_back(soup.points[p]);
    number[p] = std::uint32_t(points_.size() - 1);
  }
  for (std::size_t t = 0; t < soup.triangles.size(); ++t) {
    if (collinear(soup.corners(t))) continue;
    const Triangle& c = soup.triangles[t];
    triangles_.push_back({number[c[0]], number[c[1]], number[c[2]]});
  }
}

void WeldedSurface::connect() {
  std::vector<TriangleSide> sides;
  sides.reserve(3 * triangles_.size());
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), t, k});
    }
  tbb::parallel_sort(sides.begin(), sides.end());
  edge_of_.assign(triangles_.size(), {kNoEdge, kNoEdge, kNoEdge});
  for (std::size_t i = 0, end; i < sides.size(); i = end) {
    for (end = i; end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high;)
      ++end;
    if (end - i != 2) continue;
    Edge edge{{sides[i].low, sides[i].high}, {sides[i].triangle, sides[i + 1].triangle}, 0.0};
    edge.turning = turning(edge);
    for (std::size_t s = i; s < end; ++s)
      edge_of_[sides[s].triangle][sides[s].corner] = std::uint32_t(edges_.size());
    edges_.push_back(edge);
  }
}

Eigen::Vector3d WeldedSurface::normal(std::uint32_t triangle) const {
  const Triangle& t = triangles_[triangle];
  return (points_[t[1]] - points_[t[0]]).cross(points_[t[2]] - points_[t[0]]).normalized();
}

double WeldedSurface::turning(const Edge& e) const {
  const auto runs_along = [&](const Triangle& t) {
    for (int k = 0; k < 3; ++k)
      if (t[k] == e.points[0] && t[(k + 1) % 3] == e.points[1]) return true;
    return false;
  };
  const bool first_along = runs_along(triangles_[e.triangles[0]]);
  const bool second_along = runs_along(triangles_[e.triangles[1]]);
  const Eigen::Vector3d first = normal(e.triangles[0]);
  // Where both run the same way, one of them is turned over.
  const Eigen::Vector3d second = (first_along == second_along ? -1.0 : 1.0) * normal(e.triangles[1]);
  const Eigen::Vector3d along = (first_along ? 1.0 : -1.0) * direction(e);
  return std::atan2(first.cross(second).dot(along), first.dot(second));
}

std::optional<WeldedSurface::Arrival> WeldedSurface::walk(std::size_t start, int side, double least_turning,
                                                          double farthest) const {
  // A little off the middle, so that on a regular grid the walk does not run through the points.
  constexpr double kStart = 0.4567;
  const Edge& from = edges_[start];
  Eigen::Vector3d position = (1.0 - kStart) * points_[from.points[0]] + kStart * points_[from.points[1]];
  Eigen::Vector3d along = direction(from);
  double cosine = 0.0, sine = 1.0;  // of the heading: along the edge that is crossed, and into the triangle
  std::size_t edge = start;
  std::uint32_t triangle = from.triangles[side];
  double distance = 0.0;
  for (std::size_t steps = 0; steps < triangles_.size() && distance < farthest; ++steps) {
    // The heading in this triangle's plane.
    const Triangle& t = triangles_[triangle];
    int entry = 0;
    while (edge_of_[triangle][entry] != edge) ++entry;
    const Eigen::Vector3d apex = points_[t[(entry + 2) % 3]] - points_[t[entry]];
    const Eigen::Vector3d inward = (apex - apex.dot(along) * along).normalized();
    const Eigen::Vector3d heading = cosine * along + sine * inward;
    // It leaves by that one of the two other sides which it comes to first.
    double reach = std::numeric_limits<double>::infinity();
    int exit = -1;
    for (int k : {(entry + 1) % 3, (entry + 2) % 3}) {
      const Eigen::Vector3d base = points_[t[k]], span = points_[t[(k + 1) % 3]] - base;
      const Eigen::Vector3d outward = span.cross(normal(triangle));
      const double speed = outward.dot(heading);
      const double s = speed > 0.0 ? std::max(0.0, outward.dot(base - position) / speed)
                                   : std::numeric_limits<double>::infinity();
      if (s < reach) reach = s, exit = k;
    }
    if (exit < 0) return std::nullopt;
    position += reach * heading;
    distance += reach;
    edge = edge_of_[triangle][exit];
    if (edge == kNoEdge) return std::nullopt;
    const Edge& crossed = edges_[edge];
    if (std::abs(crossed.turning) >= least_turning) return Arrival{edge, distance};
    along = direction(crossed);
    cosine = heading.dot(along);
    sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
    triangle = crossed.triangles[crossed.triangles[0] == triangle ? 1 : 0];
  }
  return std::nullopt;
}

}  // namespace hermesh::validation
