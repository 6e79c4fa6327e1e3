// Sets of vertices of a fine mesh that become one vertex, each built from smaller sets.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/extraction/certified_collapse/quadric.h"

namespace hermesh {

/// A forest: a node is a set of vertices, its children are the sets and single vertices that it is made of; a
/// node with one child moves that child. The vertices of the merged mesh are the largest sets that merge, and
/// those vertices that are in none. A set that is split is replaced by its children, so an unproven merge is
/// undone locally, and full splitting restores the fine mesh.
class MergeForest {
 public:
  static constexpr std::uint32_t kNone = 0xffffffffu;

  struct Node {
    std::uint32_t parent = kNone;
    std::uint32_t first;  ///< the vertex that represents the set
    bool merges = false;
    bool moves = false;     ///< its only child is the set or single vertex that it moves
    Eigen::Vector3d place;  ///< position of the merged vertex, rounded for the file
    PlaneQuadric quadric;   ///< about `place`
  };

  /// `nodes` has children before their parents; `node_of` has for each vertex the smallest set that contains
  /// it, or kNone.
  MergeForest(std::vector<Node> nodes, std::vector<std::uint32_t> node_of);

  /// Merges two vertices of the merged mesh into `node`, which the vertex `node.first` represents. If `going`
  /// is `node.first`, that vertex moves to the position of `node`.
  void join(std::uint32_t going, Node node);
  /// Recomputes the sets and their members. Required after join(), before any query.
  void settle();
  /// Replaces a set by its children.
  void split(std::uint32_t node);

  const Node& node(std::uint32_t n) const { return nodes_[n]; }
  std::size_t size() const { return nodes_.size(); }
  /// Returns the set that a vertex is merged into, or kNone.
  std::uint32_t set_of(std::uint32_t point) const { return set_of_[point]; }
  /// Returns the vertex that represents the set of a vertex.
  std::uint32_t leader(std::uint32_t point) const {
    return set_of_[point] == kNone ? point : nodes_[set_of_[point]].first;
  }
  std::span<const std::uint32_t> members(std::uint32_t node) const {
    return std::span(members_).subspan(begin_[node], count_[node]);
  }

 private:
  std::vector<Node> nodes_;
  std::vector<std::uint32_t> node_of_,
      set_of_;                                ///< smallest set of each vertex, and the one it is merged into
  std::vector<std::uint32_t> members_;        ///< the vertices in sets, those of each set contiguous
  std::vector<std::uint32_t> begin_, count_;  ///< range of `members_` of each node
};

}  // namespace hermesh
