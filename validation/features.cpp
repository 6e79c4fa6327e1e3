#include "validation/features.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "validation/geometry/distance.h"

namespace hermesh::validation {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
// Between a hexagonal prism (60°), which has edges, and an octagonal one (45°), a cylinder in coarse steps.
constexpr double kMostBlendTurning = 50.0 * kDegree;
constexpr double kSubstantial = 1.0 / 3.0;
constexpr double kMostWidthRatio = 3.0;
constexpr double kEndOfRow = 0.9;
constexpr double kLeastParallel = 0.70710678;  // cos 45°

// A surface of triangles with welded points, without triangles of no area.
class WeldedSurface {
 public:
  struct Edge {
    std::array<std::uint32_t, 2> points, triangles;
    // The angle between the normals of the two triangles, in radians, positive where the surface is convex;
    // 0 ≤ |turning| ≤ π.
    double turning;
  };

  explicit WeldedSurface(const TriangleSoup& soup) {
    MeshFile mesh = welded_triangles(soup);
    points_ = std::move(mesh.points);
    triangles_ = std::move(mesh.triangles);
    edge_of_.assign(triangles_.size(), {kNoEdge, kNoEdge, kNoEdge});
    for_each_edge(sorted_sides(triangles_), [&](std::span<const TriangleSide> sides) {
      if (sides.size() != 2) return;
      Edge edge{{sides[0].low, sides[0].high}, {sides[0].triangle, sides[1].triangle}, 0.0};
      edge.turning = turning(edge);
      for (const TriangleSide& side : sides)
        edge_of_[side.triangle][side.corner] = std::uint32_t(edges_.size());
      edges_.push_back(edge);
    });
  }

  // Returns the edges with exactly two triangles, by their points in increasing order.
  const std::vector<Edge>& edges() const { return edges_; }
  const Eigen::Vector3d& point(std::uint32_t p) const { return points_[p]; }
  Eigen::Vector3d direction(const Edge& e) const {
    return (points_[e.points[1]] - points_[e.points[0]]).normalized();
  }

  struct Arrival {
    std::size_t edge;
    double distance;
  };
  // Walks from a point near the middle of an edge into its first or second triangle (`side` 0 or 1), at right
  // angles to the edge and straight on over the unfolded surface, across edges that turn by less than
  // `least_turning`. Returns the first edge that turns by more; nothing at a border, beyond `farthest`, or
  // once the walk has crossed as many triangles as there are.
  std::optional<Arrival> walk(std::size_t edge, int side, double least_turning, double farthest) const;

 private:
  static constexpr std::uint32_t kNoEdge = ~std::uint32_t(0);

  double turning(const Edge& e) const;
  Eigen::Vector3d normal(std::uint32_t triangle) const {
    const Triangle& t = triangles_[triangle];
    return area_vector({points_[t[0]], points_[t[1]], points_[t[2]]}).normalized();
  }

  std::vector<Eigen::Vector3d> points_;
  std::vector<Triangle> triangles_;
  std::vector<Edge> edges_;
  std::vector<std::array<std::uint32_t, 3>>
      edge_of_;  // of each triangle's side k to k + 1; kNoEdge at a boundary
};

double WeldedSurface::turning(const Edge& e) const {
  const auto runs_along = [&](const Triangle& t) {
    for (int k = 0; k < 3; ++k)
      if (t[k] == e.points[0] && t[(k + 1) % 3] == e.points[1]) return true;
    return false;
  };
  const bool first_along = runs_along(triangles_[e.triangles[0]]);
  const bool second_along = runs_along(triangles_[e.triangles[1]]);
  const Eigen::Vector3d first = normal(e.triangles[0]);
  // If both run in the same direction, one of them is flipped.
  const Eigen::Vector3d second = (first_along == second_along ? -1.0 : 1.0) * normal(e.triangles[1]);
  const Eigen::Vector3d along = (first_along ? 1.0 : -1.0) * direction(e);
  return std::atan2(first.cross(second).dot(along), first.dot(second));
}

std::optional<WeldedSurface::Arrival> WeldedSurface::walk(std::size_t start, int side, double least_turning,
                                                          double farthest) const {
  // Off the middle, so that the walk does not pass through the vertices of a regular grid.
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
    // Leave through the nearer of the two other sides.
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

class BlendFinder {
 public:
  BlendFinder(const WeldedSurface& surface, double dihedral, double farthest)
      : surface_(surface), dihedral_(dihedral), farthest_(farthest), excluded_(surface.edges().size(), 0) {}

  bool candidate(std::size_t e) const { return std::abs(surface_.edges()[e].turning) > dihedral_; }
  bool excluded(std::size_t e) const { return excluded_[e] != 0; }

  void find() {
    std::vector<std::size_t> moderate;
    for (std::size_t e = 0; e < excluded_.size(); ++e)
      if (candidate(e) && std::abs(surface_.edges()[e].turning) <= kMostBlendTurning) moderate.push_back(e);
    std::vector<std::array<Neighbour, 2>> neighbours(moderate.size());
    const tbb::blocked_range<std::size_t> all(0, moderate.size(), 64);
    tbb::parallel_for(all, [&](const tbb::blocked_range<std::size_t>& range) {
      for (std::size_t i = range.begin(); i < range.end(); ++i)
        neighbours[i] = {neighbour(moderate[i], 0), neighbour(moderate[i], 1)};
    });
    for (std::size_t i = 0; i < moderate.size(); ++i) excluded_[moderate[i]] = within_row(neighbours[i]);
    std::vector<std::size_t> ends;
    for (std::size_t i = 0; i < moderate.size(); ++i)
      if (!excluded(moderate[i]) && ends_row(moderate[i], neighbours[i])) ends.push_back(moderate[i]);
    for (std::size_t e : ends) excluded_[e] = 1;
  }

 private:
  using Neighbour = std::optional<WeldedSurface::Arrival>;

  Neighbour neighbour(std::size_t e, int side) const {
    const WeldedSurface::Edge& edge = surface_.edges()[e];
    const Neighbour found = surface_.walk(e, side, kSubstantial * std::abs(edge.turning), farthest_);
    if (!found) return std::nullopt;
    const WeldedSurface::Edge& other = surface_.edges()[found->edge];
    const bool same_way = (edge.turning > 0.0) == (other.turning > 0.0);
    const double parallel = std::abs(surface_.direction(edge).dot(surface_.direction(other)));
    if (!same_way || std::abs(other.turning) > kMostBlendTurning || parallel < kLeastParallel)
      return std::nullopt;
    return found;
  }

  static bool within_row(const std::array<Neighbour, 2>& n) {
    if (!n[0] || !n[1]) return false;
    const auto [near, far] = std::minmax(n[0]->distance, n[1]->distance);
    return far <= kMostWidthRatio * near;
  }

  bool ends_row(std::size_t e, const std::array<Neighbour, 2>& neighbours) const {
    const double least = kEndOfRow * std::abs(surface_.edges()[e].turning);
    return std::any_of(neighbours.begin(), neighbours.end(), [&](const Neighbour& n) {
      return n && excluded(n->edge) && std::abs(surface_.edges()[n->edge].turning) >= least;
    });
  }

  const WeldedSurface& surface_;
  double dihedral_, farthest_;
  std::vector<std::uint8_t> excluded_;
};

// A sharp or excluded edge at one of its ends, with the direction away from that end.
struct EdgeEnd {
  std::uint32_t point;
  bool excluded;
  Eigen::Vector3d away;
};

std::vector<Eigen::Vector3d> find_corners(const WeldedSurface& surface, std::vector<EdgeEnd> ends,
                                          double dihedral) {
  std::stable_sort(ends.begin(), ends.end(), [](const EdgeEnd& a, const EdgeEnd& b) {
    return a.point != b.point ? a.point < b.point : a.excluded < b.excluded;
  });
  std::vector<Eigen::Vector3d> corners;
  for (std::size_t i = 0, past; i < ends.size(); i = past) {
    std::size_t kept = 0;
    for (past = i; past < ends.size() && ends[past].point == ends[i].point; ++past)
      kept += !ends[past].excluded;
    const bool blend = kept < past - i;
    const bool turns = kept == 2 && !blend && -ends[i].away.dot(ends[i + 1].away) < std::cos(dihedral);
    if (kept >= 3 || turns) corners.push_back(surface.point(ends[i].point));
  }
  return corners;
}

}  // namespace

SharpFeatures find_sharp_features(const TriangleSoup& reference, double dihedral_degrees) {
  const double dihedral = dihedral_degrees * kDegree;
  const WeldedSurface surface(reference);
  BlendFinder blends(surface, dihedral, reference.box().diagonal());
  blends.find();
  SharpFeatures features;
  std::vector<EdgeEnd> ends;
  for (std::size_t e = 0; e < surface.edges().size(); ++e) {
    if (!blends.candidate(e)) continue;
    const WeldedSurface::Edge& edge = surface.edges()[e];
    const Eigen::Vector3d direction = surface.direction(edge);
    const bool excluded = blends.excluded(e);
    ends.push_back({edge.points[0], excluded, direction});
    ends.push_back({edge.points[1], excluded, -direction});
    features.edges_excluded += excluded;
    if (!excluded) features.edges.push_back({surface.point(edge.points[0]), surface.point(edge.points[1])});
  }
  features.corners = find_corners(surface, std::move(ends), dihedral);
  return features;
}

FeatureDistances feature_distances(const TriangleSoup& reference, const TriangleTree& mesh,
                                   double dihedral_degrees, RunContext& context) {
  const SharpFeatures features = find_sharp_features(reference, dihedral_degrees);
  context.check();
  const double spacing = reference.box().diagonal() / 4000.0;
  FeatureDistances result;
  result.edges = std::int64_t(features.edges.size());
  result.corners = std::int64_t(features.corners.size());
  result.edges_excluded = features.edges_excluded;
  std::vector<WeightedPoint> samples;
  for (const auto& [a, b] : features.edges) {
    const double length = (b - a).norm();
    result.edge_length += length;
    const double pieces = std::max(4.0, std::ceil(length / spacing));
    // The ends have no weight: they count only for the maximum.
    samples.push_back({a, 0.0});
    for (double i = 0.5; i < pieces; i += 1.0)
      samples.push_back({a + (i / pieces) * (b - a), length / pieces});
    samples.push_back({b, 0.0});
  }
  result.edge_to_mesh = point_distances(samples, mesh, context);
  std::vector<WeightedPoint> corners;
  for (const Eigen::Vector3d& c : features.corners) corners.push_back({c, 1.0});
  result.corner_to_mesh = point_distances(corners, mesh, context);
  return result;
}

}  // namespace hermesh::validation
