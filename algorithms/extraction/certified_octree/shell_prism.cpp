#include "algorithms/extraction/certified_octree/shell_prism.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Least cosine of the angle between a pillar and the normal of a triangle at its foot.
constexpr double kLeastPillarCosine = 0.3;

constexpr double kPrismRounding = ShellPrism::kRounding;
using Places = std::array<OverTriangle::Place, 3>;

enum class Walls { outer, inner };

/// The range of heights of a triangle within a prism; empty if the first is the greater one.
struct Heights {
  double lowest = 1, highest = -1;
  bool empty() const { return lowest > highest; }
};

/// Returns the heights of a triangle in the prism that is as wide, or as narrow, as the leans of a side's two
/// pillars allow at each height: each wall is then one plane above the triangle's plane and another below.
/// Parts less than kPrismRounding deep do not count.
Heights heights_in(const ShellPrism& prism, const Places& triangle, Walls walls) {
  Heights heights;
  for (const double up : {1.0, -1.0}) {
    Places places = triangle;
    for (std::size_t side = 0; side < 3; ++side) {
      const auto [least, most] = std::minmax(prism.leans()[side][0], prism.leans()[side][1]);
      const double lean = (walls == Walls::outer) == (up > 0) ? most : least;
      // Sheared by the lean, the wall is upright and the triangle can be clipped as over a triangle.
      for (auto& place : places) place[side] += kPrismRounding - lean * place[3];
    }
    const ClippedTriangle part(places);
    double nearest = prism.height(), farthest = -1;
    for (std::size_t i = 0; i < static_cast<std::size_t>(part.size); ++i) {
      nearest = std::min(nearest, std::max(0.0, up * part.corners[i][3]));
      farthest = std::max(farthest, up * part.corners[i][3]);
    }
    if (farthest < 0 || nearest >= prism.height()) continue;
    const Heights there = up > 0 ? Heights{nearest, farthest} : Heights{-farthest, -nearest};
    heights = heights.empty()
                  ? there
                  : Heights{std::min(heights.lowest, there.lowest), std::max(heights.highest, there.highest)};
  }
  return heights;
}

Places places_of(const ShellPrism& prism, const Corners& triangle) {
  return {prism.over()(triangle[0]), prism.over()(triangle[1]), prism.over()(triangle[2])};
}

}  // namespace

ShellPrism::ShellPrism(const Corners& corners, const std::array<Vector3d, 3>& pillars, double height)
    : over_(corners), pillars_(pillars), height_(height) {
  if (over_.degenerate()) return;
  for (const Vector3d& pillar : pillars_)
    if (!(pillar.dot(over_.normal()) >= kLeastPillarCosine)) return;
  for (std::size_t side = 0; side < 3; ++side)
    for (std::size_t end = 0; end < 2; ++end) leans_[side][end] = lean(pillars_[(side + end) % 3], side);
  lid_ = through(corners, height_);
  bottom_ = through(corners, -height_);
  bottom_.coeffs() = -bottom_.coeffs();
  for (std::size_t i = 0; i < 3; ++i)
    for (const double up : {height_, -height_}) box_.extend(corners[i] + up * pillars_[i]);
  for (const Vector3d& pillar : pillars_) least_lid_ = std::min(least_lid_, pillar.dot(over_.normal()));
  stands_ = is_unfolded(corners) && keeps_its_corners(corners);
}

double ShellPrism::beyond_wall(const OverTriangle::Place& place, std::size_t side) const {
  return place[side] - std::max(leans_[side][0] * place[3], leans_[side][1] * place[3]);
}

double ShellPrism::lean(const Vector3d& pillar, std::size_t side) const {
  return over_.frame().axes.row(static_cast<int>(side)).dot(pillar) / pillar.dot(over_.normal());
}

/// Returns true if the map from points of the triangle and heights to space inverts nothing: the triangle
/// formed by the pillars at any height faces up along each of them. This is a quadratic function of the
/// height, bounded by its coefficients.
bool ShellPrism::is_unfolded(const Corners& corners) const {
  const Vector3d e = corners[1] - corners[0], f = corners[2] - corners[0];
  const Vector3d de = pillars_[1] - pillars_[0], df = pillars_[2] - pillars_[0];
  const Vector3d constant = e.cross(f), linear = e.cross(df) + de.cross(f), square = de.cross(df);
  return std::ranges::all_of(pillars_, [&](const Vector3d& pillar) {
    return constant.dot(pillar) - height_ * std::abs(linear.dot(pillar)) -
               height_ * height_ * std::abs(square.dot(pillar)) >
           kPrismRounding * (e.squaredNorm() + f.squaredNorm());
  });
}

/// Returns true if no pillar leans over the opposite wall.
bool ShellPrism::keeps_its_corners(const Corners& corners) const {
  for (std::size_t i = 0; i < 3; ++i)
    for (const double up : {height_, -height_})
      if (!(beyond_wall(over_(corners[i] + up * pillars_[i]), (i + 1) % 3) < -kPrismRounding)) return false;
  return true;
}

ShellPrism::Plane ShellPrism::through(const Corners& corners, double up) const {
  // Eigen's planes face the side from which the points are clockwise.
  return Plane::Through(corners[0] + up * pillars_[0], corners[2] + up * pillars_[2],
                        corners[1] + up * pillars_[1]);
}

Meeting meet(const ShellPrism& prism, const Corners& triangle, double tolerance) {
  // Boxes exclude most triangles, planes most others; only the rest is clipped.
  const Vector3d lowest = triangle[0].cwiseMin(triangle[1]).cwiseMin(triangle[2]);
  const Vector3d highest = triangle[0].cwiseMax(triangle[1]).cwiseMax(triangle[2]);
  if ((lowest.array() > prism.box().max().array() + kPrismRounding).any() ||
      (highest.array() < prism.box().min().array() - kPrismRounding).any())
    return Meeting::none;
  const Places places = places_of(prism, triangle);
  // Distances of the corners beyond each wall, the lid and the bottom. They and their sums are concave: if
  // one is positive at all corners, it is so on the whole triangle. Sums detect triangles beyond an edge of
  // the prism.
  std::array<std::array<double, 3>, 5> beyond;
  for (std::size_t corner = 0; corner < 3; ++corner) {
    for (std::size_t side = 0; side < 3; ++side)
      beyond[side][corner] = prism.beyond_wall(places[corner], side);
    beyond[3][corner] = prism.lid().signedDistance(triangle[corner]);
    beyond[4][corner] = prism.bottom().signedDistance(triangle[corner]);
  }
  for (std::size_t side = 0; side < 3; ++side)
    if (std::ranges::all_of(beyond[side], [](double by) { return by > -kPrismRounding; }))
      return Meeting::none;
  const auto above = std::ranges::minmax(beyond[3]), below = std::ranges::minmax(beyond[4]);
  if (above.min > kPrismRounding || below.min > kPrismRounding) return Meeting::none;
  const Vector3d normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]);
  const bool faces =
      std::ranges::all_of(prism.pillars(), [&](const Vector3d& pillar) { return normal.dot(pillar) > 0; });
  if (faces && tolerance >= prism.height() && above.max < -kPrismRounding && below.max < -kPrismRounding)
    return Meeting::good;
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t j = i + 1; j < 5; ++j) {
      const auto by = [&](std::size_t corner) { return beyond[i][corner] + beyond[j][corner]; };
      if (std::min({by(0), by(1), by(2)}) > kPrismRounding) return Meeting::none;
    }
  const Heights heights = heights_in(prism, places, Walls::outer);
  if (heights.empty()) return Meeting::none;
  // Heights are along the normal: the lid is at least at least_lid() of the height, and a point within that
  // fraction of the tolerance is within the tolerance along any line.
  const double most = prism.least_lid() * std::min(prism.height(), tolerance) - kPrismRounding;
  return faces && heights.lowest >= -most && heights.highest <= most ? Meeting::good : Meeting::bad;
}

bool reaches_into(const ShellPrism& prism, const Corners& triangle) {
  return !heights_in(prism, places_of(prism, triangle), Walls::inner).empty();
}

}  // namespace hermesh
