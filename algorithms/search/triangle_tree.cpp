#include "algorithms/search/triangle_tree.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <utility>

#include "algorithms/search/hilbert_order.h"

namespace hermesh {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kFan = TriangleTree::kFan;

/// Squared distances from p to four boxes; infinite to an empty one.
std::array<double, kFan> squared_distances(const TriangleTree::BoxPack& pack, double scale,
                                           const Eigen::Vector3d& p) {
  std::array<double, kFan> squared{};
  for (int a = 0; a < 3; ++a)
    for (std::size_t k = 0; k < kFan; ++k) {
      const double below = pack.lower[a][k] * scale - p[a], above = p[a] - pack.upper[a][k] * scale;
      const double nearer = below > above ? below : above;
      const double away = nearer > 0.0 ? nearer : 0.0;
      squared[k] += away * away;
    }
  return squared;
}

/// Squared distance from p to the box of a triangle: cheap, and rules most triangles out.
double squared_distance_to_box(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c) {
  double squared = 0.0;
  for (int k = 0; k < 3; ++k) {
    const double below = std::min({a[k], b[k], c[k]}) - p[k], above = p[k] - std::max({a[k], b[k], c[k]});
    const double away = std::max({below, above, 0.0});
    squared += away * away;
  }
  return squared;
}

/// An empty box, upside down: its distance is infinite, and adding a point to it gives the point.
void clear(TriangleTree::BoxPack& pack) {
  std::fill_n(&pack.lower[0][0], 3 * kFan, kInfinity);
  std::fill_n(&pack.upper[0][0], 3 * kFan, -kInfinity);
}

/// Boxes still to be visited, the one to visit next on top. Every level adds three more at most, and 2³²
/// triangles have 15 levels: 46 visits.
class VisitStack {
 public:
  struct Visit {
    double squared;
    TriangleTree::Node ref;
  };
  bool empty() const { return size_ == 0; }
  Visit pop() { return visits_[--size_]; }
  /// Pushes the four boxes of a pack that are within the bound, the nearest last.
  void push(std::size_t pack, std::uint32_t level, const std::array<double, kFan>& squared, double bound) {
    const std::size_t bottom = size_;
    for (std::size_t k = 0; k < kFan; ++k) {
      if (!(squared[k] <= bound)) continue;
      // Insertion keeps them in order; there are four at most. An empty box, which only an infinite bound
      // lets in, comes to lie below all others, and its turn comes when a triangle has been found.
      std::size_t at = size_++;
      for (; at > bottom && visits_[at - 1].squared < squared[k]; --at) visits_[at] = visits_[at - 1];
      visits_[at] = {squared[k], {static_cast<std::uint32_t>(pack * kFan + k), level}};
    }
  }

 private:
  std::array<Visit, 64> visits_;
  std::size_t size_ = 0;
};

}  // namespace

double squared_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c) {
  // Coordinates (x, y) in the triangle's plane along its longest side e from a corner o, and along the height
  // h upon it: the corners are (0,0), (1,0) and (f,1) with f in 0…1. Rounding turns h about e, which moves no
  // point of the triangle by more than a few units in the last place of |e|.
  const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
  const bool bc_longest = bc > ab && bc >= ca, ca_longest = ca > ab && !bc_longest;
  const Eigen::Vector3d& o = bc_longest ? b : ca_longest ? c : a;
  const Eigen::Vector3d& end = bc_longest ? c : ca_longest ? a : b;
  const Eigen::Vector3d& apex = bc_longest ? a : ca_longest ? b : c;
  const Eigen::Vector3d e = end - o, op = p - o;
  const double ee = bc_longest ? bc : ca_longest ? ca : ab;
  if (!(ee > 0)) return op.squaredNorm();
  const double f = std::clamp((apex - o).dot(e) / ee, 0.0, 1.0);
  // Where the height of a segment comes out as 0, y is 0 and the side e stands for the triangle.
  const Eigen::Vector3d h = (apex - o) - f * e;
  const double hh = h.squaredNorm();
  double x = op.dot(e) / ee, y = hh > 0 ? (op - x * e).dot(h) / hh : 0.0;
  if (y <= 0) {  // both angles at e are acute, so e is nearest
    x = std::clamp(x, 0.0, 1.0), y = 0.0;
  } else if (const bool left = x<y * f, right = x> 1 - y * (1 - f); left || right) {
    // Beyond one or both of the other sides, that from (0,0) to (f,1) and that from (1,0) to (f,1).
    const double t = std::clamp((x * f * ee + y * hh) / (f * f * ee + hh), 0.0, 1.0);
    const double g = f - 1, u = std::clamp(((x - 1) * g * ee + y * hh) / (g * g * ee + hh), 0.0, 1.0);
    const auto squared = [&](double dx, double dy) { return dx * dx * ee + dy * dy * hh; };
    // Each side has its foot; beyond both sides the nearer foot counts.
    const bool take_left = !right || (left && squared(x - t * f, y - t) <= squared(x - 1 - u * g, y - u));
    x = take_left ? t * f : 1 + u * g;
    y = take_left ? t : u;
  }
  return (op - x * e - y * h).squaredNorm();
}

TriangleTree::TriangleTree(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles,
                           double scale)
    : points_(points), triangles_(triangles), scale_(scale), order_(hilbert_order(points, triangles)) {
  build_boxes();
}

void TriangleTree::build_boxes() {
  // The number of packs of each level follows from the number of triangles alone, so all of them are there
  // before the first box is known.
  std::size_t total = 0;
  for (std::size_t boxes = (order_.size() + kLeafSize - 1) / kLeafSize; boxes > 0;) {
    const std::size_t packs = (boxes + kFan - 1) / kFan;
    first_.push_back(std::exchange(total, total + packs));
    boxes = packs > 1 ? packs : 0;
  }
  packs_.resize(total);
  // Level by level, since a level reads the one below; within a level each pack is written by one task only.
  for (std::size_t level = 0; level < first_.size(); ++level) {
    const std::size_t end = level + 1 < first_.size() ? first_[level + 1] : total;
    tbb::parallel_for(first_[level], end, [&](std::size_t pack) {
      clear(packs_[pack]);
      for (std::size_t k = 0; k < kFan; ++k) {
        const auto add = [&](const auto& lower, const auto& upper) {
          for (int a = 0; a < 3; ++a) {
            packs_[pack].lower[a][k] = std::min(packs_[pack].lower[a][k], lower(a));
            packs_[pack].upper[a][k] = std::max(packs_[pack].upper[a][k], upper(a));
          }
        };
        const std::size_t box = pack * kFan + k;
        if (level == 0) {
          for (const std::uint32_t t : leaf(box))
            for (const std::uint32_t corner : triangles_[t]) add(points_[corner], points_[corner]);
          continue;
        }
        const std::size_t below =
            child_pack({static_cast<std::uint32_t>(box), static_cast<std::uint32_t>(level)});
        // The last pack of a level may have lanes without children; they stay empty.
        if (below >= first_[level]) continue;
        const BoxPack& child = packs_[below];
        for (std::size_t i = 0; i < kFan; ++i)
          add([&](int a) { return child.lower[a][i]; }, [&](int a) { return child.upper[a][i]; });
      }
    });
  }
}

NearestTriangle TriangleTree::nearest(const Eigen::Vector3d& p, double upper_bound_squared,
                                      double enough_squared) const {
  // Branch and bound, depth first and the nearest box first, so that the bound shrinks early.
  NearestTriangle best{upper_bound_squared, kNone};
  if (packs_.empty()) return best;
  VisitStack stack;
  const auto push = [&](std::size_t pack, std::size_t level) {
    stack.push(pack, static_cast<std::uint32_t>(level), squared_distances(packs_[pack], scale_, p),
               best.squared);
  };
  push(packs_.size() - 1, level_count() - 1);
  while (!stack.empty()) {
    const auto [squared, ref] = stack.pop();
    // The bound may have shrunk since the box was pushed. A box just as far away as the best triangle is
    // opened all the same: it may hold one of lower number, which wins among equals.
    if (squared > best.squared) continue;
    if (ref.level > 0) {
      push(child_pack(ref), ref.level - 1);
      continue;
    }
    for (const std::uint32_t t : leaf(ref.box)) {
      const Eigen::Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
      if (squared_distance_to_box(p, a, b, c) > best.squared) continue;
      const double d = squared_distance(p, a, b, c);
      if (d < best.squared || (d == best.squared && t < best.triangle)) best = {d, t};
      if (d <= enough_squared) return best;
    }
  }
  return best;
}

}  // namespace hermesh
