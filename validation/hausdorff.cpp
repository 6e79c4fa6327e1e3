#include "validation/hausdorff.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "validation/geometry/sum_ranges.h"

namespace hermesh::validation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Each candidate is tried on each part, so more of them cost more than four smaller pieces with a few each.
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

/// A triangle with the planes through its sides at right angles to it.
struct Prism {
  Corners corners;
  Eigen::Vector3d normal;
  std::array<Eigen::Vector3d, 3> outwards;

  /// Sets the prism of a triangle; returns false if its plane is dominated by rounding errors.
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

  /// Removes the parts near the prism's triangle; returns false if too many parts are left.
  bool take(const Prism& prism) {
    // Backwards: the last part replaces a removed one, and new parts need no second test.
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
  /// Returns true if a share of the part is near the triangle; the rest of the part is then in outside_.
  bool settle(const Polygon& part, const Prism& prism) {
    double height = 0.0;
    for (int i = 0; i < part.count; ++i) height = std::max(height, std::abs(prism.height(part.corners[i])));
    // A third of the distance beyond the sides that is still within the limit at that height, so that points
    // beyond the corners are within it, too, and two adjacent triangles leave no splinter between them.
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

  /// Moves the share beyond a side to outside_; returns false if nothing remains or there is no room.
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

// Triangles are refined in batches, which bound the memory.
constexpr std::size_t kBatch = std::size_t(1) << 16;
constexpr std::size_t kMostPieces = std::size_t(1) << 22;
constexpr int kMostLevels = 40;

// A point of `from` and the triangle of `to` that is closest to it.
struct Probe {
  Eigen::Vector3d point;
  double distance;
  std::uint32_t slot;
};

using Piece = std::array<Probe, 3>;

class BranchAndBound {
 public:
  BranchAndBound(const TriangleTree& to, double gap, const RunContext& context)
      : to_(to), gap_(gap), context_(context) {}

  HausdorffBound run(const TriangleSoup& from) {
    const std::vector<Probe> probes = probe_points(from);
    for (const Probe& p : probes) lower_ = std::max(lower_, p.distance);
    for (std::size_t first = 0; first < from.triangles.size(); first += kBatch) {
      const std::size_t count = std::min(kBatch, from.triangles.size() - first);
      refine(select(count, [&](std::size_t i) {
        const Triangle& t = from.triangles[first + i];
        return Piece{probes[t[0]], probes[t[1]], probes[t[2]]};
      }));
    }
    return {lower_, std::max(lower_, settled_)};
  }

 private:
  Probe probe(const Eigen::Vector3d& point, std::uint32_t guess) const {
    const ClosestHit hit = to_.closest(point, guess);
    return {point, std::sqrt(hit.squared), hit.slot};
  }

  double distance_to(std::uint32_t slot, const Eigen::Vector3d& point) const {
    return (closest_point(to_.corners(slot), point) - point).norm();
  }

  double bound_by(std::uint32_t slot, const Piece& piece) const {
    double bound = 0.0;
    for (const Probe& p : piece)
      bound = std::max(bound, p.slot == slot ? p.distance : distance_to(slot, p.point));
    return bound;
  }

  double upper_bound(const Piece& piece) const {
    const Eigen::Vector3d centre = (piece[0].point + piece[1].point + piece[2].point) / 3.0;
    const Probe middle = probe(centre, piece[0].slot);
    double radius = 0.0;
    for (const Probe& p : piece) radius = std::max(radius, (p.point - centre).norm());
    const double reach = middle.distance + radius, limit = lower_ + gap_;
    double bound = std::min(reach, bound_by(middle.slot, piece));
    for (const Probe& p : piece) bound = std::min(bound, bound_by(p.slot, piece));
    if (bound <= limit) return bound;
    return std::min(bound, cover_bound({piece[0].point, piece[1].point, piece[2].point}, to_, reach, limit));
  }

  // Points that no triangle uses get the distance 0.
  std::vector<Probe> probe_points(const TriangleSoup& from) const {
    std::vector<std::uint8_t> used(from.points.size(), 0);
    for (const Triangle& t : from.triangles)
      for (std::uint32_t p : t) used[p] = 1;
    std::vector<Probe> probes(from.points.size(), Probe{Eigen::Vector3d::Zero(), 0.0, 0});
    const auto probe_range = [&](const tbb::blocked_range<std::size_t>& range) {
      context_.check();
      std::uint32_t guess = 0;
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        if (!used[i]) continue;
        probes[i] = probe(from.points[i], guess);
        guess = probes[i].slot;
      }
    };
    // Fixed ranges, because the guess decides between two triangles at the same distance.
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, probes.size(), 512), probe_range,
                      tbb::simple_partitioner());
    return probes;
  }

  void refine(std::vector<Piece> pieces) {
    for (int level = 0; !pieces.empty(); ++level) {
      if (level == kMostLevels || pieces.size() > kMostPieces) {
        for (const Piece& piece : pieces) settled_ = std::max(settled_, upper_bound(piece));
        return;
      }
      pieces = cut(pieces);
    }
  }

  // Cuts every piece into four at the middles of its sides.
  std::vector<Piece> cut(const std::vector<Piece>& pieces) {
    std::vector<Piece> middles(pieces.size());
    struct Farthest {
      double distance = 0.0;
      void append(const Farthest& later) { distance = std::max(distance, later.distance); }
    };
    const auto farthest = sum_ranges<Farthest>(
        pieces.size(), 256, context_, [&](std::size_t begin, std::size_t end, Farthest& found) {
          for (std::size_t i = begin; i < end; ++i)
            for (int k = 0; k < 3; ++k) {
              const Probe &a = pieces[i][k], &b = pieces[i][(k + 1) % 3];
              middles[i][k] = probe(0.5 * (a.point + b.point), a.slot);
              found.append({middles[i][k].distance});
            }
        });
    lower_ = std::max(lower_, farthest.distance);
    return select(4 * pieces.size(), [&](std::size_t i) {
      const Piece &p = pieces[i / 4], &m = middles[i / 4];
      const std::size_t k = i % 4;
      return k == 3 ? m : Piece{p[k], m[k], m[(k + 2) % 3]};
    });
  }

  // Returns the pieces whose upper bound exceeds the lower bound by more than the gap, in order, and records
  // the bound of the others.
  template <class MakePiece>
  std::vector<Piece> select(std::size_t count, const MakePiece& make) {
    struct Selected {
      double settled = 0.0;
      std::vector<Piece> open;
      void append(const Selected& later) {
        settled = std::max(settled, later.settled);
        open.insert(open.end(), later.open.begin(), later.open.end());
      }
    };
    Selected all = sum_ranges<Selected>(count, 1024, context_,
                                        [&](std::size_t begin, std::size_t end, Selected& selected) {
                                          for (std::size_t i = begin; i < end; ++i) {
                                            const Piece piece = make(i);
                                            const double bound = upper_bound(piece);
                                            if (bound <= lower_ + gap_)
                                              selected.settled = std::max(selected.settled, bound);
                                            else
                                              selected.open.push_back(piece);
                                          }
                                        });
    settled_ = std::max(settled_, all.settled);
    return std::move(all.open);
  }

  const TriangleTree& to_;
  double gap_;
  const RunContext& context_;
  double lower_ = 0.0;
  double settled_ = 0.0;
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
  // Relative to the piece, because each cut adds a rounding error in proportion to the coordinates.
  const Eigen::Vector3d origin = piece[0];
  const auto seen = [&](const Corners& c) { return Corners{c[0] - origin, c[1] - origin, c[2] - origin}; };
  Cover cover(seen(piece), limit);
  Prism prism;
  for (int i = 0; i < count && !cover.complete(); ++i)
    if (prism.set(seen(to.corners(candidates[i]))) && !cover.take(prism)) return kInfinity;
  return cover.complete() ? cover.bound() : kInfinity;
}

HausdorffBound certified_distance(const TriangleSoup& from, const TriangleTree& to, double gap,
                                  RunContext& context) {
  HausdorffBound bound = BranchAndBound(to, gap, context).run(from);
  Box box = from.box();
  const double diagonal = std::max(box.diagonal(), to.bounds().diagonal());
  box.add(to.bounds());
  const double largest = std::max(box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff());
  const double slack = 1e-7 * diagonal + 1e-15 * largest;
  return {std::max(0.0, bound.lower - slack), bound.upper + slack};
}

}  // namespace hermesh::validation
