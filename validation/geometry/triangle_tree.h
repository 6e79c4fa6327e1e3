// A bounding-volume hierarchy over triangles: closest points and box overlaps.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "validation/geometry/triangle_soup.h"

namespace hermesh::validation {

/// Returns the point of a triangle that is closest to `point`. A triangle whose height is below 1e-8 of its
/// longest edge is treated as its three edges, because its normal is dominated by rounding errors; the error
/// of the result is then at most that height.
Eigen::Vector3d closest_point(const Corners& triangle, const Eigen::Vector3d& point);

struct ClosestHit {
  double squared = std::numeric_limits<double>::infinity();  ///< squared distance
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  std::uint32_t slot = 0;  ///< position of the triangle in the order of the tree
};

/// A bounding volume hierarchy as a complete binary tree in heap order: the children of node i are 2i+1 and
/// 2i+2, the leaves are the last level, and leaf k holds the slots first_slot(k) to first_slot(k+1). It is
/// built in parallel by median splits, and is the same for any number of threads.
class TriangleTree {
 public:
  /// @throws Error if there is no triangle.
  explicit TriangleTree(const TriangleSoup& soup);

  ClosestHit closest(const Eigen::Vector3d& point) const { return closest(point, slot_hit(point, 0)); }
  /// Returns the closest point. An initial guess, such as the slot found for a nearby point, speeds up the
  /// search.
  ClosestHit closest(const Eigen::Vector3d& point, std::uint32_t guess) const {
    return closest(point, slot_hit(point, guess));
  }

  std::size_t size() const { return order_.size(); }
  std::size_t leaves() const { return std::size_t(1) << depth_; }
  std::size_t first_slot(std::size_t leaf) const { return (size() * leaf) >> depth_; }
  const Box& leaf_box(std::size_t leaf) const { return boxes_[leaves() - 1 + leaf]; }
  const Box& bounds() const { return boxes_[0]; }
  std::uint32_t triangle(std::size_t slot) const { return order_[slot]; }  ///< triangle number in the soup
  const Corners& corners(std::size_t slot) const { return corners_[slot]; }

  /// Calls visit(slot) for each triangle whose box is within `reach` of a box, until visit() returns false.
  /// Returns true if it never did.
  template <class Visit>
  bool for_each_near(const Box& box, double reach, const Visit& visit) const {
    const double squared = reach * reach;
    return traverse([&](const Box& node) { return node.squared_distance(box) <= squared; },
                    [&](std::uint32_t slot) {
                      return !(box_of(corners_[slot]).squared_distance(box) <= squared) || visit(slot);
                    });
  }

  /// Calls visit(slot) for each triangle whose box the segment intersects, and possibly for others, until
  /// visit() returns false. Returns true if it never did.
  template <class Visit>
  bool for_each_on_segment(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Visit& visit) const {
    const Slabs slabs(from, to);
    return traverse([&](const Box& node) { return slabs.meet(node); }, visit);
  }

  /// Calls visit(other) for each leaf `other` ≥ `leaf` whose box overlaps that leaf's box, in increasing
  /// order.
  template <class Visit>
  void for_each_overlapping_leaf(std::size_t leaf, const Visit& visit) const {
    const Box& box = leaf_box(leaf);
    struct Entry {
      std::size_t node;
      std::size_t past;  ///< one past the last leaf below
      std::size_t count;
    } stack[kMaxDepth + 2];
    int top = 0;
    stack[top++] = {0, leaves(), leaves()};
    while (top > 0) {
      const Entry e = stack[--top];
      if (e.past <= leaf || !boxes_[e.node].overlaps(box)) continue;
      if (e.count == 1) {
        visit(e.past - 1);
        continue;
      }
      stack[top++] = {2 * e.node + 2, e.past, e.count / 2};
      stack[top++] = {2 * e.node + 1, e.past - e.count / 2, e.count / 2};
    }
  }

 private:
  static constexpr int kMaxDepth = 40;

  // Calls visit(slot) for the triangles of all leaves below nodes whose boxes enter() accepts, until visit()
  // returns false. Returns true if it never did.
  template <class Enter, class Visit>
  bool traverse(const Enter& enter, const Visit& visit) const {
    std::size_t stack[kMaxDepth + 2];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
      const std::size_t node = stack[--top];
      if (!enter(boxes_[node])) continue;
      if (node < leaves() - 1) {
        stack[top++] = 2 * node + 2;
        stack[top++] = 2 * node + 1;
        continue;
      }
      const std::size_t leaf = node - (leaves() - 1);
      for (std::size_t slot = first_slot(leaf); slot < first_slot(leaf + 1); ++slot)
        if (!visit(std::uint32_t(slot))) return false;
    }
    return true;
  }

  // The slab test of a segment against boxes, with parameter intervals slightly enlarged to cover rounding.
  struct Slabs {
    Eigen::Vector3d from, inverse;
    Slabs(const Eigen::Vector3d& start, const Eigen::Vector3d& end)
        : from(start), inverse((end - start).cwiseInverse()) {}
    bool meet(const Box& box) const {
      constexpr double kSlack = 1e-9;
      double first = -kSlack, last = 1.0 + kSlack;
      for (int axis = 0; axis < 3; ++axis) {
        const double a = (box.lower[axis] - from[axis]) * inverse[axis];
        const double b = (box.upper[axis] - from[axis]) * inverse[axis];
        // For a segment in a plane of the box, 0 times infinity is NaN and bounds nothing.
        if (std::min(a, b) - kSlack > first) first = std::min(a, b) - kSlack;
        if (std::max(a, b) + kSlack < last) last = std::max(a, b) + kSlack;
      }
      return first <= last;
    }
  };

  ClosestHit slot_hit(const Eigen::Vector3d& point, std::uint32_t slot) const;
  ClosestHit closest(const Eigen::Vector3d& point, ClosestHit best) const;

  int depth_ = 0;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> order_;
  std::vector<Corners> corners_;
};

}  // namespace hermesh::validation
