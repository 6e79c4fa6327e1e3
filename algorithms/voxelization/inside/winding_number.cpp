#include "algorithms/voxelization/inside/winding_number.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace hermesh {
namespace {

using winding::Multipole;
using winding::PlacedTriangle;
using winding::Targets;
using Node = TriangleTree::Node;

constexpr std::size_t kFan = TriangleTree::kFan;
constexpr std::size_t kMaxBatch = 512;  ///< points that share one descent
constexpr std::size_t kGroup = 64;      ///< points that share a list of triangles
/// Triangles that reach farther than this many extents of the batch are taken in double precision: single
/// precision would misplace their corners by more than 1e-6 of the extent.
constexpr double kFarAway = 16.0;
/// Boxes this many radii away add less than 1e-23, and their cubes would overflow.
constexpr double kVeryFar = 1e12;

constexpr int kPair[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
constexpr int kTriple[10][3] = {{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {0, 1, 1}, {0, 1, 2},
                                {0, 2, 2}, {1, 1, 1}, {1, 1, 2}, {1, 2, 2}, {2, 2, 2}};
/// Where a pair's component is in kPair's order.
constexpr int kPlace[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

/// A box of the tree, in the unit of its points; lower > upper if it is empty.
Bounds box_of(const TriangleTree& tree, std::size_t box) {
  const TriangleTree::BoxPack& pack = tree.packs()[box / kFan];
  Bounds result;
  for (int a = 0; a < 3; ++a)
    result.lower[a] = pack.lower[a][box % kFan], result.upper[a] = pack.upper[a][box % kFan];
  return result;
}

/// Returns the centre of a box of the tree in voxels.
Eigen::Vector3d box_centre(const TriangleTree& tree, std::size_t box) {
  const Bounds bounds = box_of(tree, box);
  return 0.5 * (bounds.lower + bounds.upper) * tree.scale();
}

/// Moments about a centre: the symmetric parts of n, n u and n u u summed over dipoles n at u, in voxels.
/// Other parts have no effect on the field, a contraction with symmetric tensors.
struct Moments {
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  std::array<double, 6> second{};
  std::array<double, 10> third{};

  void add_dipole(const Eigen::Vector3d& n, const Eigen::Vector3d& u) {
    first += n;
    for (int k = 0; k < 6; ++k) {
      const auto [i, j] = kPair[k];
      second[k] += (n[i] * u[j] + n[j] * u[i]) / 2;
    }
    for (int k = 0; k < 10; ++k) {
      const auto [i, j, l] = kTriple[k];
      third[k] += (n[i] * u[j] * u[l] + n[j] * u[i] * u[l] + n[l] * u[i] * u[j]) / 3;
    }
  }

  /// Adds the moments of a child whose centre is at s by the binomial expansion of u + s. The child's are for
  /// a radius of 1, so that each order gets its power of the radius back.
  void add_child(const Multipole& child, const Eigen::Vector3d& s) {
    const double r = child.radius;
    const double r2 = r * r, r3 = r2 * r, r4 = r2 * r2;
    add_dipole(r2 * Eigen::Vector3d(child.first[0], child.first[1], child.first[2]), s);
    for (int k = 0; k < 6; ++k) second[k] += r3 * child.second[k];
    for (int k = 0; k < 10; ++k) {
      const auto [i, j, l] = kTriple[k];
      const auto b = [&](int p, int q) { return double{child.second[kPlace[p][q]]}; };
      third[k] += r4 * child.third[k] + 2 * r3 * (b(i, j) * s[l] + b(i, l) * s[j] + b(j, l) * s[i]) / 3;
    }
  }

  /// Removes the traces, whose fields vanish, and scales to a radius of 1, so that single precision holds the
  /// moments of boxes of any size.
  Multipole multipole(double radius) const {
    Multipole result;
    result.radius = static_cast<float>(radius);
    if (!(result.radius > 0)) return result;
    const double r = result.radius;
    const double trace = (second[0] + second[3] + second[5]) / 3;
    const Eigen::Vector3d t((third[0] + third[3] + third[5]) / 5, (third[1] + third[6] + third[8]) / 5,
                            (third[2] + third[7] + third[9]) / 5);
    for (int a = 0; a < 3; ++a) result.first[a] = static_cast<float>(first[a] / (r * r));
    for (int k = 0; k < 6; ++k) {
      const auto [i, j] = kPair[k];
      result.second[k] = static_cast<float>((second[k] - (i == j ? trace : 0.0)) / (r * r * r));
    }
    for (int k = 0; k < 10; ++k) {
      const auto [i, j, l] = kTriple[k];
      const double traces = (i == j ? t[l] : 0.0) + (i == l ? t[j] : 0.0) + (j == l ? t[i] : 0.0);
      result.third[k] = static_cast<float>((third[k] - traces) / (r * r * r * r));
    }
    return result;
  }
};

/// Returns the multipole of a leaf's triangles. Integrals up to second order over a triangle are those of the
/// midpoints of the three sides with equal weights, so that three dipoles represent it exactly.
Multipole leaf_multipole(const TriangleTree& tree, std::span<const std::int8_t> turns, std::size_t box) {
  const Eigen::Vector3d centre = box_centre(tree, box);
  Moments moments;
  double squared = 0.0;
  for (const std::uint32_t t : tree.leaf(box)) {
    const Eigen::Vector3d a = tree.corner(t, 0) - centre, b = tree.corner(t, 1) - centre,
                          c = tree.corner(t, 2) - centre;
    squared = std::max({squared, a.squaredNorm(), b.squaredNorm(), c.squaredNorm()});
    const double turn = turns.empty() ? 1.0 : turns[t];
    const Eigen::Vector3d third_of_area = (b - a).cross(c - a) * (turn / 6);
    moments.add_dipole(third_of_area, (a + b) / 2);
    moments.add_dipole(third_of_area, (b + c) / 2);
    moments.add_dipole(third_of_area, (c + a) / 2);
  }
  // The corners lie within the radius in spite of rounding to single precision.
  return moments.multipole(std::sqrt(squared) * (1 + 1e-7));
}

/// Returns the multipole of a box from those of its children.
Multipole parent_multipole(const TriangleTree& tree, const std::vector<Multipole>& multipoles, Node ref) {
  const Eigen::Vector3d centre = box_centre(tree, ref.box);
  const std::size_t first = tree.child_pack(ref) * kFan;
  Moments moments;
  double radius = 0.0;
  for (std::size_t child = first; child < first + kFan; ++child) {
    if (box_of(tree, child).empty()) continue;
    const Eigen::Vector3d s = box_centre(tree, child) - centre;
    radius = std::max(radius, s.norm() + multipoles[child].radius);
    moments.add_child(multipoles[child], s);
  }
  // The spheres around the children's spheres and around the box both contain the triangles.
  const Bounds box = box_of(tree, ref.box);
  double squared = 0.0;
  for (int a = 0; a < 3; ++a) squared += (box.upper[a] - box.lower[a]) * (box.upper[a] - box.lower[a]);
  return moments.multipole(std::min(radius, 0.5 * std::sqrt(squared) * tree.scale()) * (1 + 1e-7));
}

/// Up to kMaxBatch points, halved recursively along the longest side of their box, so that each half is
/// compact.
class PointBatch {
 public:
  PointBatch(const TriangleTree& tree, std::span<const Multipole> multipoles,
             std::span<const std::int8_t> turns, double far, std::span<const Eigen::Vector3d> points)
      : tree_(tree), multipoles_(multipoles), turns_(turns), far_(far), count_(points.size()) {
    Bounds box;
    for (const Eigen::Vector3d& p : points) box.add(p);
    origin_ = box.lower + 0.5 * (box.upper - box.lower);
    extent_ = 0.5 * box.size().norm();
    for (std::size_t i = 0; i < count_; ++i) order_[i] = static_cast<std::uint16_t>(i);
    sort(points, 0, count_);
    for (std::size_t i = 0; i < count_; ++i) {
      // About an origin among them, the points lose no more than 1e-7 of their extent in single precision.
      const Eigen::Vector3f p = (points[order_[i]] - origin_).cast<float>();
      x_[i] = p[0], y_[i] = p[1], z_[i] = p[2], sum_[i] = 0.0f;
    }
  }

  /// Writes the numbers in the order in which the points were given.
  void evaluate(std::span<float> values) {
    std::vector<Node> roots;
    push_children(tree_.packs().size() - 1, static_cast<std::uint32_t>(tree_.level_count() - 1), roots);
    descend(0, count_, std::move(roots));
    for (std::size_t i = 0; i < count_; ++i)
      values[order_[i]] = sum_[i] * static_cast<float>(0.25 * std::numbers::inv_pi);
  }

 private:
  /// Returns the point at which a range is halved: full blocks of 16 give whole lanes.
  static std::size_t middle(std::size_t begin, std::size_t end) {
    return begin + std::min((end - begin + 31) / 32 * 16, end - begin);
  }

  /// Orders a range so that each half is compact. Equal coordinates are ordered by number, so that the order
  /// is unique.
  void sort(std::span<const Eigen::Vector3d> points, std::size_t begin, std::size_t end) {
    if (end - begin <= kGroup) return;
    Bounds box;
    for (std::size_t i = begin; i < end; ++i) box.add(points[order_[i]]);
    int axis = 0;
    box.size().maxCoeff(&axis);
    const std::size_t cut = middle(begin, end);
    std::nth_element(order_.begin() + begin, order_.begin() + cut, order_.begin() + end,
                     [&](std::uint16_t i, std::uint16_t j) {
                       return std::pair(points[i][axis], i) < std::pair(points[j][axis], j);
                     });
    sort(points, begin, cut);
    sort(points, cut, end);
  }

  /// Appends the boxes of a pack; those that are empty, or contain only a point, have no field.
  void push_children(std::size_t pack, std::uint32_t level, std::vector<Node>& boxes) const {
    for (std::size_t k = 0; k < kFan; ++k)
      if (multipoles_[pack * kFan + k].radius > 0)
        boxes.push_back({static_cast<std::uint32_t>(pack * kFan + k), level});
  }

  /// Adds the fields of boxes to the points of a range: of those that are far from all points at once, of
  /// those that are larger than the range by their children, and of the others to each half separately.
  void descend(std::size_t begin, std::size_t end, std::vector<Node> boxes) {
    const Targets targets{&x_[begin], &y_[begin], &z_[begin], &sum_[begin], end - begin};
    Eigen::Vector3d lowest, highest;  // relative to the origin
    for (int a = 0; const float* coordinates : {targets.x, targets.y, targets.z}) {
      const auto [low, high] = std::minmax_element(coordinates, coordinates + targets.count);
      lowest[a] = *low, highest[a++] = *high;
    }
    const double extent = 0.5 * (highest - lowest).norm();
    const bool last = end - begin <= kGroup;
    std::vector<Node> later;
    while (!boxes.empty()) {
      const Node ref = boxes.back();
      boxes.pop_back();
      const Multipole& multipole = multipoles_[ref.box];
      const Eigen::Vector3d centre = box_centre(tree_, ref.box) - origin_;
      // From the nearest point of the range's box: a box that is far from it is far from every point.
      const double away = (centre - centre.cwiseMax(lowest).cwiseMin(highest)).norm();
      if (away >= far_ * multipole.radius) {
        const Eigen::Vector3f c = centre.cast<float>();
        if (away < kVeryFar * multipole.radius) kernels_.add_multipole(multipole, c.data(), targets);
      } else if (ref.level > 0 && (last || multipole.radius > extent)) {
        push_children(tree_.child_pack(ref), ref.level - 1, boxes);
      } else if (last) {
        add_leaf(ref.box, targets);
      } else {
        later.push_back(ref);
      }
    }
    if (last || later.empty()) return;
    const std::size_t cut = middle(begin, end);
    descend(begin, cut, later);
    descend(cut, end, std::move(later));
  }

  /// Adds the exact solid angles of a leaf's triangles; a flipped one has two corners swapped.
  void add_leaf(std::size_t box, const Targets& targets) const {
    for (const std::uint32_t t : tree_.leaf(box)) {
      const int turn = turns_.empty() ? 1 : turns_[t];
      if (turn == 0) continue;
      const Eigen::Vector3d a = tree_.corner(t, 0) - origin_;
      const Eigen::Vector3d b = tree_.corner(t, turn > 0 ? 1 : 2) - origin_;
      const Eigen::Vector3d c = tree_.corner(t, turn > 0 ? 2 : 1) - origin_;
      // Single precision would misplace corners far outside the batch.
      const double reach = std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()});
      if (reach <= kFarAway * kFarAway * extent_ * extent_)
        kernels_.add_triangle(placed<float>(a, b, c), targets);
      else
        kernels_.add_large_triangle(placed<double>(a, b, c), targets);
    }
  }

  template <class Real>
  static PlacedTriangle<Real> placed(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                     const Eigen::Vector3d& c) {
    const Eigen::Vector3d n = (b - a).cross(c - a);
    PlacedTriangle<Real> result;
    for (int k = 0; k < 3; ++k) {
      result.corner[0][k] = static_cast<Real>(a[k]);
      result.corner[1][k] = static_cast<Real>(b[k]);
      result.corner[2][k] = static_cast<Real>(c[k]);
      result.normal[k] = static_cast<Real>(n[k]);
    }
    result.offset = static_cast<Real>(n.dot(a));
    return result;
  }

  const winding::Kernels& kernels_ = chosen_kernels<winding::Kernels>();
  const TriangleTree& tree_;
  std::span<const Multipole> multipoles_;
  std::span<const std::int8_t> turns_;
  double far_;
  std::size_t count_;
  Eigen::Vector3d origin_;
  double extent_;
  std::array<std::uint16_t, kMaxBatch> order_;
  std::array<float, kMaxBatch> x_, y_, z_, sum_;
};

}  // namespace

WindingNumber::WindingNumber(const TriangleTree& tree, std::span<const std::int8_t> turns)
    : tree_(tree), turns_(turns), multipoles_(tree.packs().size() * kFan) {
  // Level by level from the leaves up: the boxes of a level depend only on those of the level below.
  for (std::uint32_t level = 0; level < tree.level_count(); ++level) {
    const std::size_t end = level + 1 < tree.level_count() ? tree.first_pack(level + 1) : tree.packs().size();
    tbb::parallel_for(tree.first_pack(level) * kFan, end * kFan, [&](std::size_t box) {
      if (box_of(tree, box).empty()) return;
      multipoles_[box] = level == 0
                             ? leaf_multipole(tree, turns, box)
                             : parent_multipole(tree, multipoles_, {static_cast<std::uint32_t>(box), level});
    });
  }
}

double WindingNumber::at(const Eigen::Vector3d& p) const {
  float value = 0.0f;
  at(std::span(&p, 1), std::span(&value, 1));
  return value;
}

void WindingNumber::evaluate(std::span<const Eigen::Vector3d> points, std::span<float> values,
                             double far) const {
  for (std::size_t first = 0; first < points.size(); first += kMaxBatch) {
    const std::size_t count = std::min(kMaxBatch, points.size() - first);
    if (multipoles_.empty())
      std::fill_n(values.begin() + first, count, 0.0f);
    else
      PointBatch(tree_, multipoles_, turns_, far, points.subspan(first, count))
          .evaluate(values.subspan(first, count));
  }
}

}  // namespace hermesh
