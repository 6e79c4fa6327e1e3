#include "algorithms/voxelization/inside/triangle_faces.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace hermesh {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A corner no farther from a plane, in voxels, lies in it.
constexpr double kOnPlane = 1e-7;
/// A triangle that ends this near to another one, in voxels, divides the space next to it: kMostOff of
/// interior_faces.cpp.
constexpr double kTouchingPlane = 1e-3;
/// A strip along a face's boundary no wider than this, in voxels, is not cut off.
constexpr double kBorder = 1e-6;

/// Returns twice the area of a triangle, positive if counter-clockwise.
double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Returns the area of a convex polygon, as a fan from its first corner.
double area_of(const std::vector<Vector2d>& corners) {
  double twice = 0;
  for (std::size_t i = 2; i < corners.size(); ++i) twice += turn(corners[0], corners[i - 1], corners[i]);
  return 0.5 * twice;
}

using FacePlace = Vector2d;  // in the plane of the triangle
struct FaceCut {
  FacePlace from, to;
  double squared_length() const { return (to - from).squaredNorm(); }
};
struct FaceSide {
  FacePlace inward;  ///< unit normal
  double offset;
};
/// A convex part of the triangle with the cuts in it.
struct FacePart {
  std::vector<FacePlace> corners;
  std::vector<FaceCut> cuts;
  double area = 0;
};

/// Returns the sides of a convex polygon. A side without length has no direction; its neighbours bound the
/// polygon.
std::vector<FaceSide> sides_of(const std::vector<FacePlace>& corners) {
  std::vector<FaceSide> sides;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const FacePlace &a = corners[i], side = corners[(i + 1) % corners.size()] - a;
    const double length = side.norm();
    if (!(length > 0)) continue;
    const FacePlace inward(-side.y() / length, side.x() / length);
    sides.push_back({inward, inward.dot(a)});
  }
  return sides;
}

/// Clips a cut to its part within a convex polygon (Cyrus & Beck 1978). Returns false if that is a point, or
/// on the boundary.
bool clip(const std::vector<FaceSide>& sides, FaceCut& cut) {
  double begin = 0, end = 1;
  for (const FaceSide& side : sides) {
    const double from = side.inward.dot(cut.from) - side.offset, to = side.inward.dot(cut.to) - side.offset;
    if (std::max(from, to) <= kBorder) return false;
    if (from < 0) begin = std::max(begin, from / (from - to));
    if (to < 0) end = std::min(end, from / (from - to));
  }
  const FacePlace way = cut.to - cut.from;
  if (!((end - begin) * way.norm() > kBorder)) return false;
  cut = {cut.from + begin * way, cut.from + end * way};
  return true;
}

/// Splits a part along the longest of its cuts that divides it, and removes the cuts that do not. The part
/// keeps the polygon left of the line, `other` gets the rest, and each gets the cuts within it.
bool split(FacePart& part, FacePart& other) {
  while (!part.cuts.empty()) {
    const auto longest = std::ranges::max_element(part.cuts, {}, &FaceCut::squared_length);
    // The longest is the likeliest to divide the part completely, so that the line beyond its ends cuts
    // little.
    const FaceCut line = *longest;
    *longest = part.cuts.back();
    part.cuts.pop_back();
    const FacePlace way = (line.to - line.from).normalized();
    const auto left_of = [&](const FacePlace& p) {
      return way.x() * (p - line.from).y() - way.y() * (p - line.from).x();
    };
    std::vector<double> side;
    for (const FacePlace& corner : part.corners) side.push_back(left_of(corner));
    if (*std::ranges::max_element(side) <= kBorder || *std::ranges::min_element(side) >= -kBorder) continue;
    FacePart left;
    other = {};
    for (std::size_t i = 0; i < side.size(); ++i) {
      const std::size_t j = (i + 1) % side.size();
      const FacePlace &a = part.corners[i], &b = part.corners[j];
      // A corner on the line belongs to both.
      if (side[i] >= 0) left.corners.push_back(a);
      if (side[i] <= 0) other.corners.push_back(a);
      if ((side[i] > 0 && side[j] < 0) || (side[i] < 0 && side[j] > 0)) {
        const FacePlace between = a + side[i] / (side[i] - side[j]) * (b - a);
        left.corners.push_back(between);
        other.corners.push_back(between);
      }
    }
    for (FacePart* half : {&left, &other}) {
      half->area = area_of(half->corners);
      const std::vector<FaceSide> border = sides_of(half->corners);
      for (FaceCut cut : part.cuts)
        if (clip(border, cut)) half->cuts.push_back(cut);
    }
    part = std::move(left);
    return true;
  }
  return false;
}

/// Coordinates in a triangle's plane, in which it is counter-clockwise: its inside is left of each side.
struct TrianglePlane {
  Vector3d origin, normal, along, across;  ///< unit vectors; the latter two in the plane

  explicit TrianglePlane(const Facet& triangle)
      : origin(triangle.corner[0]),
        normal(triangle.normal().normalized()),
        along((triangle.corner[1] - triangle.corner[0]).normalized()),
        across(normal.cross(along)) {}

  FacePlace flat(const Vector3d& point) const {
    const Vector3d from = point - origin;
    return {from.dot(along), from.dot(across)};
  }
  TriangleFace face(const FacePart& part) const {
    TriangleFace face;
    for (const FacePlace& p : part.corners) face.corners.push_back(origin + p.x() * along + p.y() * across);
    return face;
  }
};

/// Calls cut(from, to) for the segments along which another triangle cuts one.
template <class F>
void for_each_cut(const TrianglePlane& plane, const Facet& other, F&& cut) {
  double height[3];
  for (int i = 0; i < 3; ++i) height[i] = plane.normal.dot(other.corner[i] - plane.origin);
  const auto [lowest, highest] = std::minmax({height[0], height[1], height[2]});
  if (lowest > kTouchingPlane || highest < -kTouchingPlane) return;
  std::vector<FacePlace> met, touching;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    // The crossing ends at sides of the other triangle that pass the plane, or at corners in it.
    if (std::abs(height[i]) <= kOnPlane) met.push_back(plane.flat(other.corner[i]));
    if (std::abs(height[i]) <= kTouchingPlane) touching.push_back(plane.flat(other.corner[i]));
    if ((height[i] > kOnPlane && height[j] < -kOnPlane) || (height[i] < -kOnPlane && height[j] > kOnPlane)) {
      const double part = height[i] / (height[i] - height[j]);
      met.push_back(plane.flat(other.corner[i] + part * (other.corner[j] - other.corner[i])));
    }
  }
  // With fewer than two ends, a side that is close as a whole cuts; if all three corners are, the whole
  // outline.
  if (met.size() == 2) cut(met[0], met[1]);
  if (touching.size() == 2 && met.size() < 2) cut(touching[0], touching[1]);
  if (touching.size() == 3)
    for (std::size_t i = 0; i < 3; ++i) cut(touching[i], touching[(i + 1) % 3]);
}

}  // namespace

Vector3d TriangleFace::middle() const {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& corner : corners) sum += corner;
  return sum / double(corners.size());
}

double TriangleFace::area() const {
  Vector3d twice = Vector3d::Zero();
  for (std::size_t i = 2; i < corners.size(); ++i)
    twice += (corners[i - 1] - corners[0]).cross(corners[i] - corners[0]);
  return 0.5 * twice.norm();
}

double TriangleFace::size() const {
  double squared = 0;
  for (const Vector3d& a : corners)
    for (const Vector3d& b : corners) squared = std::max(squared, (a - b).squaredNorm());
  return std::sqrt(squared);
}

double TriangleFace::room_at(const Vector3d& place) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vector3d &a = corners[i], &b = corners[(i + 1) % corners.size()];
    const double length = (b - a).norm();
    if (length > 0) least = std::min(least, (b - a).cross(place - a).norm() / length);
  }
  return least;
}

std::vector<TriangleFace> cut_triangle(const Facet& triangle, std::span<const Facet> others, std::size_t most,
                                       const std::function<bool(const TriangleFace&)>& matters) {
  const TrianglePlane plane(triangle);
  FacePart whole;
  for (const Vector3d& corner : triangle.corner) whole.corners.push_back(plane.flat(corner));
  whole.area = area_of(whole.corners);
  const std::vector<FaceSide> border = sides_of(whole.corners);
  for (const Facet& other : others)
    for_each_cut(plane, other, [&](const FacePlace& from, const FacePlace& to) {
      if (FaceCut cut{from, to}; clip(border, cut)) whole.cuts.push_back(cut);
    });
  if (whole.cuts.empty()) return {};
  // As many of the longest cuts as there may be faces: handing down all of them would take far longer than
  // cutting.
  const bool all_cuts = whole.cuts.size() <= most;
  if (!all_cuts) {
    std::ranges::nth_element(whole.cuts, whole.cuts.begin() + std::ptrdiff_t(most), std::ranges::greater(),
                             &FaceCut::squared_length);
    whole.cuts.resize(most);
  }
  const auto smaller = [](const FacePart& a, const FacePart& b) { return a.area < b.area; };
  std::vector<TriangleFace> faces;
  std::vector<FacePart> parts = {std::move(whole)};
  while (!parts.empty()) {
    // The largest part is cut next, so that only small ones remain uncut.
    std::ranges::pop_heap(parts, smaller);
    FacePart part = std::move(parts.back()), other;
    parts.pop_back();
    TriangleFace found = plane.face(part);
    const bool may_be_cut = faces.size() + parts.size() + 1 < most;
    if (!may_be_cut || !matters(found) || !split(part, other)) {
      found.whole = all_cuts && part.cuts.empty();
      faces.push_back(std::move(found));
      continue;
    }
    for (FacePart* half : {&part, &other}) {
      parts.push_back(std::move(*half));
      std::ranges::push_heap(parts, smaller);
    }
  }
  return faces;
}

}  // namespace hermesh
