#include "algorithms/extraction/contact/triangle_overlay.h"

#include <algorithm>
#include <utility>

namespace hermesh {
namespace {

using Place = OverTriangle::Place;

/// Least cosine of the angle between a triangle and a face that covers it.
constexpr double kFacing = 0.05;

}  // namespace

// Clips at each of the three sides in turn (Sutherland & Hodgman 1974), in coordinates in which each side is
// a line where one of them is zero.
ClippedTriangle::ClippedTriangle(const std::array<Place, 3>& triangle) {
  std::array<Place, 24> before;
  std::copy(triangle.begin(), triangle.end(), corners.begin());
  size = 3;
  for (int side = 0; side < 3 && size > 0; ++side) {
    int outside = 0;
    for (int i = 0; i < size; ++i) outside += corners[i][side] > 0;
    // Most triangles lie within some side as a whole: nothing is recomputed, so nothing is rounded.
    if (outside == 0) continue;
    const int n = std::exchange(size, 0);
    std::copy_n(corners.begin(), n, before.begin());
    for (int i = 0; i < n; ++i) {
      const Place &a = before[i], &b = before[(i + 1) % n];
      if (a[side] <= 0) corners[size++] = a;
      if ((a[side] <= 0) != (b[side] <= 0)) corners[size++] = a + (a[side] / (a[side] - b[side])) * (b - a);
    }
  }
}

// The part of the segment within all three sides is an interval. A segment that runs along a side, or less
// than the margin within it, may be ignored.
bool passes_over(const Place& from, const Place& to, double margin) {
  double begin = 0, end = 1;
  for (int i = 0; i < 3; ++i) {
    if (from[i] >= -margin && to[i] >= -margin) return false;
    const double a = from[i] + margin, b = to[i] + margin;
    if (a > 0) begin = std::max(begin, a / (a - b));
    if (b > 0) end = std::min(end, a / (a - b));
  }
  return begin < end;
}

/// Returns true if the part over the triangle has some area, more than the margin from the sides. A part
/// within that distance would have no side for which passes_over() holds, so the rest of the triangle would
/// be considered covered. Seen along the triangle's normal, two of the distances beyond its sides are
/// coordinates.
bool TriangleOverlay::overlaps(std::array<Place, 3> places, double margin) {
  for (Place& place : places) place.head<3>().array() += margin;
  const ClippedTriangle part(places);
  double twice_area = 0;
  for (int i = 1; i + 1 < part.size; ++i) {
    const Place a = part.corners[i] - part.corners[0], b = part.corners[i + 1] - part.corners[0];
    twice_area += a[0] * b[1] - a[1] * b[0];
  }
  constexpr double kNoArea = 1e-9;  // square voxels
  return std::abs(twice_area) > kNoArea;
}

bool TriangleOverlay::is_near_and_faces_alike(const OverTriangle& over, const Eigen::Vector3f& normal,
                                              const std::array<Place, 3>& places, double within) {
  if (!(normal.cast<double>().dot(over.normal()) > kFacing)) return false;
  const double highest = std::max({std::abs(places[0][3]), std::abs(places[1][3]), std::abs(places[2][3])});
  // Heights are affine, so those of the corners bound that of the whole face; only if they are too high is
  // the part over the triangle clipped and tested.
  if (highest <= within) return true;
  const ClippedTriangle part(places);
  for (int i = 0; i < part.size; ++i)
    if (!(std::abs(part.corners[i][3]) <= within)) return false;
  return true;
}

}  // namespace hermesh
