#include "algorithms/core/polygon_cut.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hermesh {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Twice the area that the polygon encloses, as a vector; about its first corner, so that rounding is
/// relative to its size.
Vector3d newell(std::span<const Vector3d> corners) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 2; i < corners.size(); ++i)
    sum += (corners[i - 1] - corners[0]).cross(corners[i] - corners[0]);
  return sum;
}

/// Twice the area, positive if counter-clockwise.
double area(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

class Ring {
 public:
  explicit Ring(std::span<const Vector3d> corners)
      : places_(corners.size()), next_(corners.size()), before_(corners.size()) {
    // Along the axis that the polygon faces most, counter-clockwise: nothing but signs of areas matters
    // below.
    const Vector3d normal = newell(corners);
    int axis;
    normal.cwiseAbs().maxCoeff(&axis);
    const int x = (axis + 1) % 3, y = (axis + 2) % 3;
    for (std::uint32_t i = 0; i < corners.size(); ++i) {
      const Vector3d from = corners[i] - corners[0];
      places_[i] = normal[axis] < 0 ? Vector2d(from[y], from[x]) : Vector2d(from[x], from[y]);
      next_[i] = i + 1 == corners.size() ? 0 : i + 1;
      before_[next_[i]] = i;
    }
    double extent = 0;
    for (const Vector2d& p : places_) extent = std::max(extent, p.cwiseAbs().maxCoeff());
    constexpr double kRounding = 1e-13;
    flat_ = kRounding * extent * extent;
    for (std::uint32_t i = 0; i < corners.size(); ++i)
      if (area_at(i) <= 0) reflex_.push_back(i);
  }

  std::vector<Triangle> clip() {
    std::vector<Triangle> triangles;
    std::uint32_t at = 0;
    std::size_t left = places_.size(), failed = 0;
    bool flat_ones = false;  // corners in a straight line may go, for there is no ear
    while (left > 3) {
      if (flat_ones ? std::abs(area_at(at)) <= flat_ : is_ear(at)) {
        triangles.push_back({before_[at], at, next_[at]});
        // Not the neighbour next, which would make a fan of slivers.
        at = next_[cut(at)];
        --left;
        failed = 0;
        flat_ones = false;
        continue;
      }
      at = next_[at];
      if (++failed < left) continue;
      if (flat_ones) return {};
      flat_ones = true;
      failed = 0;
    }
    if (area_at(at) < -flat_) return {};
    triangles.push_back({before_[at], at, next_[at]});
    return triangles;
  }

 private:
  double area_at(std::uint32_t i) const { return area(places_[before_[i]], places_[i], places_[next_[i]]); }

  bool is_ear(std::uint32_t at) const {
    if (area_at(at) <= 0) return false;
    const Vector2d &a = places_[before_[at]], &b = places_[at], &c = places_[next_[at]];
    return std::ranges::none_of(reflex_, [&](std::uint32_t i) {
      const Vector2d& p = places_[i];
      if (i == before_[at] || i == next_[at]) return false;
      // Where the border comes back to the tip it may enter between the sides; from the two other corners it
      // could not get far without a corner inside.
      if (p == b) return is_between(a, b, c, places_[before_[i]]) || is_between(a, b, c, places_[next_[i]]);
      return p != a && p != c && area(a, b, p) >= 0 && area(b, c, p) >= 0 && area(c, a, p) >= 0;
    });
  }

  static bool is_between(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& p) {
    return area(a, b, p) > 0 && area(b, c, p) > 0;
  }

  /// Returns the corner behind it.
  std::uint32_t cut(std::uint32_t at) {
    const std::uint32_t before = before_[at], next = next_[at];
    next_[before] = next;
    before_[next] = before;
    // Corners become convex as ears go, and stay so but for rounding.
    std::erase_if(reflex_, [&](std::uint32_t i) { return i == at || i == before || i == next; });
    for (const std::uint32_t i : {before, next})
      if (area_at(i) <= 0) reflex_.push_back(i);
    return next;
  }

  std::vector<Vector2d> places_;
  std::vector<std::uint32_t> next_, before_;
  std::vector<std::uint32_t> reflex_;  ///< corners that are no convex ones, straight ones among them
  double flat_;                        ///< an area that is none
};

}  // namespace

bool is_fan(std::span<const Vector3d> corners) {
  const Vector3d normal = newell(corners);
  // Of a corner that is meant to be in line with its neighbours: a sliver that faces the wrong way does no
  // harm.
  constexpr double kRounding = 1e-6;
  const double least = -kRounding * normal.squaredNorm();
  for (std::size_t i = 2; i < corners.size(); ++i)
    if ((corners[i - 1] - corners[0]).cross(corners[i] - corners[0]).dot(normal) < least) return false;
  return true;
}

std::vector<Triangle> clip_ears(std::span<const Vector3d> corners) { return Ring(corners).clip(); }

}  // namespace hermesh
