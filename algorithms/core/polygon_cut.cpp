#include "algorithms/core/polygon_cut.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <set>
#include <utility>

namespace hermesh {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Returns Newell's normal, twice the area that the polygon encloses, as a vector. Taken about the first
/// corner, so that rounding is relative to the polygon's size and not to its distance from the origin.
Vector3d newell(std::span<const Vector3d> corners) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 2; i < corners.size(); ++i)
    sum += (corners[i - 1] - corners[0]).cross(corners[i] - corners[0]);
  return sum;
}

/// Returns twice the area of the triangle abc, positive if counter-clockwise.
double area(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x();
}

/// A subset of a polygon's corners in a tree of boxes that halves them recursively (Bentley 1975).
class PlaceTree {
 public:
  /// Keeps a reference to `places`; the subset is empty.
  explicit PlaceTree(const std::vector<Vector2d>& places)
      : places_(places), order_(places.size()), slot_(places.size()), chosen_(places.size(), 0) {
    std::iota(order_.begin(), order_.end(), 0u);
    // Node i has the children 2i and 2i + 1. With these levels the last nodes have at most kLeaf positions
    // each.
    boxes_.resize(std::size_t(2) << std::bit_width(places.size() / kLeaf));
    build(0, places.size());
    for (std::uint32_t i = 0; i < order_.size(); ++i) slot_[order_[i]] = i;
  }

  /// Adds a corner to the subset or removes it.
  void choose(std::uint32_t corner, bool is_chosen) {
    if (bool(chosen_[corner]) == is_chosen) return;
    chosen_[corner] = is_chosen;
    std::size_t node = 1, begin = 0, end = order_.size();
    while (end - begin > kLeaf) {
      const std::size_t middle = begin + (end - begin) / 2;
      const bool upper = slot_[corner] >= middle;
      (upper ? begin : end) = middle;
      node = 2 * node + upper;
    }
    // The boxes contain only the chosen positions, so that any_in() skips branches without any.
    boxes_[node].setEmpty();
    for (std::size_t i = begin; i < end; ++i)
      if (chosen_[order_[i]]) boxes_[node].extend(places_[order_[i]]);
    while (node /= 2) boxes_[node] = boxes_[2 * node].merged(boxes_[2 * node + 1]);
  }

  /// Returns the number of leaves of the tree that all calls of any_in() have visited, and of these calls.
  std::uint64_t visited() const { return visited_; }

  /// Returns true if f(corner) holds for a chosen corner in the counter-clockwise triangle abc, boundary
  /// included.
  template <class F>
  bool any_in(const Vector2d& a, const Vector2d& b, const Vector2d& c, F&& f) const {
    Eigen::AlignedBox2d box(a, a);
    ++visited_;
    return any_in(1, 0, order_.size(), box.extend(b).extend(c), a, b, c, f);
  }

 private:
  static constexpr std::size_t kLeaf = 8;

  void build(std::size_t begin, std::size_t end) {
    if (end - begin <= kLeaf) return;
    Eigen::AlignedBox2d box;
    for (std::size_t i = begin; i < end; ++i) box.extend(places_[order_[i]]);
    const int axis = box.sizes().x() >= box.sizes().y() ? 0 : 1;
    const std::size_t middle = begin + (end - begin) / 2;
    // Ties go by number, so that the halves depend only on the polygon.
    std::nth_element(order_.begin() + std::ptrdiff_t(begin), order_.begin() + std::ptrdiff_t(middle),
                     order_.begin() + std::ptrdiff_t(end), [&](std::uint32_t i, std::uint32_t j) {
                       return std::pair(places_[i][axis], i) < std::pair(places_[j][axis], j);
                     });
    build(begin, middle);
    build(middle, end);
  }

  template <class F>
  bool any_in(std::size_t node, std::size_t begin, std::size_t end, const Eigen::AlignedBox2d& box,
              const Vector2d& a, const Vector2d& b, const Vector2d& c, F&& f) const {
    const Eigen::AlignedBox2d& here = boxes_[node];
    if (!here.intersects(box) || is_right_of(a, b, here) || is_right_of(b, c, here) ||
        is_right_of(c, a, here))
      return false;
    visited_ += end - begin <= kLeaf;
    if (end - begin <= kLeaf)
      return std::any_of(
          order_.begin() + std::ptrdiff_t(begin), order_.begin() + std::ptrdiff_t(end), [&](std::uint32_t i) {
            const Vector2d& p = places_[i];
            return chosen_[i] && area(a, b, p) >= 0 && area(b, c, p) >= 0 && area(c, a, p) >= 0 && f(i);
          });
    const std::size_t middle = begin + (end - begin) / 2;
    return any_in(2 * node, begin, middle, box, a, b, c, f) ||
           any_in(2 * node + 1, middle, end, box, a, b, c, f);
  }

  /// Returns true if all of a box lies to the right of a line: its corner farthest to the left does. Rounding
  /// is monotonic, so the test of a single position of the box agrees.
  static bool is_right_of(const Vector2d& from, const Vector2d& to, const Eigen::AlignedBox2d& box) {
    const Vector2d way = to - from;
    const Vector2d most(way.y() > 0 ? box.min().x() : box.max().x(),
                        way.x() > 0 ? box.max().y() : box.min().y());
    return area(from, to, most) < 0;
  }

  const std::vector<Vector2d>& places_;
  std::vector<std::uint32_t> order_, slot_;  ///< corners as the leaves have them, and where each is
  std::vector<char> chosen_;
  std::vector<Eigen::AlignedBox2d>
      boxes_;  ///< of the chosen positions of each node; children of i: 2i and 2i + 1
  mutable std::uint64_t visited_ = 0;
};

/// Set of corners that are still to be tested.
class Candidates {
 public:
  void add(std::uint32_t i) { corners_.insert(i); }
  void remove(std::uint32_t i) { corners_.erase(i); }
  /// Returns the first member from i on, around the ring, or nothing if the set is empty.
  std::optional<std::uint32_t> from(std::uint32_t i) const {
    if (corners_.empty()) return std::nullopt;
    const auto found = corners_.lower_bound(i);
    return found != corners_.end() ? *found : *corners_.begin();
  }

 private:
  std::set<std::uint32_t> corners_;
};

/// A ring of corners from which ears are cut off. Invariant: the neighbors of a corner outside a set of
/// candidates are unchanged since it failed the test, so few corners are tested again.
class Ring {
 public:
  explicit Ring(std::span<const Vector3d> corners)
      : places_(placed(corners)), next_(corners.size()), before_(corners.size()), reflex_(places_) {
    for (std::uint32_t i = 0; i < corners.size(); ++i) {
      next_[i] = i + 1 == corners.size() ? 0 : i + 1;
      before_[next_[i]] = i;
    }
    double extent = 0;
    for (const Vector2d& p : places_) extent = std::max(extent, p.cwiseAbs().maxCoeff());
    // Areas are sums of products of coordinates; 1e-13 is about a thousand roundings of one (2⁻⁵³).
    constexpr double kRounding = 1e-13;
    flat_ = kRounding * extent * extent;
    for (std::uint32_t i = 0; i < corners.size(); ++i) look_at(i);
  }

  std::vector<Triangle> clip(const RunContext& context) {
    std::vector<Triangle> triangles;
    triangles.reserve(places_.size() - 2);
    std::uint32_t at = 0;
    while (left() > 3) {
      if (cut_off_ % 1024 == 1023) {
        context.check();
        context.progress("concave polygons", double(cut_off_) / double(places_.size()));
      }
      const std::optional<std::uint32_t> corner = next_to_cut(at, context);
      if (!corner || is_too_slow()) return {};
      triangles.push_back({before_[*corner], *corner, next_[*corner]});
      // The direct neighbour would make a fan of slivers.
      at = next_[cut(*corner)];
    }
    // If the remaining triangle is reversed, the boundary intersects itself.
    if (area_at(at) < -flat_) return {};
    triangles.push_back({before_[at], at, next_[at]});
    return triangles;
  }

 private:
  /// Projects along the axis that the polygon faces most, counter-clockwise. This scales all areas alike, and
  /// only their signs matter.
  static std::vector<Vector2d> placed(std::span<const Vector3d> corners) {
    const Vector3d normal = newell(corners);
    int axis;
    normal.cwiseAbs().maxCoeff(&axis);
    const int x = (axis + 1) % 3, y = (axis + 2) % 3;
    std::vector<Vector2d> places;
    for (const Vector3d& corner : corners) {
      const Vector3d from = corner - corners[0];
      places.push_back(normal[axis] < 0 ? Vector2d(from[y], from[x]) : Vector2d(from[x], from[y]));
    }
    return places;
  }

  std::size_t left() const { return places_.size() - cut_off_; }
  double area_at(std::uint32_t i) const { return area(places_[before_[i]], places_[i], places_[next_[i]]); }

  /// Returns the first ear from a corner on, otherwise the first corner in a straight line.
  std::optional<std::uint32_t> next_to_cut(std::uint32_t at, const RunContext& context) {
    if (const std::optional<std::uint32_t> ear =
            first(perhaps_ears_, at, context, [&](std::uint32_t i) { return is_ear(i); }))
      return ear;
    // A corner becomes an ear when a neighbour is cut off; where the boundary touches itself, also when
    // another corner is. So all are tested again, but not for every corner of a straight line.
    const auto flat_one = [&] {
      return first(perhaps_flat_, at, context,
                   [&](std::uint32_t i) { return std::abs(area_at(i)) <= flat_; });
    };
    if (cut_off_ < all_asked_at_ + left() / 64)
      if (const std::optional<std::uint32_t> flat = flat_one()) return flat;
    if (cut_off_ > all_asked_at_) {
      all_asked_at_ = cut_off_;
      std::uint32_t i = at;
      do perhaps_ears_.add(i);
      while ((i = next_[i]) != at);
      return next_to_cut(at, context);
    }
    return flat_one();
  }

  /// Returns the first candidate from a corner on for which `is` holds, and removes those before it.
  template <class Is>
  static std::optional<std::uint32_t> first(Candidates& candidates, std::uint32_t at,
                                            const RunContext& context, Is&& is) {
    for (std::size_t asked = 1;; ++asked) {
      const std::optional<std::uint32_t> corner = candidates.from(at);
      if (!corner || is(*corner)) return corner;
      candidates.remove(*corner);
      if (asked % 1024 == 0) context.check();
    }
  }

  /// Returns true after more work than polygons of distinct points take, which is about ten visits for each
  /// corner: corners at one position are all tested for each ear there, which takes quadratic time.
  bool is_too_slow() const { return reflex_.visited() > 10'000'000 + 100 * places_.size(); }

  bool is_ear(std::uint32_t at) const {
    if (is_too_slow()) return false;
    // A straight corner gives a triangle without area; next_to_cut() cuts one only if the polygon has no ear.
    if (area_at(at) <= 0) return false;
    const Vector2d &a = places_[before_[at]], &b = places_[at], &c = places_[next_[at]];
    return !reflex_.any_in(a, b, c, [&](std::uint32_t i) {
      const Vector2d& p = places_[i];
      if (i == before_[at] || i == next_[at]) return false;
      // Where the boundary returns to the tip it may enter between the sides; from the two other corners it
      // could not without a corner inside.
      if (p == b) return is_between(a, b, c, places_[before_[i]]) || is_between(a, b, c, places_[next_[i]]);
      return p != a && p != c;
    });
  }

  static bool is_between(const Vector2d& a, const Vector2d& b, const Vector2d& c, const Vector2d& p) {
    return area(a, b, p) > 0 && area(b, c, p) > 0;
  }

  /// Removes a corner from the ring and returns the next one.
  std::uint32_t cut(std::uint32_t at) {
    const std::uint32_t before = before_[at], next = next_[at];
    next_[before] = next;
    before_[next] = before;
    ++cut_off_;
    reflex_.choose(at, false);
    perhaps_ears_.remove(at);
    perhaps_flat_.remove(at);
    look_at(before);
    look_at(next);
    return next;
  }

  /// Makes a corner whose neighbors in the ring have changed a candidate.
  void look_at(std::uint32_t corner) {
    reflex_.choose(corner, area_at(corner) <= 0);
    perhaps_ears_.add(corner);
    perhaps_flat_.add(corner);
  }

  std::vector<Vector2d> places_;
  std::vector<std::uint32_t> next_, before_;
  std::size_t cut_off_ = 0;       ///< corners
  std::size_t all_asked_at_ = 0;  ///< how many were cut off when all corners became candidates again
  PlaceTree reflex_;              ///< corners that are not convex: if any lies in an ear, one of these does
  Candidates perhaps_ears_, perhaps_flat_;
  double flat_;  ///< twice the area, up to which a triangle counts as flat
};

}  // namespace

bool is_fan(std::span<const Vector3d> corners) {
  const Vector3d normal = newell(corners);
  // A triangle without area would leave its straight corner on the side of another one, and a sliver that
  // faces the other way would lie on it.
  constexpr double kRounding = 1e-12;
  const double least = kRounding * normal.squaredNorm();
  for (std::size_t i = 2; i < corners.size(); ++i)
    if ((corners[i - 1] - corners[0]).cross(corners[i] - corners[0]).dot(normal) <= least) return false;
  return true;
}

std::vector<Triangle> clip_ears(std::span<const Vector3d> corners, const RunContext& context) {
  return Ring(corners).clip(context);
}

}  // namespace hermesh
