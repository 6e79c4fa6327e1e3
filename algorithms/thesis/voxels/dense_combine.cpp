#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/normal_codes.h"
#include "algorithms/thesis/voxels/dense_tree.h"
#include "algorithms/thesis/voxels/voxel_rules.h"

namespace hermesh {
namespace {

using openvdb::Coord;
using openvdb::Index;

/// Calls f(slot) for every slot of an internal node, in parallel. 64 slots share a word of the node's masks,
/// so a task gets whole words: no two threads write to one.
template <class Node, class F>
void for_each_slot(const RunContext& context, F&& f) {
  tbb::parallel_for(tbb::blocked_range<Index>(0, Node::NUM_VALUES / 64),
                    [&](const tbb::blocked_range<Index>& words) {
                      context.check();
                      for (Index slot = 64 * words.begin(); slot < 64 * words.end(); ++slot) f(slot);
                    });
}

template <class Node>
typename Node::ChildNodeType* child_at(const Node& node, Index slot) {
  return node.isChildMaskOn(slot) ? node.getTable()[slot].getChild() : nullptr;
}
/// Returns the sign of a slot that has no child.
template <class Node>
bool tile_inside(const Node& node, Index slot) {
  return node.getTable()[slot].getValue().inside();
}
template <class Node>
void set_tile(Node& node, Index slot, bool inside) {
  node.addTile(slot, uniform_voxel<typename Node::ValueType>(inside), false);
}

/// Returns the sign bits of 64 voxels.
template <class Voxel>
std::uint64_t signs(const Voxel* voxels) {
  std::uint64_t result = 0;
  for (int i = 0; i < 64; ++i) result |= std::uint64_t{voxels[i].inside()} << i;
  return result;
}
template <class Voxel>
void change_sign(Voxel& voxel) {
  voxel.set_inside(!voxel.inside());
}
/// Calls f(number) for every set bit.
template <class F>
void for_each_bit_of_word(std::uint64_t word, F&& f) {
  for (; word != 0; word &= word - 1) f(static_cast<Index>(std::countr_zero(word)));
}

/// Returns the sign of a node without children if all its tiles have the same.
template <class Node>
std::optional<bool> uniform_sign(const Node& node) {
  if (!node.isChildMaskOff()) return std::nullopt;
  const bool sign = tile_inside(node, 0);
  for (Index slot = 1; slot < Node::NUM_VALUES; ++slot)
    if (tile_inside(node, slot) != sign) return std::nullopt;
  return sign;
}
/// Returns the sign of a leaf without crossings if all its voxels have the same.
template <class Voxel>
std::optional<bool> uniform_sign(const openvdb::tree::LeafNode<Voxel, 3>& leaf) {
  if (!leaf.getValueMask().isOff()) return std::nullopt;
  const Voxel* const voxels = leaf.buffer().data();
  for (Index i = 1; i < leaf.SIZE; ++i)
    if (voxels[i].inside() != voxels[0].inside()) return std::nullopt;
  return voxels[0].inside();
}

/// True if an edge may change signs without a crossing.
template <class Voxel>
constexpr bool kLosesCrossings = std::is_same_v<Voxel, ThesisVoxel>;

/// The tree of a DenseHermite that is no longer needed, which may be changed if nothing else refers to it.
template <class Voxel>
struct Operand {
  using Tree = typename DenseGrid<Voxel>::TreeType;
  typename Tree::Ptr tree;
  bool alone;

  explicit Operand(DenseHermite<Voxel>&& hermite) {
    const auto grid = std::const_pointer_cast<DenseGrid<Voxel>>(std::move(hermite.grid));
    tree = grid->treePtr();
    // The pointers here are counted, too.
    alone = grid.use_count() == 1 && tree.use_count() == 2;
  }
  typename Tree::Ptr changeable() const { return alone ? tree : std::make_shared<Tree>(*tree); }
};

/// Replaces a tree by its complement, in place. `Rules` is a type of voxel_rules.h.
template <class Rules>
class Complement {
 public:
  explicit Complement(const RunContext& context) : context_(context) {}

  template <class Root>
  void turn_root(Root& root) const {
    using Voxel = typename Root::ValueType;
    // Children are complemented below, not by OpenVDB.
    root.setBackground(uniform_voxel<Voxel>(!root.background().inside()), false);
    for (auto tile = root.beginValueAll(); tile; ++tile) tile.setValue(uniform_voxel<Voxel>(!tile->inside()));
    for (auto child = root.beginChildOn(); child; ++child) turn(*child);
  }
  template <class Node>
  void turn(Node& node) const {
    if constexpr (Node::LEVEL == 0) {
      // The same voxels stay active: their edges stay crossed.
      typename Node::ValueType* const voxels = node.buffer().data();
      for (Index i = 0; i < Node::SIZE; ++i)
        if (node.isValueOn(i))
          Rules::turn(voxels[i]);
        else
          change_sign(voxels[i]);
    } else {
      for_each_slot<Node>(context_, [&](Index slot) {
        if (auto* child = child_at(node, slot))
          turn(*child);
        else
          set_tile(node, slot, !tile_inside(node, slot));
      });
    }
  }

 private:
  const RunContext& context_;
};

/// Merges the tree of `b` into that of `a`, node by node.
template <class Rules>
class Merge {
 public:
  using Voxel = typename Rules::Voxel;
  using Tree = typename DenseGrid<Voxel>::TreeType;
  using Root = typename Tree::RootNodeType;
  using Leaf = typename Tree::LeafNodeType;

  Merge(Boolean boolean, bool steals, const RunContext& context)
      : rule_(boolean), steals_(steals), context_(context) {}

  void merge_roots(Root& a, Root& b) const {
    using Upper = typename Root::ChildNodeType;
    // Sequential: the root is a map that no two threads may change. It has few entries, and the subtree below
    // each is merged in parallel.
    for (const Coord& place : places(a, b)) {
      Upper *const of_a = a.template probeNode<Upper>(place), *const of_b =
                                                                  b.template probeNode<Upper>(place);
      const bool inside_a = !of_a && a.getValue(place).inside(),
                 inside_b = !of_b && b.getValue(place).inside();
      if (of_a && of_b)
        merge(*of_a, *of_b);
      else if (of_b && rule_.keeps_b(inside_a))
        a.addChild(taken(b, *of_b).release());
      else if (!of_a || !rule_.keeps_a(inside_b))
        a.addTile(place, uniform_voxel<Voxel>(inside(inside_a, inside_b)), false);
    }
    // Last, because the entries above were read with the old background.
    a.setBackground(uniform_voxel<Voxel>(inside(a.background().inside(), b.background().inside())), false);
  }

 private:
  bool inside(bool a, bool b) const { return (rule_.inside(a, b) & 1) != 0; }

  static std::set<Coord> places(const Root& a, const Root& b) {
    std::set<Coord> result;
    for (const Root* root : {&a, &b}) {
      for (auto child = root->cbeginChildOn(); child; ++child) result.insert(child.getCoord());
      for (auto tile = root->cbeginValueAll(); tile; ++tile) result.insert(tile.getCoord());
    }
    return result;
  }

  /// Returns a branch of `b` for the result: stolen or copied, and complemented for a difference.
  template <class Parent, class Node>
  std::unique_ptr<Node> taken(Parent& b, Node& branch) const {
    // The value left in its position is never read.
    std::unique_ptr<Node> result(steals_ ? b.template stealNode<Node>(branch.origin(), Voxel{}, false)
                                         : new Node(branch));
    if (rule_.turns_b()) Complement<Rules>(context_).turn(*result);
    return result;
  }

  /// Merges an internal node of `b` into one of `a`. Where one of them is uniform, its sign determines if the
  /// other's branch is preserved or the result is uniform, too; in that case the sign used for the branch
  /// does not matter.
  template <class Node>
  void merge(Node& a, Node& b) const {
    for_each_slot<Node>(context_, [&](Index slot) {
      auto *const of_a = child_at(a, slot), *const of_b = child_at(b, slot);
      const bool inside_a = !of_a && tile_inside(a, slot), inside_b = !of_b && tile_inside(b, slot);
      if (of_a && of_b)
        merge_children(a, slot, *of_a, *of_b);
      else if (of_b && rule_.keeps_b(inside_a))
        a.addChild(taken(b, *of_b).release());
      else if (of_a ? !rule_.keeps_a(inside_b) : inside(inside_a, inside_b) != inside_a)
        set_tile(a, slot, inside(inside_a, inside_b));
    });
  }

  template <class Node, class Child>
  void merge_children(Node& a, Index slot, Child& of_a, Child& of_b) const {
    if constexpr (Child::LEVEL > 0) {
      merge(of_a, of_b);
    } else {
      merge_leaves(of_a, of_b);
      // A leaf that lost crossings may still own a crossing edge, which is known only when its neighbours are
      // done; see Pruning.
      if constexpr (!kLosesCrossings<Voxel>)
        if (const auto sign = uniform_sign(of_a)) set_tile(a, slot, *sign);
    }
  }

  /// Merges a leaf of `b` into one of `a`. Voxels that are active in neither have signs only.
  void merge_leaves(Leaf& a, const Leaf& b) const {
    Voxel* const to = a.buffer().data();
    const Voxel* const from = b.buffer().data();
    auto active = a.getValueMask();
    for (Index x = 0; x < 8; ++x) {
      std::uint64_t& word = active.template getWord<std::uint64_t>(x);
      const std::uint64_t either = word | b.getValueMask().template getWord<std::uint64_t>(x);
      const std::uint64_t inside_a = signs(to + 64 * x),
                          inside = rule_.inside(inside_a, signs(from + 64 * x));
      // A voxel is active if an edge of it is still crossed.
      word = 0;
      for_each_bit_of_word(either, [&](Index i) {
        Voxel& voxel = to[64 * x + i];
        Rules::combine(rule_, voxel, from[64 * x + i]);
        word |= std::uint64_t{voxel.crosses(0) || voxel.crosses(1) || voxel.crosses(2)} << i;
      });
      // Where neither operand has a crossing, a voxel is only its sign.
      for_each_bit_of_word((inside ^ inside_a) & ~either, [&](Index i) { change_sign(to[64 * x + i]); });
    }
    a.setValueMask(active);
  }

  BooleanRule rule_;
  bool steals_;
  const RunContext& context_;
};

/// Turns nodes without leaves into tiles, so that the tree has the same form as one made from SparseHermite.
template <class Tree>
class Pruning {
 public:
  using Root = typename Tree::RootNodeType;
  using Upper = typename Root::ChildNodeType;
  using Lower = typename Upper::ChildNodeType;
  using Leaf = typename Tree::LeafNodeType;
  using Voxel = typename Tree::ValueType;

  Pruning(Tree& tree, const RunContext& context) : tree_(tree), context_(context) {}

  void prune() {
    // From the leaves up, as a node is uniform only when its children have become tiles.
    if constexpr (kLosesCrossings<Voxel>) prune_leaves();
    Root& root = tree_.root();
    std::vector<std::pair<Coord, bool>> uniform;
    for (auto upper = root.beginChildOn(); upper; ++upper) {
      for (Index slot = 0; slot < Upper::NUM_VALUES; ++slot)
        if (const Lower* child = child_at(*upper, slot))
          if (const auto sign = uniform_sign(*child)) set_tile(*upper, slot, *sign);
      if (const auto sign = uniform_sign(*upper)) uniform.emplace_back(upper.getCoord(), *sign);
    }
    // After the loop, because it changes the map that the loop iterates over.
    for (const auto& [place, sign] : uniform) root.addTile(place, uniform_voxel<Voxel>(sign), false);
    root.eraseBackgroundTiles();
  }

 private:
  /// Turns leaves that own no crossing edge into tiles. All are tested before the first is removed, since the
  /// voxels beyond them matter.
  void prune_leaves() {
    std::vector<Lower*> nodes;
    tree_.getNodes(nodes);
    std::vector<std::vector<std::pair<Index, bool>>> tiles(nodes.size());
    parallel_blocks(nodes.size(), context_, [&](std::size_t i) {
      for (auto leaf = nodes[i]->cbeginChildOn(); leaf; ++leaf)
        if (const auto sign = uniform_sign(*leaf); sign && has_sign_beyond(*leaf, *sign))
          tiles[i].emplace_back(leaf.pos(), *sign);
    });
    for (std::size_t i = 0; i < nodes.size(); ++i)
      for (const auto& [slot, sign] : tiles[i]) set_tile(*nodes[i], slot, sign);
  }

  bool has_sign_beyond(const Leaf& leaf, bool sign) const {
    for (int i = 0; i < 8; ++i)
      for (int k = 0; k < 8; ++k)
        for (const Coord& step : {Coord(8, i, k), Coord(i, 8, k), Coord(i, k, 8)})
          if (tree_.getValue(leaf.origin() + step).inside() != sign) return false;
    return true;
  }

  Tree& tree_;
  const RunContext& context_;
};

/// Calls f(rules) with the rules of the layout, and for FixedVoxel of the normal code.
template <class Voxel, class F>
void with_rules(NormalCodeId id, F&& f) {
  if constexpr (std::is_same_v<Voxel, ThesisVoxel>)
    f(PrintedVoxel{});
  else if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    with_normal_code(id, [&](auto code) { f(RuledVoxel<Voxel, PackedCrossingCode<decltype(code)>>{}); });
  else
    f(RuledVoxel<Voxel, FloatCrossingCode>{});
}

template <class Voxel>
DenseHermite<Voxel> with_tree(const IndexToWorld& placement, NormalCodeId code,
                              typename DenseGrid<Voxel>::TreeType::Ptr tree) {
  return {placement, code, DenseGrid<Voxel>::create(tree)};
}

}  // namespace

template <DenseVoxel Voxel>
DenseHermite<Voxel> combine(Boolean boolean, DenseHermite<Voxel> a, DenseHermite<Voxel> b,
                            RunContext& context) {
  if (!same_lattice(a.placement, b.placement))
    throw Error("Hermite data on different lattices cannot be combined; sample both with the same voxels");
  // Only FixedVoxel has a choice of codes.
  if (std::is_same_v<Voxel, FixedVoxel> && a.normal_code != b.normal_code)
    throw Error("Hermite data with normals in the codes " + std::string(name(a.normal_code)) + " and " +
                std::string(name(b.normal_code)) + " cannot be combined; pack both in the same code");
  Stage stage(context, "combine Hermite data");
  const Operand<Voxel> of_a(std::move(a)), of_b(std::move(b));
  const auto tree = of_a.changeable();
  with_rules<Voxel>(a.normal_code, [&](auto rules) {
    Merge<decltype(rules)>(boolean, of_b.alone, context).merge_roots(tree->root(), of_b.tree->root());
  });
  Pruning(*tree, context).prune();
  return with_tree<Voxel>(a.placement, a.normal_code, tree);
}

template <DenseVoxel Voxel>
DenseHermite<Voxel> complement(DenseHermite<Voxel> hermite, RunContext& context) {
  Stage stage(context, "complement Hermite data");
  const auto tree = Operand<Voxel>(std::move(hermite)).changeable();
  with_rules<Voxel>(hermite.normal_code,
                    [&](auto rules) { Complement<decltype(rules)>(context).turn_root(tree->root()); });
  return with_tree<Voxel>(hermite.placement, hermite.normal_code, tree);
}

#define HERMESH_INSTANTIATE_COMBINE(Voxel)                                                              \
  template DenseHermite<Voxel> combine(Boolean, DenseHermite<Voxel>, DenseHermite<Voxel>, RunContext&); \
  template DenseHermite<Voxel> complement(DenseHermite<Voxel>, RunContext&);
HERMESH_INSTANTIATE_COMBINE(FloatVoxel)
HERMESH_INSTANTIATE_COMBINE(DirectedVoxel)
HERMESH_INSTANTIATE_COMBINE(ThesisVoxel)
HERMESH_INSTANTIATE_COMBINE(FixedVoxel)

}  // namespace hermesh
