// Bounding volume hierarchy over a triangle soup: a packed R-tree along the Hilbert curve (Kamel & Faloutsos,
// Hilbert R-tree: An Improved R-tree Using Fractals, VLDB 1994).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "algorithms/core/polygon_mesh.h"

namespace hermesh {

/// Result of a nearest-triangle query.
struct NearestTriangle {
  double squared;          ///< squared distance in voxels², the given bound if nothing is within it
  std::uint32_t triangle;  ///< its number, TriangleTree::kNone if nothing is within the bound
};

/// Bounding volume hierarchy over triangles, sorted along the Hilbert curve through the centers of their
/// boxes; every eight consecutive ones are a leaf, and every four consecutive boxes of a level a box of the
/// level above. So there are no links, and the tree is the same for every number of threads. Points and boxes
/// are single precision in the caller's units; index space is point * scale, rounded once to double
/// precision, so that a scaled box contains its scaled points exactly. The tree refers to the caller's
/// arrays, which have to outlive it. It takes about 8 bytes per triangle, and 16 more during construction.
class TriangleTree {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t kLeafSize = 8, kFan = 4;

  /// Four sibling boxes in the caller's units. Those after the end of a level are empty: lower > upper.
  struct BoxPack {
    float lower[3][kFan], upper[3][kFan];
  };
  /// A box by its number (pack * kFan + lane) and its level; boxes of level 0 are the leaves.
  struct Node {
    std::uint32_t box, level;
  };

  /// Builds the tree of `triangles`, fewer than 2^32 − 1, over finite `points`. `scale` is the number of
  /// voxels per unit of the points, positive.
  TriangleTree(std::span<const Eigen::Vector3f> points, std::span<const Triangle> triangles, double scale);

  /// Returns the triangle nearest to p, in index space, that is no farther than the bound; of several equally
  /// near ones the one of lowest number. The distance is that to the triangles with each corner moved by a
  /// few units in the last place of the longest side, for any shape: slivers, segments and points are
  /// triangles, too. If any triangle no farther than `enough_squared` is sufficient, the first one found is
  /// returned, sooner.
  NearestTriangle nearest(const Eigen::Vector3d& p,
                          double upper_bound_squared = std::numeric_limits<double>::infinity(),
                          double enough_squared = -1.0) const;

  /// Calls f(triangle) for the triangles whose boxes overlap the box from `low` to `high` (index space).
  template <class F>
  void for_each_near(const Eigen::Vector3d& low, const Eigen::Vector3d& high, F&& f) const {
    visit(
        [&](const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
          return (lower.array() <= high.array()).all() && (upper.array() >= low.array()).all();
        },
        f);
  }

  /// Calls f(triangle) for the triangles whose boxes the segment intersects (index space), and for some that
  /// it misses by 1e-6 voxels.
  template <class F>
  void for_each_on_segment(const Eigen::Vector3d& from, const Eigen::Vector3d& to, F&& f) const {
    constexpr double kMargin = 1e-6;
    const Eigen::Vector3d middle = 0.5 * (from + to), half = 0.5 * (to - from), reach = half.cwiseAbs();
    // Separating axes of a box and a segment (Ericson, Real-Time Collision Detection, 2005, section 5.3.3).
    visit(
        [&](const Eigen::Vector3d& lower, const Eigen::Vector3d& upper) {
          const Eigen::Vector3d c = middle - 0.5 * (lower + upper),
                                e = 0.5 * (upper - lower) + Eigen::Vector3d::Constant(kMargin);
          if ((c.cwiseAbs().array() > (e + reach).array()).any()) return false;
          return std::abs(half.y() * c.z() - half.z() * c.y()) <=
                     e.y() * reach.z() + e.z() * reach.y() + kMargin &&
                 std::abs(half.z() * c.x() - half.x() * c.z()) <=
                     e.z() * reach.x() + e.x() * reach.z() + kMargin &&
                 std::abs(half.x() * c.y() - half.y() * c.x()) <=
                     e.x() * reach.y() + e.y() * reach.x() + kMargin;
        },
        f);
  }

  double scale() const { return scale_; }
  std::size_t triangle_count() const { return triangles_.size(); }
  std::size_t byte_size() const {
    return packs_.size() * sizeof(BoxPack) + order_.size() * sizeof(std::uint32_t);
  }
  /// Returns a corner of a triangle in index space.
  Eigen::Vector3d corner(std::uint32_t triangle, int c) const {
    return points_[triangles_[triangle][c]].cast<double>() * scale_;
  }

  // For other hierarchical methods.
  std::span<const BoxPack> packs() const { return packs_; }
  std::size_t level_count() const { return first_.size(); }
  /// Returns the first pack of a level; the packs of a level are consecutive, level 0 first, the root's pack
  /// last.
  std::size_t first_pack(std::size_t level) const { return first_[level]; }
  /// Returns the pack with the children of a box above level 0.
  std::size_t child_pack(Node ref) const {
    return first_[ref.level - 1] + (ref.box - first_[ref.level] * kFan);
  }
  /// Returns the numbers of the triangles in a leaf; none after the last leaf.
  std::span<const std::uint32_t> leaf(std::size_t box) const {
    const std::size_t first = std::min(box * kLeafSize, order_.size());
    return {order_.data() + first, std::min(kLeafSize, order_.size() - first)};
  }

 private:
  void build_boxes();

  /// Calls f(triangle) for the triangles for which meets(lower, upper) is true of their boxes and of those
  /// above.
  template <class Meets, class F>
  void visit(const Meets& meets, F&& f) const {
    if (packs_.empty()) return;
    struct Pack {
      std::size_t number;
      std::uint32_t level;
    };
    // Each level leaves three packs at most, and 2³² triangles have 15 levels.
    std::array<Pack, 64> packs;
    std::size_t top = 0;
    packs[top++] = {packs_.size() - 1, static_cast<std::uint32_t>(first_.size() - 1)};
    while (top > 0) {
      const auto [number, level] = packs[--top];
      const BoxPack& pack = packs_[number];
      for (std::size_t k = 0; k < kFan; ++k) {
        if (!(pack.lower[0][k] <= pack.upper[0][k])) continue;  // It is past the end.
        const auto side = [&](const float(&bound)[3][kFan]) {
          return Eigen::Vector3d(bound[0][k] * scale_, bound[1][k] * scale_, bound[2][k] * scale_);
        };
        if (!meets(side(pack.lower), side(pack.upper))) continue;
        const Node box{static_cast<std::uint32_t>(number * kFan + k), level};
        if (level > 0) {
          packs[top++] = {child_pack(box), level - 1};
          continue;
        }
        for (const std::uint32_t t : leaf(box.box)) {
          const Eigen::Vector3d a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
          if (meets(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c))) f(t);
        }
      }
    }
  }

  std::span<const Eigen::Vector3f> points_;
  std::span<const Triangle> triangles_;
  double scale_;
  std::vector<std::uint32_t> order_;  ///< triangle numbers along the curve
  std::vector<BoxPack> packs_;        ///< level by level, the leaves' first
  std::vector<std::size_t> first_;    ///< first pack of each level
};

/// Returns the squared distance from p to the triangle abc, which may be degenerate, in the units of the
/// points squared.
double squared_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c);

}  // namespace hermesh
