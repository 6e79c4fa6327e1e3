#include "validation/outer_boundary.h"

#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "algorithms/core/disjoint_sets.h"
#include "validation/geometry/sum_ranges.h"

namespace hermesh::validation {
namespace {

using Eigen::Vector3d;
/// The numbers of two triangles, the smaller one first.
using TrianglePair = std::array<std::uint32_t, 2>;

/// Returns the squared distance of two segments (Ericson, Real-Time Collision Detection, 2005, §5.1.9).
double squared_distance_of_segments(const Vector3d& p1, const Vector3d& q1, const Vector3d& p2,
                                    const Vector3d& q2) {
  const Vector3d d1 = q1 - p1, d2 = q2 - p2, r = p1 - p2;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), b = d1.dot(d2), c = d1.dot(r), f = d2.dot(r);
  const double denominator = a * e - b * b;
  double s = denominator > 1e-12 * a * e ? std::clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  double t = (b * s + f) / e;
  if (t < 0.0 || t > 1.0) {
    t = std::clamp(t, 0.0, 1.0);
    s = std::clamp((b * t - c) / a, 0.0, 1.0);
  }
  return (p1 + s * d1 - p2 - t * d2).squaredNorm();
}

bool pierces(const Vector3d& p, const Vector3d& q, const Corners& t, const Vector3d& normal) {
  const double from = normal.dot(p - t[0]), to = normal.dot(q - t[0]);
  if (from * to > 0.0 || from == to) return false;
  const Vector3d at = p + from / (from - to) * (q - p);
  for (int k = 0; k < 3; ++k)
    if (normal.cross(t[(k + 1) % 3] - t[k]).dot(at - t[k]) < 0.0) return false;
  return true;
}

class NearPairSearch {
 public:
  NearPairSearch(const TriangleSoup& soup, const TriangleTree& tree, double reach)
      : soup_(soup), tree_(tree), reach_(reach), squared_(reach * reach) {}

  void search(std::size_t slot, std::vector<TrianglePair>& pairs) const {
    const std::uint32_t a = tree_.triangle(slot);
    const Corners& first = tree_.corners(slot);
    const Vector3d normal = area_vector(first).stableNormalized();
    tree_.for_each_near(box_of(first), reach_, [&](std::uint32_t other) {
      const std::uint32_t b = tree_.triangle(other);
      if (a < b && !apart(first, normal, tree_.corners(other)) && near(a, first, b, tree_.corners(other)))
        pairs.push_back({a, b});
      return true;
    });
  }

 private:
  bool apart(const Corners& plane, const Vector3d& normal, const Corners& t) const {
    double least = std::numeric_limits<double>::infinity(), greatest = -least;
    for (const Vector3d& corner : t) {
      const double height = normal.dot(corner - plane[0]);
      least = std::min(least, height), greatest = std::max(greatest, height);
    }
    return least > reach_ || greatest < -reach_;
  }

  bool near(std::uint32_t a, const Corners& ca, std::uint32_t b, const Corners& cb) const {
    const Triangle &ta = soup_.triangles[a], &tb = soup_.triangles[b];
    const auto in = [](std::uint32_t p, const Triangle& t) { return p == t[0] || p == t[1] || p == t[2]; };
    std::array<bool, 3> a_shared{}, b_shared{};
    for (std::size_t k = 0; k < 3; ++k) a_shared[k] = in(ta[k], tb), b_shared[k] = in(tb[k], ta);
    if (std::ranges::count(a_shared, true) == 3) return true;
    return opposite_comes_near(ca, a_shared, cb) || opposite_comes_near(cb, b_shared, ca);
  }

  /// Returns true if a corner or a side without shared corners comes near the other triangle.
  bool opposite_comes_near(const Corners& c, const std::array<bool, 3>& shared, const Corners& t) const {
    const Vector3d normal = area_vector(t);
    for (std::size_t k = 0; k < 3; ++k) {
      if (shared[k]) continue;
      if ((closest_point(t, c[k]) - c[k]).squaredNorm() <= squared_) return true;
      const std::size_t next = (k + 1) % 3;
      if (shared[next]) continue;
      if (pierces(c[k], c[next], t, normal)) return true;
      for (std::size_t side = 0; side < 3; ++side)
        if (squared_distance_of_segments(c[k], c[next], t[side], t[(side + 1) % 3]) <= squared_) return true;
    }
    return false;
  }

  const TriangleSoup& soup_;
  const TriangleTree& tree_;
  double reach_, squared_;
};

/// Returns pairs of triangles that intersect or nearly intersect although they are not neighbours, by their
/// numbers, in increasing order. A pair is listed if
///  - the two share no corner and come within `reach` of one another;
///  - they share one corner, and a side opposite to it comes within `reach` of the other triangle;
///  - they share two, and a corner opposite to their edge comes within `reach` of the other triangle;
///  - they share all three.
/// Corners are shared by number. Faces that coincide except for rounding are such pairs, which exact
/// predicates (self_intersection.h) would separate; a triangle smaller than `reach` may be one with its
/// neighbours.
/// @throws Cancelled.
std::vector<TrianglePair> near_pairs(const TriangleSoup& soup, const TriangleTree& tree, double reach,
                                     const RunContext& context) {
  const NearPairSearch search(soup, tree, reach);
  struct Found {
    std::vector<TrianglePair> pairs;
    void append(const Found& later) { pairs.insert(pairs.end(), later.pairs.begin(), later.pairs.end()); }
  };
  Found found =
      sum_ranges<Found>(tree.size(), 1024, context, [&](std::size_t begin, std::size_t end, Found& sum) {
        for (std::size_t slot = begin; slot < end; ++slot) search.search(slot, sum.pairs);
      });
  tbb::parallel_sort(found.pairs.begin(), found.pairs.end());
  return std::move(found.pairs);
}

/// The position of a part of a triangle relative to the solid.
enum class Role : std::uint8_t { inner, bounding, bounding_reversed, possible, copy };

constexpr double kCoarse = 1.0 / 32, kFine = 1.0 / 256, kStep = 1e-6;  // of the diagonal

double longest_edge(const Corners& t) {
  return std::max({(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()});
}

double twice_area(const Corners& t) { return area_vector(t).norm(); }

/// The parts of one triangle that is cut, with their areas.
struct Parts {
  std::vector<std::pair<Corners, Role>> list;
  double area = 0.0, possible_area = 0.0;

  void add(const Corners& t, Role role) {
    if (role == Role::inner || role == Role::copy) return;
    (role == Role::possible ? possible_area : area) += 0.5 * twice_area(t);
    list.emplace_back(t, role);
  }
};

Triangle turned(const Triangle& t, Role role) {
  return role == Role::bounding_reversed ? Triangle{t[0], t[2], t[1]} : t;
}

class Finder {
 public:
  Finder(const TriangleSoup& soup, const TriangleTree& tree, const Solid& solid, const RunContext& context)
      : soup_(soup), tree_(tree), solid_(solid), context_(context), diagonal_(tree.bounds().diagonal()) {
    const double far =
        std::max(tree.bounds().lower.cwiseAbs().maxCoeff(), tree.bounds().upper.cwiseAbs().maxCoeff());
    step_ = std::max(kStep * diagonal_, 64.0 * std::numeric_limits<double>::epsilon() * far);
  }

  OuterBoundary find() {
    pairs_ = near_pairs(soup_, tree_, 2.0 * step_, context_);
    group();
    roles_.assign(soup_.triangles.size(), Role::inner);
    tbb::parallel_for(std::size_t(0), representatives_.size(), [&](std::size_t i) {
      context_.check();
      roles_[representatives_[i]] =
          role_at(soup_.corners(representatives_[i]), {1, 1, 1}, representatives_[i]);
    });
    parts_.resize(cut_.size());
    tbb::parallel_for(std::size_t(0), cut_.size(), [&](std::size_t i) {
      context_.check();
      divide(soup_.corners(cut_[i]), cut_[i], parts_[i]);
    });
    return collect();
  }

 private:
  // Groups triangles that intersect only neighbours, across edges with two consistently oriented sides.
  void group() {
    const std::size_t n = soup_.triangles.size();
    meets_.assign(n, 0);
    for (const auto& [a, b] : pairs_) meets_[a] = meets_[b] = 1;
    DisjointSets sets(n);
    for_each_edge(sorted_sides(soup_.triangles), [&](std::span<const TriangleSide> sides) {
      const std::uint32_t a = sides.front().triangle, b = sides.back().triangle;
      if (sides.size() == 2 && sides[0].direction + sides[1].direction == 0 && !meets_[a] && !meets_[b])
        sets.join(a, b);
    });
    representative_of_.resize(n);
    std::vector<std::uint32_t> largest(n, ~std::uint32_t(0));
    for (std::uint32_t t = 0; t < n; ++t) {
      std::uint32_t& best = largest[sets.find(t)];
      if (best == ~std::uint32_t(0) || twice_area(soup_.corners(t)) > twice_area(soup_.corners(best)))
        best = t;
    }
    for (std::uint32_t t = 0; t < n; ++t) {
      representative_of_[t] = largest[sets.find(t)];
      if (meets_[t])
        cut_.push_back(t);
      else if (representative_of_[t] == t)
        representatives_.push_back(t);
    }
  }

  OuterBoundary collect() const {
    OuterBoundary result;
    std::vector<std::uint8_t> bounds(soup_.triangles.size(), 0);
    result.bounding.points = result.possible.points = soup_.points;
    for (std::uint32_t t = 0; t < soup_.triangles.size(); ++t) {
      if (meets_[t]) continue;
      const Role role = roles_[representative_of_[t]];
      if (role == Role::inner) continue;
      const bool possible = role == Role::possible;
      (possible ? result.possible_area : result.area) += 0.5 * twice_area(soup_.corners(t));
      (possible ? result.possible : result.bounding).triangles.push_back(turned(soup_.triangles[t], role));
      bounds[t] = !possible;
    }
    for (std::size_t i = 0; i < cut_.size(); ++i) {
      result.area += parts_[i].area;
      result.possible_area += parts_[i].possible_area;
      bounds[cut_[i]] = parts_[i].area > 0.0;
      for (const auto& [corners, role] : parts_[i].list) {
        MeshFile& mesh = role == Role::possible ? result.possible : result.bounding;
        const std::uint32_t first = std::uint32_t(mesh.points.size());
        mesh.points.insert(mesh.points.end(), corners.begin(), corners.end());
        mesh.triangles.push_back(turned({first, first + 1, first + 2}, role));
      }
    }
    result.components = count_components(bounds);
    result.finest = cut_.empty() ? step_ : kFine * diagonal_;
    return result;
  }

  /// Returns the role of a triangle at a point of a part of it, given by the weights of the part's corners.
  Role role_at(const Corners& part, const Vector3d& weights, std::size_t triangle) const {
    const Vector3d at = (weights[0] * part[0] + weights[1] * part[1] + weights[2] * part[2]) / weights.sum();
    const Corners whole = soup_.corners(triangle);
    const Vector3d normal = area_vector(whole).stableNormalized();
    if (is_copy(at, normal, triangle)) return Role::copy;
    const Side front = solid_.side(at + step_ * normal), back = solid_.side(at - step_ * normal);
    if (front == Side::outside && back == Side::inside) return Role::bounding;
    if (front == Side::inside && back == Side::outside) return Role::bounding_reversed;
    return front == back && front != Side::unknown ? Role::inner : Role::possible;
  }

  bool is_copy(const Vector3d& at, const Vector3d& normal, std::size_t triangle) const {
    if (!meets_[triangle]) return false;
    return !tree_.for_each_near({at, at}, step_, [&](std::uint32_t slot) {
      if (tree_.triangle(slot) >= triangle) return true;
      const Corners& t = tree_.corners(slot);
      const Vector3d other = area_vector(t).stableNormalized();
      return std::abs(other.dot(normal)) < 1.0 - 1e-9 || (closest_point(t, at) - at).norm() > step_;
    });
  }

  void divide(const Corners& part, std::size_t triangle, Parts& parts) const {
    const Role role = role_at(part, {1, 1, 1}, triangle);
    const double longest = longest_edge(part);
    if (longest <= kFine * diagonal_) return parts.add(part, role);
    if (longest <= kCoarse * diagonal_ && role_at(part, {18, 1, 1}, triangle) == role &&
        role_at(part, {1, 18, 1}, triangle) == role && role_at(part, {1, 1, 18}, triangle) == role)
      return parts.add(part, role);
    const Vector3d ab = 0.5 * (part[0] + part[1]), bc = 0.5 * (part[1] + part[2]),
                   ca = 0.5 * (part[2] + part[0]);
    for (const Corners& quarter :
         {Corners{part[0], ab, ca}, Corners{ab, part[1], bc}, Corners{ca, bc, part[2]}, Corners{ab, bc, ca}})
      divide(quarter, triangle, parts);
  }

  std::int64_t count_components(const std::vector<std::uint8_t>& bounds) const {
    DisjointSets sets(bounds.size());
    std::vector<std::uint32_t> at_point(soup_.points.size(), ~std::uint32_t(0));
    for (std::uint32_t t = 0; t < bounds.size(); ++t) {
      if (!bounds[t]) continue;
      for (std::uint32_t p : soup_.triangles[t]) {
        if (at_point[p] == ~std::uint32_t(0))
          at_point[p] = t;
        else
          sets.join(at_point[p], t);
      }
    }
    for (const auto& [a, b] : pairs_)
      if (bounds[a] && bounds[b]) sets.join(a, b);
    std::int64_t components = 0;
    for (std::uint32_t t = 0; t < bounds.size(); ++t) components += bounds[t] && sets.find(t) == t;
    return components;
  }

  const TriangleSoup& soup_;
  const TriangleTree& tree_;
  const Solid& solid_;
  const RunContext& context_;
  double diagonal_, step_ = 0.0;
  std::vector<TrianglePair> pairs_;
  std::vector<std::uint8_t> meets_;  ///< for each triangle: 1 if it intersects one that is not a neighbour
  std::vector<std::uint32_t> representative_of_, representatives_, cut_;
  std::vector<Role> roles_;   ///< roles of the triangles in representatives_
  std::vector<Parts> parts_;  ///< parts of the triangles in cut_
};

}  // namespace

OuterBoundary outer_boundary(const TriangleSoup& soup, const TriangleTree& tree, const Solid& solid,
                             const RunContext& context) {
  return Finder(soup, tree, solid, context).find();
}

}  // namespace hermesh::validation
