#include "algorithms/search/triangle_tree.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <utility>

#include "algorithms/core/bounds.h"

namespace hermesh {
namespace {

// ---- The order along a Hilbert curve.

constexpr int kBits = 10;                      ///< bits of a cell's coordinate
constexpr std::size_t kBatch = 256;            ///< triangles whose codes are computed together
constexpr std::size_t kKeysPerTask = 1 << 15;  ///< keys of one task
constexpr std::size_t kCrowded = 32;  ///< triangles in a cell beyond which it gets a curve of its own

/// Code along the curve in the upper half, triangle number in the lower.
using SortKey = std::uint64_t;
/// One array per axis, so that a loop over a batch is vectorised.
using Cells = std::array<std::array<std::uint32_t, kBatch>, 3>;

/// Converts cell coordinates to positions along the curve, in place and transposed: the code's bits are those
/// of x, y and z in turn (Skilling, Programming the Hilbert Curve, AIP Conf. Proc. 707, 2004). It is
/// branch-free and processes many cells at a time.
void to_hilbert(Cells& cells) {
  // Skilling's inverse of rotations and reflections, from the largest cubes to the smallest: where the bit is
  // set the lower bits of x are inverted, elsewhere they are exchanged with those of coordinate a.
  for (std::uint32_t bit = 1u << (kBits - 1); bit > 1; bit >>= 1)
    for (int a = 0; a < 3; ++a)
      for (std::size_t i = 0; i < kBatch; ++i) {
        const std::uint32_t x = cells[0][i], y = cells[a][i];
        const std::uint32_t invert = (y & bit) ? bit - 1 : 0;
        const std::uint32_t exchange = (x ^ y) & (bit - 1) & ~invert;
        cells[a][i] = y ^ exchange;
        cells[0][i] = (a == 0 ? y : x) ^ exchange ^ invert;
      }
  // Skilling's Gray encoding; his loop over bits is an exclusive or of prefixes here.
  for (std::size_t i = 0; i < kBatch; ++i) {
    cells[1][i] ^= cells[0][i];
    cells[2][i] ^= cells[1][i];
    std::uint32_t gray = cells[2][i];  // bit k becomes the exclusive or of the bits above k
    for (int shift = 1; shift < kBits; shift *= 2) gray ^= gray >> shift;
    gray >>= 1;
    for (int a = 0; a < 3; ++a) cells[a][i] ^= gray;
  }
}

/// Moves bit k of ten to bit 3k.
std::uint32_t spread(std::uint32_t v) {
  v = (v | (v << 16)) & 0x030000ffu;
  v = (v | (v << 8)) & 0x0300f00fu;
  v = (v | (v << 4)) & 0x030c30c3u;
  return (v | (v << 2)) & 0x09249249u;
}

template <class F>
void for_chunks(std::size_t n, std::size_t size, F&& f) {
  tbb::parallel_for(std::size_t{0}, (n + size - 1) / size,
                    [&](std::size_t chunk) { f(chunk * size, std::min(n, (chunk + 1) * size)); });
}

class CurveSorter {
 public:
  CurveSorter(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles)
      : points_(points), triangles_(triangles) {}

  /// Sorts keys along a curve through the cube that holds the centers of their triangles, equal codes by
  /// triangle number. The keys come in order of triangle number.
  void sort(std::span<SortKey> keys) const {
    const BoundsOf<float> box = bounds_of_centres(keys);
    const double side = (box.upper.cast<double>() - box.lower.cast<double>()).maxCoeff();
    if (!(side > 0)) return;
    // Half a cell less than the cube has, so that the farthest center lies in the last cell despite rounding.
    const double cells_per_unit = ((1 << kBits) - 0.5) / side;
    for_chunks(keys.size(), kBatch, [&](std::size_t begin, std::size_t end) {
      compute_codes(keys.subspan(begin, end - begin), box.lower.cast<double>(), cells_per_unit);
    });
    tbb::parallel_sort(keys.begin(), keys.end());
    sort_crowded_cells(keys);
  }

 private:
  /// Returns the center of the triangle's box. Halves are added, since the sum of two finite floats may be
  /// infinite.
  Eigen::Vector3f centre(SortKey key) const {
    const Triangle& t = triangles_[static_cast<std::uint32_t>(key)];
    const Eigen::Vector3f &a = points_[t[0]], &b = points_[t[1]], &c = points_[t[2]];
    return 0.5f * a.cwiseMin(b).cwiseMin(c) + 0.5f * a.cwiseMax(b).cwiseMax(c);
  }

  BoundsOf<float> bounds_of_centres(std::span<const SortKey> keys) const {
    return tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, keys.size(), kKeysPerTask), BoundsOf<float>(),
        [&](const tbb::blocked_range<std::size_t>& range, BoundsOf<float> box) {
          for (std::size_t i = range.begin(); i < range.end(); ++i) box.add(centre(keys[i]));
          return box;
        },
        [](BoundsOf<float> a, const BoundsOf<float>& b) {
          a.add(b);
          return a;
        });
  }

  void compute_codes(std::span<SortKey> keys, const Eigen::Vector3d& lower, double cells_per_unit) const {
    Cells cells{};
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const Eigen::Vector3d place = (centre(keys[i]).cast<double>() - lower) * cells_per_unit;
      for (int a = 0; a < 3; ++a)
        cells[a][i] = static_cast<std::uint32_t>(static_cast<std::int32_t>(place[a]));
    }
    to_hilbert(cells);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const std::uint32_t code = spread(cells[0][i]) << 2 | spread(cells[1][i]) << 1 | spread(cells[2][i]);
      keys[i] = SortKey{code} << 32 | static_cast<std::uint32_t>(keys[i]);
    }
  }

  // The side of a cell is a thousandth of the cube's, so a few levels separate all centers that differ; equal
  // ones end in sort() with a cube of no size. Tasks sort spans that do not overlap.
  void sort_crowded_cells(std::span<SortKey> keys) const {
    std::vector<std::span<SortKey>> crowded;
    for (std::size_t begin = 0, end; begin < keys.size(); begin = end) {
      for (end = begin + 1; end < keys.size() && (keys[end] ^ keys[begin]) >> 32 == 0;) ++end;
      if (end - begin > kCrowded) crowded.push_back(keys.subspan(begin, end - begin));
    }
    tbb::parallel_for(std::size_t{0}, crowded.size(), [&](std::size_t i) { sort(crowded[i]); });
  }

  std::span<const Eigen::Vector3f> points_;
  std::span<const Triangle> triangles_;
};

/// Returns the numbers of the triangles in the order in which a Hilbert curve through the bounding cube, 1024
/// cells a side, meets the centers of their boxes. Crowded cells are ordered by a curve of their own, and so
/// on; triangles with the same center are ordered by number. The result is the same for every number of
/// threads.
std::vector<std::uint32_t> hilbert_order(std::span<const Eigen::Vector3f> points,
                                         std::span<const Triangle> triangles) {
  std::vector<SortKey> keys(triangles.size());
  for (std::size_t i = 0; i < keys.size(); ++i) keys[i] = i;
  CurveSorter(points, triangles).sort(keys);
  std::vector<std::uint32_t> order(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order[i] = static_cast<std::uint32_t>(keys[i]);
  return order;
}

// ---- The tree.

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kFan = TriangleTree::kFan;

/// Returns the squared distances from p to four boxes; infinite to an empty one.
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

/// Returns the squared distance from p to the box of a triangle: cheap, and excludes most triangles.
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

/// Makes the boxes empty, with lower > upper: their distance is infinite, and adding a point gives the point.
void clear(TriangleTree::BoxPack& pack) {
  std::fill_n(&pack.lower[0][0], 3 * kFan, kInfinity);
  std::fill_n(&pack.upper[0][0], 3 * kFan, -kInfinity);
}

/// Boxes still to be visited, the next one on top. Every level adds at most three, and 2³² triangles have 15
/// levels: 46 visits.
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
      // An empty box, which only an infinite bound admits, comes to lie below all others.
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
  // Coordinates (x, y) in the triangle's plane along its longest side e from a corner o, and along its height
  // h: the corners are (0,0), (1,0) and (f,1) with f in 0…1. Rounding rotates h about e, which moves no point
  // of the triangle by more than a few units in the last place of |e|.
  const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
  const bool bc_longest = bc > ab && bc >= ca, ca_longest = ca > ab && !bc_longest;
  const Eigen::Vector3d& o = bc_longest ? b : ca_longest ? c : a;
  const Eigen::Vector3d& end = bc_longest ? c : ca_longest ? a : b;
  const Eigen::Vector3d& apex = bc_longest ? a : ca_longest ? b : c;
  const Eigen::Vector3d e = end - o, op = p - o;
  const double ee = bc_longest ? bc : ca_longest ? ca : ab;
  if (!(ee > 0)) return op.squaredNorm();
  const double f = std::clamp((apex - o).dot(e) / ee, 0.0, 1.0);
  // If the height rounds to 0, y is 0 and only the side e counts.
  const Eigen::Vector3d h = (apex - o) - f * e;
  const double hh = h.squaredNorm();
  double x = op.dot(e) / ee, y = hh > 0 ? (op - x * e).dot(h) / hh : 0.0;
  if (y <= 0) {  // both angles at e are acute, so e is nearest
    x = std::clamp(x, 0.0, 1.0), y = 0.0;
  } else if (const bool left = x<y * f, right = x> 1 - y * (1 - f); left || right) {
    // Beyond one or both of the other sides, from (0,0) to (f,1) and from (1,0) to (f,1).
    const double t = std::clamp((x * f * ee + y * hh) / (f * f * ee + hh), 0.0, 1.0);
    const double g = f - 1, u = std::clamp(((x - 1) * g * ee + y * hh) / (g * g * ee + hh), 0.0, 1.0);
    const auto squared = [&](double dx, double dy) { return dx * dx * ee + dy * dy * hh; };
    // Beyond both sides the nearer foot counts.
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
  // The number of packs of each level follows from the number of triangles.
  std::size_t total = 0;
  for (std::size_t boxes = (order_.size() + kLeafSize - 1) / kLeafSize; boxes > 0;) {
    const std::size_t packs = (boxes + kFan - 1) / kFan;
    first_.push_back(std::exchange(total, total + packs));
    boxes = packs > 1 ? packs : 0;
  }
  packs_.resize(total);
  // Level by level, since a level reads the one below.
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
        // The last pack of a level may have lanes without children.
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
    // The bound may have shrunk since the box was pushed. A box exactly as far away as the best triangle is
    // opened: it may hold one of lower number, which wins among equals.
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
