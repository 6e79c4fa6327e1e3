#include "algorithms/voxelization/inside/wall_walk.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// How far from the walls the ways along them keep, in voxels: a crevice that is narrower is closed.
constexpr double kHair = 1e-5;
/// A triangle folded back onto the one beside it this closely, in radians, leaves no room to go on.
constexpr double kFolded = 1e-6;

/// An edge of a triangle, and what lies around it.
struct Hinge {
  Vector3d origin, middle, along;
  double length;

  Hinge(const Vector3d& a, const Vector3d& b)
      : origin(a), middle(0.5 * (a + b)), along((b - a).stableNormalized()), length((b - a).norm()) {}
  /// The vector from the edge's line to a point, square to the line.
  Vector3d to(const Vector3d& point) const {
    const Vector3d way = point - origin;
    return way - way.dot(along) * along;
  }
};

}  // namespace

CellObstacles::Voxel cell_of(const Vector3d& place) {
  const auto cell = [&](int axis) { return static_cast<std::int32_t>(std::floor(place[axis])); };
  return {cell(0), cell(1), cell(2)};
}

/// Unit normal on the front of a triangle, from which it is wound counter-clockwise.
Vector3d WallWalk::normal_of(std::uint32_t triangle) const {
  return Facet(soup_.corners(triangle)).normal().stableNormalized();
}

void WallWalk::add(const Place& place) {
  // The first place on a side stands for all of it, also where other triangles cross it: so the walk ends.
  const bool front = normal_of(place.triangle).dot(place.up) > 0.0;
  if (known_.insert(std::uint64_t(place.triangle) * 2 + front).second) places_.push_back(place);
}

void WallWalk::begin(const Vector3d& from, const Vector3d& way) {
  const CellObstacles::Met met = obstacles_.first_met(from, from + way);
  if (met.part >= 1.0) return;
  const Vector3d up = (met.faces_from ? 1.0 : -1.0) * normal_of(met.triangle);
  const Vector3d at = from + met.part * way + kHair * up;
  // At the bottom of a sharp crease a hair above one wall is behind the other.
  if (obstacles_.is_free(from, at)) add({met.triangle, up, at});
}

std::optional<Vector3d> WallWalk::next() {
  // Neighbours are looked for only when the place before has been of no use, so that a short walk stays
  // cheap.
  if (given_ > 0) go_on_from(Place(places_[given_ - 1]));
  if (given_ == places_.size()) return std::nullopt;
  return places_[given_++].at;
}

void WallWalk::go_on_from(const Place& place) {
  begin(place.at, place.up);  // the opposite wall may belong to another part
  for (std::size_t edge = 0; edge < 3; ++edge)
    if (const std::optional<Place> to = across(place, edge)) add(*to);
}

/// Finds the middle of the next triangle around an edge, if it can be gone to. Of all triangles at the edge
/// the next one is at the least angle, measured from this triangle's plane through the space above it.
std::optional<WallWalk::Place> WallWalk::across(const Place& from, std::size_t edge) {
  const Triangle t = soup_.triangle(from.triangle);
  const Facet facet(soup_.corners(from.triangle));
  const std::uint32_t a = t[edge], b = t[(edge + 1) % 3], c = t[(edge + 2) % 3];
  const Hinge hinge(facet.corner[edge], facet.corner[(edge + 1) % 3]);
  const Vector3d back = hinge.to(facet.corner[(edge + 2) % 3]).stableNormalized();
  double least = 2.0 * std::numbers::pi;
  std::optional<Place> next;
  for (const std::uint32_t number : obstacles_.triangles_in(cell_of(hinge.middle))) {
    const Triangle other = soup_.triangle(number);
    const auto third =
        std::ranges::find_if(other, [&](std::uint32_t point) { return point != a && point != b; });
    // A second copy of the triangle is none to go to.
    if (third == other.end() || *third == c || std::ranges::count(other, a) != 1 ||
        std::ranges::count(other, b) != 1)
      continue;
    const Facet to(soup_.corners(number));
    const Vector3d way = hinge.to(to.corner[third - other.begin()]);
    if (way.norm() <= 1e-9 * hinge.length) continue;  // no area, no side
    double angle = std::atan2(way.dot(from.up), way.dot(back));
    if (angle < 0.0) angle += 2.0 * std::numbers::pi;
    if (angle > least || (angle == least && (!next || number > next->triangle))) continue;
    least = angle;
    // The side of the other triangle that faces the wedge between the two.
    const Vector3d up = std::sin(angle) * back - std::cos(angle) * from.up;
    next = Place{number, up, (to.corner[0] + to.corner[1] + to.corner[2]) / 3.0 + kHair * up};
  }
  if (!next || least < kFolded) return std::nullopt;
  // Over a place in the middle of the wedge, a hair off the edge; both halves of the way have to be free, for
  // a triangle that shares no edge may cross the wedge.
  const Vector3d bridge =
      hinge.middle + kHair * (std::cos(0.5 * least) * back + std::sin(0.5 * least) * from.up);
  if (!obstacles_.is_free(from.at, bridge) || !obstacles_.is_free(bridge, next->at)) return std::nullopt;
  return next;
}

}  // namespace hermesh
