#include "algorithms/extraction/manifold_dual_contouring/triangle_overlay.h"

#include <algorithm>
#include <utility>

namespace hermesh {
namespace {

using Place = OverTriangle::Place;

/// A part narrower than this, in voxels, counts as none.
constexpr double kNarrow = 1e-9;
/// Least cosine between a triangle and what covers it.
constexpr double kFacing = 0.05;

}  // namespace

ClippedTriangle::ClippedTriangle(const std::array<Place, 3>& triangle) {
  std::array<Place, 24> before;
  std::copy(triangle.begin(), triangle.end(), corners.begin());
  size = 3;
  for (int side = 0; side < 3 && size > 0; ++side) {
    int outside = 0;
    for (int i = 0; i < size; ++i) outside += corners[i][side] > 0;
    if (outside == 0) continue;
    before = corners;
    const int n = std::exchange(size, 0);
    for (int i = 0; i < n; ++i) {
      const Place &a = before[i], &b = before[(i + 1) % n];
      if (a[side] <= 0) corners[size++] = a;
      if ((a[side] <= 0) != (b[side] <= 0)) corners[size++] = a + (a[side] / (a[side] - b[side])) * (b - a);
    }
  }
}

bool passes_over(const Place& from, const Place& to) {
  double begin = 0, end = 1;
  for (int i = 0; i < 3; ++i) {
    if (from[i] >= -kNarrow && to[i] >= -kNarrow) return false;
    if (from[i] > 0) begin = std::max(begin, from[i] / (from[i] - to[i]));
    if (to[i] > 0) end = std::min(end, from[i] / (from[i] - to[i]));
  }
  return begin < end;
}

TriangleOverlay::Cover TriangleOverlay::look_at(const OverTriangle& over, const Corners& corners,
                                                const std::array<Place, 3>& places, double within) {
  for (int i = 0; i < 3; ++i)
    if (places[0][i] >= -kNarrow && places[1][i] >= -kNarrow && places[2][i] >= -kNarrow) return Cover::none;
  const auto faces_alike = [&] {
    const Eigen::Vector3d n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    return n.dot(over.normal()) > kFacing * n.norm();
  };
  const double highest = std::max({std::abs(places[0][3]), std::abs(places[1][3]), std::abs(places[2][3])});
  if (highest <= within && faces_alike()) return Cover::near;
  const ClippedTriangle part(places);
  if (part.size < 3) return Cover::none;
  for (int i = 0; i < part.size; ++i)
    if (!(std::abs(part.corners[i][3]) <= within)) return Cover::far;
  return faces_alike() ? Cover::near : Cover::far;
}

}  // namespace hermesh
