#include "validation/geometry/near_pairs.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <Eigen/Geometry>
#include <algorithm>

namespace hermesh::validation {
namespace {

using Eigen::Vector3d;
using Pairs = std::vector<std::array<std::uint32_t, 2>>;

/// The squared distance of two segments (Ericson, Real-Time Collision Detection, 2005, §5.1.9).
double squared_distance(const Vector3d& p1, const Vector3d& q1, const Vector3d& p2, const Vector3d& q2) {
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

  void search(std::size_t slot, Pairs& pairs) const {
    const std::uint32_t a = tree_.triangle(slot);
    const Corners& first = tree_.corners(slot);
    const Vector3d normal = (first[1] - first[0]).cross(first[2] - first[0]).stableNormalized();
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

  /// Whether a corner or a side without shared corners comes near the other triangle.
  bool opposite_comes_near(const Corners& c, const std::array<bool, 3>& shared, const Corners& t) const {
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    for (std::size_t k = 0; k < 3; ++k) {
      if (shared[k]) continue;
      if ((closest_point(t, c[k]) - c[k]).squaredNorm() <= squared_) return true;
      const std::size_t next = (k + 1) % 3;
      if (shared[next]) continue;
      if (pierces(c[k], c[next], t, normal)) return true;
      for (std::size_t side = 0; side < 3; ++side)
        if (squared_distance(c[k], c[next], t[side], t[(side + 1) % 3]) <= squared_) return true;
    }
    return false;
  }

  const TriangleSoup& soup_;
  const TriangleTree& tree_;
  double reach_, squared_;
};

}  // namespace

Pairs near_pairs(const TriangleSoup& soup, const TriangleTree& tree, double reach,
                 const RunContext& context) {
  const NearPairSearch search(soup, tree, reach);
  const auto search_range = [&](const tbb::blocked_range<std::size_t>& range, Pairs pairs) {
    context.check();
    for (std::size_t slot = range.begin(); slot < range.end(); ++slot) search.search(slot, pairs);
    return pairs;
  };
  const auto join = [](Pairs left, const Pairs& right) {
    left.insert(left.end(), right.begin(), right.end());
    return left;
  };
  Pairs pairs = tbb::parallel_deterministic_reduce(tbb::blocked_range<std::size_t>(0, tree.size(), 1024),
                                                   Pairs{}, search_range, join);
  tbb::parallel_sort(pairs.begin(), pairs.end());
  return pairs;
}

}  // namespace hermesh::validation
