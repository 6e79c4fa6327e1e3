// The leaves of a scalar volume by number, with their signs as bits and their neighbours without a search. It
// refers to OpenVDB's trees without including them, so that extractors compile in half the time.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/level_set.h"
#include "algorithms/core/openvdb_forward.h"
#include "algorithms/core/run_context.h"
#include "algorithms/lattice/block_mask.h"
#include "algorithms/lattice/read_signs.h"

namespace hermesh {

/// Reports a sample that is not finite. @throws Error always
[[noreturn]] void throw_not_finite();

/// Positions of the leaves of a volume, and addresses of their samples; no sample is read. Leaves are
/// numbered node by node, in the order in which the tree lists its lowest internal nodes, and within a node
/// in ascending order of (x, y, z).
class LeafPlaces {
 public:
  /// @throws Error if the isovalue or the background is not finite, or for more leaves than 32 bits can
  /// number; Cancelled.
  LeafPlaces(const LevelSet& level_set, double isovalue, RunContext& context);
  LeafPlaces(const LeafPlaces&) = delete;
  LeafPlaces& operator=(const LeafPlaces&) = delete;

  std::size_t size() const { return leaves_.size(); }
  const InsideRule& rule() const { return rule_; }
  /// Returns the volume's tree, or the copy of it that a LeafTable made.
  const openvdb::FloatTree& tree() const { return *tree_; }
  float background() const;
  /// Returns the tree's value, or its state, at coordinates relative to the first sample of `leaf`, in a leaf
  /// or a tile, by a search from the root.
  float value_at(std::size_t leaf, int x, int y, int z) const;
  bool is_active_at(std::size_t leaf, int x, int y, int z) const;

  /// Returns the 512 samples of a leaf, in the order of BlockMask. `leaf` may also be a value of neighbour()
  /// without a leaf: then all samples are +infinity, both inside and outside, so no sign may be read from
  /// them.
  const float* values(std::int64_t leaf) const { return values_[static_cast<std::size_t>(leaf + kUniforms)]; }
  /// Returns the active samples: in a level set, those of the band.
  BlockMask active(std::size_t leaf) const;
  /// Returns the index coordinates of the leaf's first sample.
  std::array<std::int32_t, 3> lower(std::size_t leaf) const {
    // The leaf itself is in no cache.
    const Place place = places_[leaf];
    const auto at = [&](int shift) { return static_cast<std::int32_t>(8 * (place.slot >> shift & 15)); };
    const auto& [x, y, z] = nodes_[place.node].lower;
    return {x + at(8), y + at(4), z + at(0)};
  }

  /// Returns the number of the leaf at an offset in leaves, each −1, 0 or 1. Without a leaf it is
  /// kUniformOutside or kUniformInside (block_mask.h), by the sign of the tile or background there.
  std::int32_t neighbour(std::size_t leaf, int dx, int dy, int dz) const {
    return around_[leaf][kStepX * dx + kStepY * dy + dz];
  }
  /// Prefetches the numbers of the neighbours at +1 along x and along y.
  [[gnu::always_inline]] void ask_for_neighbours(std::size_t leaf) const {
    __builtin_prefetch(around_[leaf] + kStepX);
    __builtin_prefetch(around_[leaf] + kStepY);
  }
  /// Returns the leaf at each offset whose parts are 0 or `side` (1 or −1), as neighbour() does, itself
  /// included. Offset (dx, dy, dz) is at entry |dx| + 2|dy| + 4|dz|.
  std::array<std::int32_t, 8> neighbours(std::size_t leaf, int side) const {
    std::array<std::int32_t, 8> result;
    for (int i = 0; i < 8; ++i)
      result[i] = neighbour(leaf, side * (i & 1), side * (i >> 1 & 1), side * (i >> 2));
    return result;
  }
  /// Returns the numbers of all neighbours, by neighbour_slot(), with the leaf itself at 13.
  std::array<std::int32_t, 27> surroundings(std::size_t leaf) const {
    std::array<std::int32_t, 27> result;
    for (int dx = -1; dx <= 1; ++dx)
      for (int dy = -1; dy <= 1; ++dy)
        std::copy_n(around_[leaf] + kStepX * dx + kStepY * dy - 1, 3, &result[neighbour_slot(dx, dy, -1)]);
    return result;
  }
  /// One layer of leaves across x. It may hold no leaf.
  struct Slab {
    std::span<const std::uint32_t> nodes;  ///< numbers of all nodes of one x, in ascending order of (y, z)
    int x;                                 ///< which layer of leaves within the nodes, 0 to 15
  };
  /// Returns slabs that together hold all leaves, in ascending order of x. They refer to this object.
  std::vector<Slab> slabs() const;
  /// Calls f(leaf) for every leaf of the slab, in ascending order of (y, z).
  template <class F>
  void for_each_leaf(const Slab& slab, F&& f) const;
  /// Calls f(first, end) for ranges, possibly empty, that together are the numbers of all leaves of the slab.
  template <class F>
  void for_each_range(const Slab& slab, F&& f) const {
    for (const std::uint32_t node : slab.nodes)
      f(nodes_[node].first_at[slab.x], nodes_[node].first_at[slab.x + 1]);
  }

  /// Returns true if a tile of one sign shares a face with a tile of the other, the background included, so
  /// that edges change sign and neither start nor end in a leaf.
  bool tiles_of_both_signs_meet(RunContext& context) const;
  /// Returns true if an edge along the axis that ends in the leaf changes sign and starts in no leaf;
  /// `inside` are the leaf's signs.
  bool differs_from_tile_below(std::size_t leaf, const BlockMask& inside, int axis) const {
    const std::int32_t there = neighbour(leaf, -(axis == 0), -(axis == 1), -(axis == 2));
    return there < 0 && !first_layer_is(inside, axis, there == kUniformInside);
  }
  /// Returns the signed value (InsideRule), negative, of the inside tile that is nearest to the isovalue,
  /// among tiles as small as a leaf; nothing without such a tile.
  std::optional<float> nearest_tile_inside() const;

 protected:
  /// Makes an object without leaves, for a class that numbers them itself.
  LeafPlaces(const LevelSet& level_set, double isovalue);
  /// Numbers the leaves of tree_. With `with_values` it finds their samples, too; else find_values() must be
  /// called for a leaf before values().
  void number_leaves(RunContext& context, bool with_values);
  /// Stores the address of the leaf's samples, for values(). It reads the leaf, so ask_for() should be called
  /// long before.
  void find_values(std::size_t leaf);
  [[gnu::always_inline]] void ask_for(std::size_t leaf) const { __builtin_prefetch(leaves_[leaf]); }

  std::shared_ptr<const openvdb::FloatTree> tree_;
  InsideRule rule_;

 private:
  static constexpr float kNoTile = -std::numeric_limits<float>::infinity();
  using Leaf = openvdb::tree::LeafNode<float, 3>;
  using TreeNode = openvdb::tree::InternalNode<Leaf, 4>;
  using LargeNode = openvdb::tree::InternalNode<TreeNode, 5>;
  static constexpr int kWords = 64;  ///< words of a mask of 16³ bits
  using NodeMask = std::array<std::uint64_t, kWords>;
  /// The numbers (or kUniform…) of the 18³ slots for leaves in a node and one slot around it, for look-ups
  /// without a search or bit counts; the array is smaller than the node's own table. (With masks and bit
  /// counts, which fit into the caches, a conversion to Hermite data takes up to 7 % longer on two cores:
  /// there are dozens of look-ups per leaf.)
  static constexpr int kStepY = 18, kStepX = 18 * kStepY;
  using Numbers = std::array<std::int32_t, 18 * kStepX>;
  static constexpr int number_slot(int x, int y, int z) {
    return kStepX * (x + 1) + kStepY * (y + 1) + z + 1;
  }

  struct Node {
    std::array<std::int32_t, 3> lower{};  ///< index coordinates of its first sample
    const TreeNode* source = nullptr;
    NodeMask child{}, tile_inside{};
    std::array<std::uint32_t, 17> first_at{};   ///< number of the first leaf at every x, and behind the last
    std::array<std::int32_t, 27> neighbours{};  ///< a node's number or kUniform…, by neighbour_slot()
    float nearest_inside = kNoTile;  ///< signed value of the inside tile nearest to the isovalue, or kNoTile
  };
  struct Place {
    std::uint32_t node;
    std::uint32_t slot;  ///< in the node, 256x+16y+z
  };

  static constexpr int kUniforms = 2;  ///< kUniformOutside and kUniformInside are −1 and −2
  /// Returns true if all samples of the first layer along the axis are `inside`.
  static bool first_layer_is(const BlockMask& signs, int axis, bool inside);

  void find_tiles(Node& node) const;
  void number(Node& node, std::uint32_t index, std::uint32_t next);
  void number_around(std::size_t node);
  bool tiles_meet(const Node& node) const;
  std::vector<openvdb::CoordBBox> large_tiles_unlike_background(RunContext& context) const;
  bool meets_background(const openvdb::CoordBBox& tile) const;

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> nodes_in_order_;  ///< numbers of nodes in the order of their coordinates
  LargeArray<Numbers> numbers_;                ///< one entry a node
  LargeArray<Place> places_;
  LargeArray<const Leaf*> leaves_;
  LargeArray<const float*> values_;         ///< samples of leaves; the first entry is for leaf −kUniforms
  LargeArray<const std::int32_t*> around_;  ///< pointer to a leaf's own slot among its node's numbers
};

template <class F>
void LeafPlaces::for_each_leaf(const Slab& slab, F&& f) const {
  const auto y_of = [&](std::size_t i) { return nodes_[slab.nodes[i]].lower[1]; };
  std::vector<std::uint32_t> next;  // each node's next leaf; within a node numbers ascend with (y, z), too
  for (std::size_t column = 0, end; column < slab.nodes.size(); column = end) {
    next.clear();
    for (end = column; end < slab.nodes.size() && y_of(end) == y_of(column); ++end)
      next.push_back(nodes_[slab.nodes[end]].first_at[slab.x]);
    for (int word = 4 * slab.x; word < 4 * slab.x + 4; ++word) {
      std::uint64_t any = 0;
      for (std::size_t i = column; i < end; ++i) any |= nodes_[slab.nodes[i]].child[word];
      if (any == 0) continue;
      for (int row = 0; row < 4; ++row)
        for (std::size_t i = column; i < end; ++i) {
          const auto leaves = static_cast<std::uint16_t>(nodes_[slab.nodes[i]].child[word] >> (16 * row));
          for (int left = std::popcount(leaves); left > 0; --left) f(next[i - column]++);
        }
    }
  }
}

/// The leaves of a volume with the signs of their samples as bits.
class LeafTable : public LeafPlaces {
 public:
  /// Reads every sample once. Where a tile of one sign shares a face with a tile of the other, or lies below
  /// a leaf whose first layer has the other sign, the tree is copied, the 8³ blocks of tiles along that
  /// border become leaves, and all samples are read again: then every edge with a change of sign starts in a
  /// leaf.
  /// @throws Error if a sample of a leaf, the isovalue or the background is not finite, as
  /// tiles_between_signs() does, or for more leaves than 32 bits can number; Cancelled.
  LeafTable(const LevelSet& level_set, double isovalue, RunContext& context);

  /// Returns the samples of the leaf that are inside.
  const BlockMask& inside(std::size_t leaf) const { return inside_[leaf]; }
  /// Returns the samples of a leaf that are inside; for values of neighbour() without a leaf, all samples or
  /// none.
  const BlockMask& signs(std::int32_t leaf) const {
    return leaf >= 0                ? inside_[static_cast<std::size_t>(leaf)]
           : leaf == kUniformInside ? kAllInside
                                    : kAllOutside;
  }
  /// Returns the edges along each axis that start in the leaf and change sign, at the bits of their first
  /// samples.
  std::array<BlockMask, 3> crossing_edges(std::size_t leaf) const;
  /// Returns leaf and sample at coordinates from −8 to 15, relative to the first sample of `leaf`. There is a
  /// leaf at the first sample of every edge with a change of sign; for other samples see neighbour(). @throws
  /// Error that names the sample if there is no leaf, or for other coordinates.
  LatticePlace locate(std::size_t leaf, int x, int y, int z) const {
    constexpr auto is_beyond = [](int i) { return static_cast<unsigned>(i + 8) > 23u; };
    if (is_beyond(x) || is_beyond(y) || is_beyond(z)) throw_no_leaf(leaf, x, y, z);
    const std::int32_t there = neighbour(leaf, x >> 3, y >> 3, z >> 3);
    if (there < 0) throw_no_leaf(leaf, x, y, z);
    return {there, sample_index(x & 7, y & 7, z & 7)};
  }
  /// Returns true if a leaf has a sample that is inside, inactive, and less than `distance` from the
  /// isovalue, in the grid's values. Ignores tiles, see nearest_tile_inside().
  bool has_inactive_inside_nearer_than(float distance) const;

 private:
  [[noreturn]] void throw_no_leaf(std::size_t leaf, int x, int y, int z) const;
  void read_signs(RunContext& context);
  bool is_complete(RunContext& context) const;
  std::vector<openvdb::Coord> missing_leaves(RunContext& context) const;

  LargeArray<BlockMask> inside_;
};

/// Returns the rule that defines the inside of a grid, with the isovalue rounded to single precision such
/// that no sample changes its side. @throws Error if the isovalue or the background is not finite.
InsideRule inside_rule(const openvdb::FloatGrid& grid, double isovalue);

/// Returns the first samples of the 8³ blocks of tiles, on both sides, where tiles of different sign share a
/// face; some of them several times. @throws Error for more than 70,000 such pairs of blocks, a surface of
/// 4.5 million faces of voxels that no narrow band samples; Cancelled.
std::vector<openvdb::Coord> tiles_between_signs(const openvdb::FloatTree& tree, const InsideRule& is_inside,
                                                RunContext& context);

/// Copies the volume with a leaf at each of these index coordinates; its samples have the values of the
/// former tiles.
LevelSet with_leaves(const LevelSet& level_set, std::span<const std::array<std::int32_t, 3>> lowers);

}  // namespace hermesh
