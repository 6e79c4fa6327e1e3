// Conversions between the signs of SparseHermite and OpenVDB trees that have a sign for every sample: trees
// of dense voxels, and the tree of bits in files. Heavy (OpenVDB): include it from .cpp files.
#pragma once

#include <tbb/parallel_sort.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "algorithms/core/openvdb_trees.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/sparse_hermite.h"

namespace hermesh::sign_tree {

using Position = std::array<std::int32_t, 3>;
inline Position position(const openvdb::Coord& at) { return {at.x(), at.y(), at.z()}; }
inline openvdb::Coord coord(const Position& at) { return {at[0], at[1], at[2]}; }

/// Calls f(slot, inside) for every slot of an internal node that has no child. Slots are consecutive along z,
/// so a sign is looked up once for every run without children.
template <class Node, class Crossing, class F>
void for_each_tile(const Node& node, const SparseHermite<Crossing>& hermite, F&& f) {
  constexpr openvdb::Index kColumn = (1u << Node::LOG2DIM) - 1;
  bool known = false, inside = false;
  for (openvdb::Index slot = 0; slot < Node::NUM_VALUES; ++slot) {
    if ((slot & kColumn) == 0 || node.isChildMaskOn(slot)) known = false;
    if (node.isChildMaskOn(slot)) continue;
    if (!known) inside = hermite.sign_without_leaf(position(node.offsetToGlobalCoord(slot)));
    known = true;
    f(slot, inside);
  }
}

/// Calls f(place, inside) for the origin of every gap between two children of the root in a column along z.
/// Before the first and after the last child all samples have the outermost sign.
template <class Root, class Crossing, class F>
void for_each_gap(const Root& root, const SparseHermite<Crossing>& hermite, F&& f) {
  constexpr std::int64_t kWidth = Root::ChildNodeType::DIM;
  std::vector<openvdb::Coord> children;
  for (auto it = root.cbeginChildOn(); it; ++it) children.push_back(it->origin());
  std::sort(children.begin(), children.end());
  for (std::size_t i = 1; i < children.size(); ++i) {
    const openvdb::Coord &from = children[i - 1], &to = children[i];
    if (from.x() != to.x() || from.y() != to.y()) continue;
    for (std::int64_t z = from.z() + kWidth; z < to.z(); z += kWidth) {
      const openvdb::Coord place(from.x(), from.y(), static_cast<std::int32_t>(z));
      f(place, hermite.sign_without_leaf(position(place)));
    }
  }
}

/// Numbers of elements by the node of `width` samples that they lie in: runs of the result with equal nodes.
struct Grouped {
  std::vector<std::pair<openvdb::Coord, std::uint32_t>>
      members;                      ///< origin of the node, number of the element
  std::vector<std::size_t> starts;  ///< first member of each run, and the end of the last
};

template <class Lower>
Grouped grouped(std::size_t size, std::int32_t width, Lower&& lower) {
  Grouped result;
  result.members.resize(size);
  for (std::size_t i = 0; i < size; ++i)
    result.members[i] = {lower(i) & ~(width - 1), static_cast<std::uint32_t>(i)};
  tbb::parallel_sort(result.members.begin(), result.members.end());
  for (std::size_t i = 0; i < size; ++i)
    if (i == 0 || result.members[i].first != result.members[i - 1].first) result.starts.push_back(i);
  result.starts.push_back(size);
  return result;
}

/// Makes the nodes above `children`, in parallel, with their tiles. `child(i)` releases a child.
template <class Node, class Crossing, class Lower, class Child>
std::vector<std::unique_ptr<Node>> nodes_above(const SparseHermite<Crossing>& hermite, std::size_t children,
                                               const std::array<typename Node::ValueType, 2>& values,
                                               RunContext& context, Lower&& lower, Child&& child) {
  const Grouped groups = grouped(children, Node::DIM, lower);
  std::vector<std::unique_ptr<Node>> nodes(groups.starts.size() - 1);
  parallel_blocks(nodes.size(), context, [&](std::size_t i) {
    const std::size_t begin = groups.starts[i], end = groups.starts[i + 1];
    auto node = std::make_unique<Node>(groups.members[begin].first, values[hermite.outermost_inside], false);
    for (std::size_t k = begin; k < end; ++k) node->addChild(child(groups.members[k].second));
    for_each_tile(*node, hermite, [&](openvdb::Index slot, bool inside) {
      if (inside != hermite.outermost_inside) node->addTile(slot, values[inside], false);
    });
    nodes[i] = std::move(node);
  });
  return nodes;
}

/// Makes a tree with a leaf for each of `hermite` and tiles of `values`, outside and inside, elsewhere.
/// `make_leaf(i)` makes a leaf of the tree and is called in parallel.
template <class Tree, class Crossing, class MakeLeaf>
typename Tree::Ptr make_tree(const SparseHermite<Crossing>& hermite,
                             const std::array<typename Tree::ValueType, 2>& values, RunContext& context,
                             MakeLeaf&& make_leaf) {
  using Root = typename Tree::RootNodeType;
  using Upper = typename Root::ChildNodeType;
  using Lower = typename Upper::ChildNodeType;
  auto lowers = nodes_above<Lower>(
      hermite, hermite.leaves.size(), values, context,
      [&](std::size_t i) { return coord(hermite.leaves[i].lower); }, make_leaf);
  auto uppers = nodes_above<Upper>(
      hermite, lowers.size(), values, context, [&](std::size_t i) { return lowers[i]->origin(); },
      [&](std::size_t i) { return lowers[i].release(); });
  auto tree = std::make_shared<Tree>(values[hermite.outermost_inside]);
  for (auto& upper : uppers) tree->root().addChild(upper.release());
  for_each_gap(tree->root(), hermite, [&](const openvdb::Coord& place, bool inside) {
    if (inside != hermite.outermost_inside) tree->root().addTile(place, values[inside], false);
  });
  return tree;
}

/// Returns the leaves of a tree in the order of SparseHermite, with signs. @throws Error if a position is not
/// a multiple of 8 or so far away that its neighbours' coordinates would overflow.
template <class Tree, class IsInside>
LargeArray<SignLeaf> leaf_signs(const std::vector<const typename Tree::LeafNodeType*>& sources,
                                RunContext& context, IsInside&& is_inside) {
  constexpr std::int32_t kFarthest = 1 << 30;
  LargeArray<SignLeaf> leaves(sources.size());
  parallel_blocks(sources.size(), context, [&](std::size_t i) {
    SignLeaf leaf{position(sources[i]->origin()), 0, {}, {}};
    for (const std::int32_t at : leaf.lower)
      if (at % 8 != 0 || at < -kFarthest || at > kFarthest)
        throw Error("the Hermite data have a block out of place, at index " + std::to_string(at));
    for (int sample = 0; sample < 512; ++sample) {
      const bool inside = is_inside(sources[i]->getValue(static_cast<openvdb::Index>(sample)));
      leaf.inside[sample >> 6] |= std::uint64_t{inside} << (sample & 63);
    }
    leaves[i] = leaf;
  });
  return leaves;
}

/// Sets the layers beyond the leaves of a tree, which are all present, and returns the number of crossing
/// edges of each.
template <class Tree, class Crossing, class IsInside>
std::vector<std::uint64_t> complete_leaves(const Tree& tree, SparseHermite<Crossing>& all,
                                           RunContext& context, IsInside&& is_inside) {
  std::vector<std::uint64_t> owned(all.leaves.size());
  parallel_blocks(owned.size(), context, [&](std::size_t i) {
    SignLeaf& leaf = all.leaves[i];
    for (int axis = 0; axis < 3; ++axis) {
      Position there = leaf.lower;
      there[axis] += 8;
      if (const SignLeaf* next = all.find(there))
        leaf.beyond[axis] = first_layer(next->inside, axis);
      else
        leaf.beyond[axis] = is_inside(tree.getValue(coord(there))) ? ~std::uint64_t{0} : 0;
    }
    for (const BlockMask& edges : crossing_edges(leaf)) owned[i] += static_cast<std::uint64_t>(count(edges));
  });
  return owned;
}

/// Reads the signs of a tree, with room for the crossings, and returns the tree's leaves that they came from.
/// Leaves that own no crossing edge are omitted. The result is valid if the tree is; check_consistent(),
/// check_columns() and check_tiles() verify it.
template <class Crossing, class Tree, class IsInside>
std::vector<const typename Tree::LeafNodeType*> read_signs(const Tree& tree, SparseHermite<Crossing>& hermite,
                                                           RunContext& context, IsInside&& is_inside) {
  std::vector<const typename Tree::LeafNodeType*> sources;
  tree.getNodes(sources);
  tbb::parallel_sort(sources.begin(), sources.end(),
                     [](const auto* a, const auto* b) { return a->origin() < b->origin(); });
  hermite.leaves = leaf_signs<Tree>(sources, context, is_inside);
  const std::vector<std::uint64_t> owned = complete_leaves(tree, hermite, context, is_inside);
  std::vector<std::uint64_t> first = owned;
  hermite.crossings.resize(exclusive_scan(first, "crossings"));
  hermite.outermost_inside = is_inside(tree.background());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (owned[i] == 0) continue;
    hermite.leaves[kept] = hermite.leaves[i];
    hermite.leaves[kept].first = static_cast<std::uint32_t>(first[i]);
    sources[kept++] = sources[i];
  }
  hermite.leaves.resize(kept);
  hermite.leaves.shrink_to_fit();
  sources.resize(kept);
  return sources;
}

/// @throws Error if two adjacent columns of missing leaves disagree. If both are missing, one of the two runs
/// of missing leaves begins after a leaf; so it suffices to check there.
template <class Crossing>
void check_columns(const SparseHermite<Crossing>& hermite) {
  for (const SignLeaf& leaf : hermite.leaves) {
    const Position above = {leaf.lower[0], leaf.lower[1], leaf.lower[2] + 8};
    if (hermite.find(above)) continue;
    for (const auto& [dx, dy] : {std::pair(-8, 0), std::pair(8, 0), std::pair(0, -8), std::pair(0, 8)}) {
      const Position beside = {above[0] + dx, above[1] + dy, above[2]};
      if (!hermite.find(beside) && hermite.sign_without_leaf(beside) != ((leaf.beyond[2] & 1) != 0))
        throw Error("the Hermite data change their sign between blocks where they have no crossings");
    }
  }
}

/// @throws Error if a sample of the tree without a leaf of `hermite` has another sign than in SparseHermite.
template <class Tree, class Crossing, class IsInside>
void check_tiles(const Tree& tree, const SparseHermite<Crossing>& hermite, IsInside&& is_inside) {
  const auto check = [](bool a, bool b) {
    if (a != b) throw Error("the Hermite data change their sign between blocks where they have no crossings");
  };
  std::vector<const typename Tree::LeafNodeType*> leaves;
  tree.getNodes(leaves);
  for (const auto* leaf : leaves) {
    const Position lower = position(leaf->origin());
    if (!hermite.find(lower)) check(is_inside(leaf->getFirstValue()), hermite.sign_without_leaf(lower));
  }
  const auto check_node = [&](const auto& node) {
    for_each_tile(node, hermite, [&](openvdb::Index slot, bool inside) {
      check(is_inside(node.getTable()[slot].getValue()), inside);
    });
  };
  const auto& root = tree.root();
  for (auto upper = root.cbeginChildOn(); upper; ++upper) {
    check_node(*upper);
    for (auto lower = upper->cbeginChildOn(); lower; ++lower) check_node(*lower);
  }
  for_each_gap(root, hermite,
               [&](const openvdb::Coord& at, bool inside) { check(is_inside(tree.getValue(at)), inside); });
  for (auto tile = root.cbeginValueAll(); tile; ++tile)
    check(is_inside(*tile), hermite.sign_without_leaf(position(tile.getCoord())));
}

}  // namespace hermesh::sign_tree
