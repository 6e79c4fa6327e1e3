#include "validation/features.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "validation/geometry/distance.h"
#include "validation/geometry/welded_surface.h"

namespace hermesh::validation {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
// A hexagonal prism (60°) has edges, an octagonal one (45°) is a cylinder in coarse steps; between the two a
// line has to be drawn.
constexpr double kMostBlendTurning = 50.0 * kDegree;
constexpr double kSubstantial = 1.0 / 3.0;
constexpr double kMostWidthRatio = 3.0;
constexpr double kEndOfRow = 0.9;
constexpr double kLeastParallel = 0.70710678;  // cos 45°

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

double diagonal_of(const TriangleSoup& soup) {
  Box box;
  for (const Triangle& t : soup.triangles)
    for (std::uint32_t p : t) box.add(soup.points[p]);
  return box.diagonal();
}

// A kept edge at one of its ends, looking away from it; or an excluded one.
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
  BlendFinder blends(surface, dihedral, diagonal_of(reference));
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
  const double spacing = diagonal_of(reference) / 4000.0;
  FeatureDistances result;
  result.edges = std::int64_t(features.edges.size());
  result.corners = std::int64_t(features.corners.size());
  result.edges_excluded = features.edges_excluded;
  std::vector<WeightedPoint> samples;
  for (const auto& [a, b] : features.edges) {
    const double length = (b - a).norm();
    result.edge_length += length;
    const double pieces = std::max(4.0, std::ceil(length / spacing));
    // Points of no weight: the ends count for the maximum alone.
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
