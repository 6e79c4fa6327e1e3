// Which points of a fine mesh become one: sets of points, each made of smaller ones.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/extraction/certified_collapse/quadric.h"

namespace hermesh {

/// A forest: a node is a set of points, its children are the sets and single points that it is made of; a
/// node with one child is a move of that. The points that a mesh has are the greatest sets that merge, and
/// those that are in none. A set that is split gives way to its children; so whatever was unproven is taken
/// back right there, and at last one has the fine mesh again.
class MergeForest {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  struct Node {
    std::uint32_t parent = kNone;
    std::uint32_t first;  ///< one of its points, which it goes by
    bool merges = false;
    bool moves = false;     ///< its only child is the set or single point that it moves
    Eigen::Vector3d place;  ///< where its points go, rounded for the file
    PlaneQuadric quadric;   ///< about `place`
  };

  /// `nodes` has children before their parents; `node_of` has for each point the least set that holds it, or
  /// kNone.
  MergeForest(std::vector<Node> nodes, std::vector<std::uint32_t> node_of);

  /// Makes two points of the mesh one, in the place of `node`, whose `first` is the one that stays. Where
  /// `going` is `first`, too, that point moves to the place of `node`.
  void join(std::uint32_t going, Node node);
  /// Finds the sets and members anew. To be called after join(), before anything else is asked.
  void settle();
  /// Has a set give way to its children.
  void split(std::uint32_t node);

  const Node& node(std::uint32_t n) const { return nodes_[n]; }
  std::size_t size() const { return nodes_.size(); }
  /// The set that a point is merged into, or kNone.
  std::uint32_t set_of(std::uint32_t point) const { return set_of_[point]; }
  /// The point that its set goes by.
  std::uint32_t leader(std::uint32_t point) const {
    return set_of_[point] == kNone ? point : nodes_[set_of_[point]].first;
  }
  std::span<const std::uint32_t> members(std::uint32_t node) const {
    return std::span(members_).subspan(begin_[node], count_[node]);
  }

 private:
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> node_of_,
      set_of_;                                ///< each point's least set, and the one that it is merged into
  std::vector<std::uint32_t> members_;        ///< the points in sets, those of any one set together
  std::vector<std::uint32_t> begin_, count_;  ///< where each node's members are
};

}  // namespace hermesh
