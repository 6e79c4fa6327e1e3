#include "validation/self_intersection.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>

#include "validation/geometry/exact_predicates.h"
#include "validation/geometry/sum_ranges.h"

namespace hermesh::validation {
namespace {

// The shared corners of two triangles: the first `count` of ia and ib are shared, the rest follow.
struct SharedCorners {
  int count = 0;
  std::array<int, 3> ia{}, ib{};
};

SharedCorners shared_corners(const Triangle& a, const Triangle& b) {
  SharedCorners s;
  std::array<bool, 3> in_b{};
  int rest = 3;
  for (int i = 0; i < 3; ++i) {
    int j = 0;
    while (j < 3 && a[i] != b[j]) ++j;
    if (j == 3) {
      s.ia[--rest] = i;
      continue;
    }
    in_b[j] = true;
    s.ia[s.count] = i;
    s.ib[s.count++] = j;
  }
  for (int j = 0, next = s.count; j < 3; ++j)
    if (!in_b[j]) s.ib[next++] = j;
  return s;
}

int side_of(const Corners& plane, const Eigen::Vector3d& point) {
  return orientation(plane[0], plane[1], plane[2], point);
}

// Returns true if all of t lies strictly on one side of the plane of s.
bool apart(const Corners& s, const Corners& t) {
  const int first = side_of(s, t[0]);
  return first != 0 && side_of(s, t[1]) == first && side_of(s, t[2]) == first;
}

// Two triangles that share corner v intersect elsewhere if and only if the side opposite to v of one
// intersects the other: if they share a second point they share the ray from v through it within both, and
// its end is on the side opposite to v of the triangle that ends first.
bool meet_beyond_corner(const Corners& a, const Corners& b, const SharedCorners& s) {
  const Eigen::Vector3d &a1 = a[s.ia[1]], &a2 = a[s.ia[2]], &b1 = b[s.ib[1]], &b2 = b[s.ib[2]];
  if (side_of(b, a1) * side_of(b, a2) > 0 || side_of(a, b1) * side_of(a, b2) > 0) return false;
  return segment_meets_triangle(a1, a2, b) || segment_meets_triangle(b1, b2, a);
}

bool fold_together(const Corners& a, const Corners& b, const SharedCorners& s) {
  const Eigen::Vector3d &p = a[s.ia[0]], &q = a[s.ia[1]], &r = a[s.ia[2]], &t = b[s.ib[2]];
  return orientation(p, q, r, t) == 0 && same_side(p, q, r, t);
}

// How two triangles of a mesh intersect beyond their shared corners.
enum class PairKind { none, disjoint, vertex_sharing, edge_sharing };

PairKind classify(const Triangle& ia, const Corners& a, const Triangle& ib, const Corners& b) {
  const SharedCorners s = shared_corners(ia, ib);
  switch (s.count) {
    case 0:
      return !apart(a, b) && !apart(b, a) && triangles_meet(a, b) ? PairKind::disjoint : PairKind::none;
    case 1:
      return meet_beyond_corner(a, b, s) ? PairKind::vertex_sharing : PairKind::none;
    case 2:
      return fold_together(a, b, s) ? PairKind::edge_sharing : PairKind::none;
    default:
      return PairKind::edge_sharing;
  }
}

struct Intersection {
  std::uint32_t first, second;  // triangles, first < second
  Eigen::Vector3d point;
  bool operator<(const Intersection& o) const {
    return first != o.first ? first < o.first : second < o.second;
  }
};

struct Found {
  std::int64_t disjoint = 0, vertex_sharing = 0, edge_sharing = 0;
  std::vector<Intersection> list;  // at least the kMaxPlaces smallest

  void add(PairKind kind, const Intersection& intersection) {
    disjoint += kind == PairKind::disjoint;
    vertex_sharing += kind == PairKind::vertex_sharing;
    edge_sharing += kind == PairKind::edge_sharing;
    list.push_back(intersection);
    if (list.size() >= 16 * kMaxPlaces) keep_smallest();
  }
  void append(const Found& o) {
    disjoint += o.disjoint;
    vertex_sharing += o.vertex_sharing;
    edge_sharing += o.edge_sharing;
    list.insert(list.end(), o.list.begin(), o.list.end());
    keep_smallest();
  }
  void keep_smallest() {
    std::sort(list.begin(), list.end());
    if (list.size() > kMaxPlaces) list.resize(kMaxPlaces);
  }
};

class IntersectionSearch {
 public:
  IntersectionSearch(const TriangleSoup& soup, const TriangleTree& tree)
      : soup_(soup), tree_(tree), boxes_(tree.size()), degenerate_(tree.size()) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, tree.size(), 4096), [this](const auto& range) {
      for (std::size_t slot = range.begin(); slot < range.end(); ++slot) {
        boxes_[slot] = box_of(tree_.corners(slot));
        degenerate_[slot] = collinear(tree_.corners(slot));
      }
    });
  }

  void search_leaf(std::size_t leaf, Found& found) const {
    const std::size_t begin = tree_.first_slot(leaf), end = tree_.first_slot(leaf + 1);
    tree_.for_each_overlapping_leaf(leaf, [&](std::size_t other) {
      const Box& other_box = tree_.leaf_box(other);
      const std::size_t other_end = tree_.first_slot(other + 1);
      for (std::size_t i = begin; i < end; ++i) {
        if (degenerate_[i] || !boxes_[i].overlaps(other_box)) continue;
        for (std::size_t j = other == leaf ? i + 1 : tree_.first_slot(other); j < other_end; ++j)
          if (boxes_[i].overlaps(boxes_[j]) && !degenerate_[j]) test(i, j, found);
      }
    });
  }

 private:
  void test(std::size_t i, std::size_t j, Found& found) const {
    const std::uint32_t a = tree_.triangle(i), b = tree_.triangle(j);
    const PairKind kind =
        classify(soup_.triangles[a], tree_.corners(i), soup_.triangles[b], tree_.corners(j));
    if (kind == PairKind::none) return;
    const Box overlap{boxes_[i].lower.cwiseMax(boxes_[j].lower), boxes_[i].upper.cwiseMin(boxes_[j].upper)};
    found.add(kind, {std::min(a, b), std::max(a, b), overlap.centre()});
  }

  const TriangleSoup& soup_;
  const TriangleTree& tree_;
  std::vector<Box> boxes_;
  std::vector<std::uint8_t> degenerate_;
};

}  // namespace

SelfIntersections find_self_intersections(const TriangleSoup& soup, const TriangleTree& tree,
                                          RunContext& context) {
  const IntersectionSearch search(soup, tree);
  Found found =
      sum_ranges<Found>(tree.leaves(), 256, context, [&](std::size_t begin, std::size_t end, Found& sum) {
        for (std::size_t leaf = begin; leaf < end; ++leaf) {
          context.check();
          search.search_leaf(leaf, sum);
        }
      });
  found.keep_smallest();
  SelfIntersections result;
  result.disjoint = found.disjoint;
  result.vertex_sharing = found.vertex_sharing;
  result.edge_sharing = found.edge_sharing;
  result.pairs = found.disjoint + found.vertex_sharing + found.edge_sharing;
  for (const Intersection& o : found.list)
    result.places.add(o.point, soup.polygon(o.first), soup.polygon(o.second));
  return result;
}

}  // namespace hermesh::validation
