#include "validation/geometry/triangle_cover.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace hermesh::validation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Each candidate is tried on each part, so more of them cost more than four pieces with a few each.
constexpr int kMostCandidates = 32, kMostParts = 32, kMostCorners = 12;

struct Polygon {
  std::array<Eigen::Vector3d, kMostCorners> corners;
  int count = 0;

  /// Adds a corner; returns false if there is no room.
  bool add(const Eigen::Vector3d& corner) {
    if (count == kMostCorners) return false;
    corners[count++] = corner;
    return true;
  }
};

/// A triangle with the planes through its sides that stand upright on it.
struct Prism {
  Corners corners;
  Eigen::Vector3d normal;
  std::array<Eigen::Vector3d, 3> outwards;

  /// Sets the prism of a triangle; returns false for a triangle whose plane is all rounding.
  bool set(const Corners& triangle) {
    corners = triangle;
    std::array<Eigen::Vector3d, 3> sides;
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) {
      sides[k] = corners[(k + 1) % 3] - corners[k];
      longest = std::max(longest, sides[k].squaredNorm());
    }
    normal = sides[0].cross(sides[1]);
    const double area = normal.norm();
    if (!(area > 1e-8 * longest)) return false;
    normal /= area;
    for (int k = 0; k < 3; ++k) outwards[k] = sides[k].cross(normal).normalized();
    return true;
  }
  double height(const Eigen::Vector3d& p) const { return normal.dot(p - corners[0]); }
  double beyond(int side, const Eigen::Vector3d& p) const { return outwards[side].dot(p - corners[side]); }
};

class Cover {
 public:
  Cover(const Corners& piece, double limit) : limit_(limit) {
    for (const Eigen::Vector3d& corner : piece) parts_[0].add(corner);
  }

  bool complete() const { return count_ == 0; }
  double bound() const { return bound_; }

  /// Takes away all that is near the prism's triangle; returns false if that leaves too many parts.
  bool take(const Prism& prism) {
    // Backwards, for the last part takes the place of one that goes, and new ones need no second look.
    for (int i = count_ - 1; i >= 0; --i) {
      outside_count_ = 0;
      if (!settle(parts_[i], prism)) continue;
      parts_[i] = parts_[--count_];
      for (int k = 0; k < outside_count_; ++k) {
        if (count_ == kMostParts) return false;
        parts_[count_++] = outside_[k];
      }
    }
    return true;
  }

 private:
  /// Whether some of the part is shown to be near the triangle; the rest of the part is then in outside_.
  bool settle(const Polygon& part, const Prism& prism) {
    double height = 0.0;
    for (int i = 0; i < part.count; ++i) height = std::max(height, std::abs(prism.height(part.corners[i])));
    // A third of how far beyond the sides the surface may reach at that height, so that also the places
    // beyond the corners are near, and two triangles side by side leave no splinter between them.
    const double margin = std::sqrt(std::max(0.0, limit_ * limit_ - height * height)) / 3.0;
    Polygon inside = part;
    for (int side = 0; side < 3; ++side)
      if (!split(inside, prism, side, margin)) return false;
    double bound = 0.0;
    for (int i = 0; i < inside.count; ++i)
      bound = std::max(bound, (closest_point(prism.corners, inside.corners[i]) - inside.corners[i]).norm());
    if (bound > limit_) return false;
    bound_ = std::max(bound_, bound);
    return true;
  }

  /// Cuts off what is beyond a side and adds it to outside_; returns false if nothing else is left, or there
  /// is no room.
  bool split(Polygon& inside, const Prism& prism, int side, double margin) {
    std::array<double, kMostCorners> beyond;
    double least = kInfinity, most = -kInfinity;
    for (int i = 0; i < inside.count; ++i) {
      beyond[i] = prism.beyond(side, inside.corners[i]) - margin;
      least = std::min(least, beyond[i]);
      most = std::max(most, beyond[i]);
    }
    if (least >= 0.0) return false;
    if (most <= 0.0) return true;
    Polygon in;
    Polygon& out = outside_[outside_count_++];
    out.count = 0;
    bool room = true;
    for (int i = 0; i < inside.count; ++i) {
      const int j = (i + 1) % inside.count;
      const Eigen::Vector3d &a = inside.corners[i], &b = inside.corners[j];
      room = room && (beyond[i] <= 0.0 ? in : out).add(a);
      if ((beyond[i] <= 0.0) == (beyond[j] <= 0.0)) continue;
      const Eigen::Vector3d between = a + (beyond[i] / (beyond[i] - beyond[j])) * (b - a);
      room = room && in.add(between) && out.add(between);
    }
    inside = in;
    return room;
  }

  const double limit_;
  double bound_ = 0.0;
  std::array<Polygon, kMostParts> parts_;
  int count_ = 1;
  std::array<Polygon, 3> outside_;
  int outside_count_ = 0;
};

}  // namespace

double cover_bound(const Corners& piece, const TriangleTree& to, double reach, double limit) {
  const Box near = box_of(piece);
  std::array<std::uint32_t, kMostCandidates> candidates;
  int count = 0;
  const bool all = to.for_each_near(near, std::min(reach, limit), [&](std::uint32_t slot) {
    if (count == kMostCandidates) return false;
    candidates[count++] = slot;
    return true;
  });
  if (!all) return kInfinity;
  // Seen from the piece, or the many cuts would each add a rounding error of the size of coordinates.
  const Eigen::Vector3d origin = piece[0];
  const auto seen = [&](const Corners& c) { return Corners{c[0] - origin, c[1] - origin, c[2] - origin}; };
  Cover cover(seen(piece), limit);
  Prism prism;
  for (int i = 0; i < count && !cover.complete(); ++i)
    if (prism.set(seen(to.corners(candidates[i]))) && !cover.take(prism)) return kInfinity;
  return cover.complete() ? cover.bound() : kInfinity;
}

}  // namespace hermesh::validation
