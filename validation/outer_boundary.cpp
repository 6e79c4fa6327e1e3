#include "validation/outer_boundary.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <utility>

#include "algorithms/core/disjoint_sets.h"
#include "validation/geometry/near_pairs.h"

namespace hermesh::validation {
namespace {

/// How a part of a triangle lies to the solid.
enum class Role : std::uint8_t { inner, bounding, bounding_reversed, possible, copy };

constexpr double kCoarse = 1.0 / 32, kFine = 1.0 / 256, kStep = 1e-6;  // of the diagonal

double longest_edge(const Corners& t) {
  return std::max({(t[1] - t[0]).norm(), (t[2] - t[1]).norm(), (t[0] - t[2]).norm()});
}

double twice_area(const Corners& t) { return (t[1] - t[0]).cross(t[2] - t[0]).norm(); }

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
    tbb::parallel_for(std::size_t(0), speakers_.size(), [&](std::size_t i) {
      context_.check();
      roles_[speakers_[i]] = role_at(soup_.corners(speakers_[i]), {1, 1, 1}, speakers_[i]);
    });
    parts_.resize(cut_.size());
    tbb::parallel_for(std::size_t(0), cut_.size(), [&](std::size_t i) {
      context_.check();
      divide(soup_.corners(cut_[i]), cut_[i], parts_[i]);
    });
    return collect();
  }

 private:
  // Triangles that meet nothing but neighbours, joined where two face the same way over an edge of their own.
  void group() {
    const std::size_t n = soup_.triangles.size();
    meets_.assign(n, 0);
    for (const auto& [a, b] : pairs_) meets_[a] = meets_[b] = 1;
    DisjointSets sets(n);
    struct HalfEdge {
      std::uint32_t low, high, triangle;
      int way;
    };
    std::vector<HalfEdge> sides;
    sides.reserve(3 * n);
    for (std::uint32_t t = 0; t < n; ++t)
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = soup_.triangles[t][k], b = soup_.triangles[t][(k + 1) % 3];
        sides.push_back({std::min(a, b), std::max(a, b), t, a < b ? 1 : -1});
      }
    std::sort(sides.begin(), sides.end(), [](const HalfEdge& a, const HalfEdge& b) {
      return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.triangle < b.triangle;
    });
    for (std::size_t i = 0, end; i < sides.size(); i = end) {
      for (end = i + 1;
           end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high;)
        ++end;
      const std::uint32_t a = sides[i].triangle, b = sides[end - 1].triangle;
      if (end - i == 2 && sides[i].way + sides[i + 1].way == 0 && !meets_[a] && !meets_[b]) sets.join(a, b);
    }
    speaker_of_.resize(n);
    std::vector<std::uint32_t> largest(n, ~std::uint32_t(0));
    for (std::uint32_t t = 0; t < n; ++t) {
      std::uint32_t& best = largest[sets.find(t)];
      if (best == ~std::uint32_t(0) || twice_area(soup_.corners(t)) > twice_area(soup_.corners(best)))
        best = t;
    }
    for (std::uint32_t t = 0; t < n; ++t) {
      speaker_of_[t] = largest[sets.find(t)];
      if (meets_[t])
        cut_.push_back(t);
      else if (speaker_of_[t] == t)
        speakers_.push_back(t);
    }
  }

  OuterBoundary collect() const {
    OuterBoundary result;
    std::vector<std::uint8_t> bounds(soup_.triangles.size(), 0);
    result.bounding.points = result.possible.points = soup_.points;
    for (std::uint32_t t = 0; t < soup_.triangles.size(); ++t) {
      if (meets_[t]) continue;
      const Role role = roles_[speaker_of_[t]];
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

  /// The role of a triangle at a point of a part of it, which is given by the weights of the part's corners.
  Role role_at(const Corners& part, const Eigen::Vector3d& weights, std::size_t triangle) const {
    const Eigen::Vector3d at =
        (weights[0] * part[0] + weights[1] * part[1] + weights[2] * part[2]) / weights.sum();
    const Corners whole = soup_.corners(triangle);
    const Eigen::Vector3d normal = (whole[1] - whole[0]).cross(whole[2] - whole[0]).stableNormalized();
    if (is_copy(at, normal, triangle)) return Role::copy;
    const Side front = solid_.side(at + step_ * normal), back = solid_.side(at - step_ * normal);
    if (front == Side::outside && back == Side::inside) return Role::bounding;
    if (front == Side::inside && back == Side::outside) return Role::bounding_reversed;
    return front == back && front != Side::unknown ? Role::inner : Role::possible;
  }

  bool is_copy(const Eigen::Vector3d& at, const Eigen::Vector3d& normal, std::size_t triangle) const {
    if (!meets_[triangle]) return false;
    return !tree_.for_each_near({at, at}, step_, [&](std::uint32_t slot) {
      if (tree_.triangle(slot) >= triangle) return true;
      const Corners& t = tree_.corners(slot);
      const Eigen::Vector3d other = (t[1] - t[0]).cross(t[2] - t[0]).stableNormalized();
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
    const Eigen::Vector3d ab = 0.5 * (part[0] + part[1]), bc = 0.5 * (part[1] + part[2]),
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
  std::vector<std::array<std::uint32_t, 2>> pairs_;
  std::vector<std::uint8_t> meets_;  ///< for each triangle: whether it meets one that is no neighbour
  std::vector<std::uint32_t> speaker_of_, speakers_, cut_;
  std::vector<Role> roles_;   ///< roles of the triangles in speakers_
  std::vector<Parts> parts_;  ///< parts of the triangles in cut_
};

}  // namespace

OuterBoundary outer_boundary(const TriangleSoup& soup, const TriangleTree& tree, const Solid& solid,
                             const RunContext& context) {
  return Finder(soup, tree, solid, context).find();
}

}  // namespace hermesh::validation
