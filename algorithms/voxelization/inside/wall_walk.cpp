#include "algorithms/voxelization/inside/wall_walk.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Distance of the paths from the walls, in voxels; a narrower crevice is closed.
constexpr double kHair = 1e-5;
/// A triangle folded back onto its neighbour this closely, in radians, leaves no room for a path.
constexpr double kFolded = 1e-6;

}  // namespace

/// Returns the unit normal on the front of a triangle, from which it is wound counter-clockwise.
Vector3d WallWalk::normal_of(std::uint32_t triangle) const {
  return Facet(soup_.corners(triangle)).normal().stableNormalized();
}

void WallWalk::add(const Place& place) {
  // The first point on a side represents all of it, even where other triangles cross it, so that the walk
  // ends.
  const bool front = normal_of(place.triangle).dot(place.up) > 0.0;
  if (known_.insert(std::uint64_t(place.triangle) * 2 + front).second) places_.push_back(place);
}

void WallWalk::begin(const Vector3d& from, const Vector3d& step) {
  const CellObstacles::Met met = obstacles_.first_met(from, from + step);
  if (met.part >= 1.0) return;
  const Vector3d up = (met.faces_from ? 1.0 : -1.0) * normal_of(met.triangle);
  const Vector3d at = from + met.part * step + kHair * up;
  // At the bottom of a sharp crease, a point a hair above one wall is behind the other.
  if (obstacles_.is_free(from, at)) add({met.triangle, up, at});
}

std::optional<Vector3d> WallWalk::next() {
  // The last point's neighbours are searched only now, so that a short walk stays cheap.
  if (given_ > 0) {
    const Place place = places_[given_ - 1];
    begin(place.at, place.up);  // the opposite wall may belong to another part
    for (std::size_t edge = 0; edge < 3; ++edge)
      if (const std::optional<Place> to = across(place, edge)) add(*to);
  }
  if (given_ == places_.size()) return std::nullopt;
  return places_[given_++].at;
}

/// Returns the middle of the next triangle around an edge, if a free path leads there. Of all triangles at
/// the edge the next one is at the least angle, measured from this triangle's plane through the space above
/// it.
std::optional<WallWalk::Place> WallWalk::across(const Place& from, std::size_t edge) {
  const Triangle t = soup_.triangle(from.triangle);
  const Facet facet(soup_.corners(from.triangle));
  const std::uint32_t a = t[edge], b = t[(edge + 1) % 3], c = t[(edge + 2) % 3];
  const Vector3d &start = facet.corner[edge], &end = facet.corner[(edge + 1) % 3];
  const Vector3d middle = 0.5 * (start + end), along = (end - start).stableNormalized();
  // The vector from the edge's line to a point, perpendicular to the line.
  const auto off_edge = [&](const Vector3d& point) -> Vector3d {
    return (point - start) - (point - start).dot(along) * along;
  };
  const Vector3d back = off_edge(facet.corner[(edge + 2) % 3]).stableNormalized();
  double least = 2.0 * std::numbers::pi;
  std::optional<Place> next;
  for (const std::uint32_t number : obstacles_.triangles_in(cell_of(middle))) {
    const Triangle other = soup_.triangle(number);
    const auto third =
        std::ranges::find_if(other, [&](std::uint32_t point) { return point != a && point != b; });
    // A second copy of the triangle does not count.
    if (third == other.end() || *third == c || std::ranges::count(other, a) != 1 ||
        std::ranges::count(other, b) != 1)
      continue;
    const Facet to(soup_.corners(number));
    const Vector3d off = off_edge(to.corner[third - other.begin()]);
    if (off.norm() <= 1e-9 * (end - start).norm()) continue;  // no area, no side
    double angle = std::atan2(off.dot(from.up), off.dot(back));
    if (angle < 0.0) angle += 2.0 * std::numbers::pi;
    if (angle > least || (angle == least && (!next || number > next->triangle))) continue;
    least = angle;
    // The side of the other triangle that faces the wedge between the two.
    const Vector3d up = std::sin(angle) * back - std::cos(angle) * from.up;
    next = Place{number, up, (to.corner[0] + to.corner[1] + to.corner[2]) / 3.0 + kHair * up};
  }
  if (!next || least < kFolded) return std::nullopt;
  // Over a point in the middle of the wedge, a hair off the edge. Both halves of the path must be free, for a
  // triangle that does not share the edge may cross the wedge.
  const Vector3d bridge = middle + kHair * (std::cos(0.5 * least) * back + std::sin(0.5 * least) * from.up);
  if (!obstacles_.is_free(from.at, bridge) || !obstacles_.is_free(bridge, next->at)) return std::nullopt;
  return next;
}

}  // namespace hermesh
