#include "algorithms/voxelization/inside/triangle_faces.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace hermesh {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// A corner that is no farther from a plane, in voxels, lies in it.
constexpr double kOnPlane = 1e-7;
/// What ends this near to a triangle, in voxels, parts the space next to it, from which voxels are looked
/// for: as far as sheet_prober.h starts its ways at most.
constexpr double kTouchingPlane = 1e-3;
/// A strip along a face's border that is no wider, in voxels, stays with the face.
constexpr double kBorder = 1e-6;

/// Twice the area of a triangle, positive if counter-clockwise.
double turn(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// Area of a convex polygon, as a fan from its first corner.
double area_of(const std::vector<Vector2d>& corners) {
  double twice = 0;
  for (std::size_t i = 2; i < corners.size(); ++i) twice += turn(corners[0], corners[i - 1], corners[i]);
  return 0.5 * twice;
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

TriangleCutter::TriangleCutter(const Facet& triangle)
    : triangle_(triangle), normal_(triangle.normal().normalized()) {
  // Coordinates in the triangle's plane, in which it is counter-clockwise, so that its inside is left of each
  // side.
  along_ = (triangle.corner[1] - triangle.corner[0]).normalized();
  across_ = normal_.cross(along_);
  for (const Vector3d& corner : triangle.corner) outline_.push_back(flat(corner));
  border_ = sides(outline_);
}

Vector2d TriangleCutter::flat(const Vector3d& place) const {
  const Vector3d from = place - triangle_.corner[0];
  return {from.dot(along_), from.dot(across_)};
}

void TriangleCutter::add(const Facet& other) {
  double height[3];
  for (int i = 0; i < 3; ++i) height[i] = normal_.dot(other.corner[i] - triangle_.corner[0]);
  const auto [lowest, highest] = std::minmax({height[0], height[1], height[2]});
  // Wholly above or below.
  if (lowest > kTouchingPlane || highest < -kTouchingPlane) return;
  std::vector<Place> met, touching;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    // The line of the crossing ends where sides of the other triangle pass the plane, or at corners in it.
    if (std::abs(height[i]) <= kOnPlane) met.push_back(flat(other.corner[i]));
    if (std::abs(height[i]) <= kTouchingPlane) touching.push_back(flat(other.corner[i]));
    if ((height[i] > kOnPlane && height[j] < -kOnPlane) || (height[i] < -kOnPlane && height[j] > kOnPlane)) {
      const double part = height[i] / (height[i] - height[j]);
      met.push_back(flat(other.corner[i] + part * (other.corner[j] - other.corner[i])));
    }
  }
  // Two ends make the crossing. Where there are fewer, a side that comes close as a whole cuts; where all
  // three corners do, the whole outline.
  if (met.size() == 2) add_cut(met[0], met[1]);
  if (touching.size() == 2 && met.size() < 2) add_cut(touching[0], touching[1]);
  if (touching.size() == 3)
    for (std::size_t i = 0; i < 3; ++i) add_cut(touching[i], touching[(i + 1) % 3]);
}

void TriangleCutter::add_cut(const Place& from, const Place& to) {
  Cut cut{from, to};
  if (clip(border_, cut)) cuts_.push_back(cut);
}

std::vector<TriangleCutter::Side> TriangleCutter::sides(const std::vector<Place>& corners) {
  std::vector<Side> sides;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Place &a = corners[i], side = corners[(i + 1) % corners.size()] - a;
    const double length = side.norm();
    // A side without length has no direction; its neighbours bound the polygon.
    if (!(length > 0)) continue;
    const Place inward(-side.y() / length, side.x() / length);
    sides.push_back({inward, inward.dot(a)});
  }
  return sides;
}

/// Clips a cut to its part within a convex polygon (Cyrus & Beck 1978); false if that is no more than a
/// point, or on the border.
bool TriangleCutter::clip(const std::vector<Side>& sides, Cut& cut) {
  double begin = 0, end = 1;
  for (const Side& side : sides) {
    const double from = side.inward.dot(cut.from) - side.offset, to = side.inward.dot(cut.to) - side.offset;
    if (std::max(from, to) <= kBorder) return false;
    if (from < 0) begin = std::max(begin, from / (from - to));
    if (to < 0) end = std::min(end, from / (from - to));
  }
  const Place way = cut.to - cut.from;
  if (!((end - begin) * way.norm() > kBorder)) return false;
  cut = {cut.from + begin * way, cut.from + end * way};
  return true;
}

/// Splits a part along the longest of its cuts that parts it, and forgets the cuts that do not. The part
/// keeps what is left of the line, `other` gets the rest, and each the cuts within it.
bool TriangleCutter::split(Part& part, Part& other) {
  while (!part.cuts.empty()) {
    const auto longest = std::ranges::max_element(
        part.cuts, {}, [](const Cut& cut) { return (cut.to - cut.from).squaredNorm(); });
    // The longest first: it is the likeliest to cut all the way, so that the line, which goes on beyond its
    // ends, cuts nothing in vain.
    const Cut line = *longest;
    *longest = part.cuts.back();
    part.cuts.pop_back();
    const Place way = (line.to - line.from).normalized();
    const auto left_of = [&](const Place& p) {
      return way.x() * (p - line.from).y() - way.y() * (p - line.from).x();
    };
    std::vector<double> side;
    for (const Place& corner : part.corners) side.push_back(left_of(corner));
    if (*std::ranges::max_element(side) <= kBorder || *std::ranges::min_element(side) >= -kBorder) continue;
    Part left;
    other = {};
    for (std::size_t i = 0; i < side.size(); ++i) {
      const std::size_t j = (i + 1) % side.size();
      const Place &a = part.corners[i], &b = part.corners[j];
      // A corner on the line belongs to both.
      if (side[i] >= 0) left.corners.push_back(a);
      if (side[i] <= 0) other.corners.push_back(a);
      if ((side[i] > 0 && side[j] < 0) || (side[i] < 0 && side[j] > 0)) {
        const Place between = a + side[i] / (side[i] - side[j]) * (b - a);
        left.corners.push_back(between);
        other.corners.push_back(between);
      }
    }
    for (Part* half : {&left, &other}) {
      half->area = area_of(half->corners);
      const std::vector<Side> border = sides(half->corners);
      for (Cut cut : part.cuts)
        if (clip(border, cut)) half->cuts.push_back(cut);
    }
    part = std::move(left);
    return true;
  }
  return false;
}

/// The part in space.
TriangleFace TriangleCutter::face(const Part& part) const {
  TriangleFace face;
  for (const Place& p : part.corners)
    face.corners.push_back(triangle_.corner[0] + p.x() * along_ + p.y() * across_);
  return face;
}

/// Takes as many of the longest cuts as there may be faces: to hand all of them down would take far longer
/// than to cut.
std::vector<TriangleCutter::Cut> TriangleCutter::longest_cuts(std::size_t most) const {
  std::vector<Cut> cuts = cuts_;
  if (cuts.size() <= most) return cuts;
  std::ranges::nth_element(cuts, cuts.begin() + std::ptrdiff_t(most), std::ranges::greater(),
                           [](const Cut& cut) { return (cut.to - cut.from).squaredNorm(); });
  cuts.resize(most);
  return cuts;
}

std::vector<TriangleFace> TriangleCutter::faces(
    std::size_t most, const std::function<bool(const TriangleFace&)>& matters) const {
  const auto smaller = [](const Part& a, const Part& b) { return a.area < b.area; };
  std::vector<TriangleFace> faces;
  std::vector<Part> parts = {{outline_, longest_cuts(most), area_of(outline_)}};
  const bool all_cuts = parts[0].cuts.size() == cuts_.size();
  while (!parts.empty()) {
    // The largest part is the next to be cut, so that when no more faces may be made only small ones are
    // uncut.
    std::ranges::pop_heap(parts, smaller);
    Part part = std::move(parts.back()), other;
    parts.pop_back();
    TriangleFace found = face(part);
    const bool may_be_cut = faces.size() + parts.size() + 1 < most;
    if (!may_be_cut || !matters(found) || !split(part, other)) {
      found.whole = all_cuts && part.cuts.empty();
      faces.push_back(std::move(found));
      continue;
    }
    for (Part* half : {&part, &other}) {
      parts.push_back(std::move(*half));
      std::ranges::push_heap(parts, smaller);
    }
  }
  return faces;
}

}  // namespace hermesh
