// A tree of positions that answers nearest-neighbour queries and grows by one position at a time.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

namespace hermesh {

/// A k-d tree (Bentley 1975) with one position per node. Positions in no particular order, such as scattered
/// ones, leave it sufficiently balanced: a query visits about log n nodes. Distances equal (place -
/// p).squaredNorm() bit for bit: rounding is monotonic, so the distance along one axis is never above them.
class GrowingTree {
 public:
  /// Adds a position; its number is the count of those before it.
  void add(const Eigen::Vector3d& place) {
    nodes_.push_back({place, {0, 0}});
    const auto added = static_cast<std::uint32_t>(nodes_.size() - 1);
    int axis = 0;
    for (std::uint32_t at = 0; at != added; axis = (axis + 1) % 3) {
      std::uint32_t& child = nodes_[at].children[place[axis] >= nodes_[at].place[axis]];
      if (child == 0) child = added;
      at = child;
    }
  }

  /// Returns the squared distance to the nearest position, or infinity if the tree is empty.
  double nearest(const Eigen::Vector3d& p) const {
    double least = std::numeric_limits<double>::infinity();
    visit(p, [&](std::uint32_t, double squared) { return least = std::min(least, squared); });
    return least;
  }

  /// Calls f(number) for each position whose squared distance is at most `squared`, in no particular order.
  template <class F>
  void for_each_within(const Eigen::Vector3d& p, double squared, F&& f) const {
    visit(p, [&](std::uint32_t number, double found) {
      if (found <= squared) f(number);
      return squared;
    });
  }

 private:
  struct Node {
    Eigen::Vector3d place;
    std::uint32_t children[2];  ///< below the node's position along its axis, and not below; 0: none, because
                                ///< 0 is the root
  };
  struct Open {
    std::uint32_t node;
    int axis;
    double squared;  ///< lower bound of the distance to all positions beneath the node
  };

  /// Calls f(number, squared distance) for positions until all remaining ones are farther away than the last
  /// value that f returned.
  template <class F>
  void visit(const Eigen::Vector3d& p, F&& f) const {
    if (nodes_.empty()) return;
    double reach = std::numeric_limits<double>::infinity();
    std::vector<Open> open = {{0, 0, 0.0}};
    while (!open.empty()) {
      const Open now = open.back();
      open.pop_back();
      if (now.squared > reach) continue;
      const Node& node = nodes_[now.node];
      reach = f(now.node, (node.place - p).squaredNorm());
      const double off = node.place[now.axis] - p[now.axis];
      const int near = off <= 0.0, next = (now.axis + 1) % 3;
      if (node.children[1 - near])
        open.push_back({node.children[1 - near], next, std::max(now.squared, off * off)});
      if (node.children[near]) open.push_back({node.children[near], next, now.squared});
    }
  }

  std::vector<Node> nodes_;
};

}  // namespace hermesh
