// Bounds the distance of a whole triangle from another surface by projecting that surface onto it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "algorithms/extraction/contact/triangle_contact.h"

namespace hermesh {

/// Affine coordinates of positions relative to a triangle: the distances beyond each of the three sides, in
/// the triangle's plane, and the height above the plane, in units of the corners' coordinates.
class OverTriangle {
 public:
  using Place = Eigen::Vector4d;  ///< beyond sides 0, 1, 2 (positive outside), height

  explicit OverTriangle(const Corners& corners) {
    const Eigen::Vector3d n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const double size = n.norm();
    double longest = 0;
    normal_ = n / size;
    axes_.row(3) = normal_;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d out = (corners[(i + 1) % 3] - corners[i]).cross(normal_);
      const double length = out.norm();
      axes_.row(i) = out / length;
      longest = std::max(longest, length);
    }
    // Twice the area is the product of two sides and the sine between them, least between the longest.
    least_sine_ = size / (longest * longest);
    origin_ = corners[0];
    offsets_.setZero();
    offsets_[1] = axes_.row(1).dot(corners[1] - origin_);
    degenerate_ = !axes_.allFinite();
  }
  bool degenerate() const { return degenerate_; }
  const Eigen::Vector3d& normal() const { return normal_; }
  /// Returns a distance from the sides such that the positions of the triangle nearer to one are at most
  /// `distance` from the others: at an angle α it is the distance times sin(α/2) ≥ sin(α)/2.
  double margin(double distance) const { return 0.5 * least_sine_ * distance; }
  Place operator()(const Eigen::Vector3d& p) const { return axes_ * (p - origin_) - offsets_; }

  /// Coefficients of the coordinates: axes * (p − origin) − offsets.
  struct Frame {
    const Eigen::Matrix<double, 4, 3>& axes;
    const Eigen::Vector3d& origin;
    const Place& offsets;
  };
  Frame frame() const { return {axes_, origin_, offsets_}; }

 private:
  Eigen::Matrix<double, 4, 3> axes_;
  Eigen::Vector3d origin_, normal_;
  Place offsets_;
  double least_sine_;  ///< of the angles, or less
  bool degenerate_;
};

/// The corners of the part of a triangle over another one: six at most, or more if rounding makes the part
/// slightly non-convex.
struct ClippedTriangle {
  std::array<OverTriangle::Place, 24> corners;  // each of three cuts at most doubles their number
  int size = 0;
  explicit ClippedTriangle(const std::array<OverTriangle::Place, 3>& triangle);
};

/// Parts narrower than this, in voxels, are ignored.
inline constexpr double kNarrow = 1e-9;

/// Returns true if part of the segment lies above or below the triangle, more than `margin` from its sides.
bool passes_over(const OverTriangle::Place& from, const OverTriangle::Place& to, double margin = kNarrow);

/// Projects a mesh onto one triangle after another. An object remembers the visited faces, so each thread
/// needs its own.
class TriangleOverlay {
 public:
  explicit TriangleOverlay(std::size_t faces) : seen_(faces) {}

  /// Returns true only if every point of the triangle t has a point of the mesh directly above or below it,
  /// no farther away than `within(face)`, a double, for the face that contains that point.
  ///
  /// **Proof.** Starting at `start`, which must overlap t, the search collects the faces that overlap the
  /// prism over t, across every side that passes over the interior of t. All of them face the same direction
  /// as t. So the projection of their union onto the interior of t is open; it is also closed, because no
  /// side leads out of it; so it is all of t. Over the part of a face that lies over t, the largest heights
  /// are at the corners of that part, and these are tested. (Rounding may hide slivers kNarrow wide.)
  ///
  /// With a `slack` the proof is that of a smaller triangle, no point of t being farther than the slack from
  /// it: sides of faces that run along a side of t, and differ from it by rounding, lead nowhere then.
  ///
  /// `Mesh` has the interface of FineMesh. `seen(face, places)` is called, whatever the result, for faces
  /// that are no farther away than within(face) everywhere over t; `places` are their corners, relative to t.
  template <class Mesh, class Within, class Seen>
  bool is_near(const Corners& t, const Mesh& mesh, std::uint32_t start, Within&& within, Seen&& seen,
               double slack = 0) {
    const OverTriangle over(t);
    if (over.degenerate()) return false;
    const double margin = std::max(kNarrow, over.margin(slack));
    if (++question_ == 0) std::fill(seen_.begin(), seen_.end(), 0), question_ = 1;
    const Corners first = mesh.corners(start);
    std::array<OverTriangle::Place, 3> places = {over(first[0]), over(first[1]), over(first[2])};
    // All faces except the first are reached across a side over the interior of t.
    if (!overlaps(places, margin)) return false;
    seen_[start] = question_;
    entries_.clear();
    for (std::uint32_t face = start;;) {
      if (!is_near_and_faces_alike(over, mesh.normal(face), places, within(face))) return false;
      seen(face, places);
      for (int i = 0; i < 3; ++i) {
        const std::uint32_t side = mesh.side_across(face, i);
        if (side != Mesh::kNone && seen_[side / 3] == question_) continue;
        const int j = i == 2 ? 0 : i + 1;
        if (!passes_over(places[i], places[j], margin)) continue;
        if (side == Mesh::kNone) return false;
        seen_[side / 3] = question_;
        // The adjacent face has the ends of the side in reverse order.
        entries_.push_back({side, places[j], places[i]});
      }
      if (entries_.empty()) return true;
      const Entry& entry = entries_.back();
      face = entry.side / 3;
      const int i = static_cast<int>(entry.side % 3), j = i == 2 ? 0 : i + 1, k = 3 - i - j;
      places[i] = entry.from;
      places[j] = entry.to;
      places[k] = over(mesh.points()[mesh.triangles()[face][k]]);
      entries_.pop_back();
    }
  }

  /// Does the same for callers that do not need the faces that cover t.
  template <class Mesh, class Within>
  bool is_near(const Corners& t, const Mesh& mesh, std::uint32_t start, Within&& within, double slack = 0) {
    return is_near(
        t, mesh, start, within, [](std::uint32_t, const std::array<OverTriangle::Place, 3>&) {}, slack);
  }

 private:
  static bool overlaps(std::array<OverTriangle::Place, 3> places, double margin);
  static bool is_near_and_faces_alike(const OverTriangle& over, const Eigen::Vector3f& normal,
                                      const std::array<OverTriangle::Place, 3>& places, double within);

  /// A face still to be visited: the side through which it was reached, and the ends of that side.
  struct Entry {
    std::uint32_t side;  ///< numbered as in FineMesh::side_across()
    OverTriangle::Place from, to;
  };
  std::vector<std::uint32_t> seen_;
  std::vector<Entry> entries_;
  std::uint32_t question_ = 0;
};

}  // namespace hermesh
