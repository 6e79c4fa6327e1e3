// The leaves of a scalar volume by number, with their signs as bits and their neighbours found without a search.
// Heavy (OpenVDB): include it from .cpp files.
#pragma once

#include <openvdb/openvdb.h>

#include <array>
#include <cstdint>
#include <limits>
#include <unordered_map>
#include <vector>

#include "algorithms/core/blocks.h"
#include "algorithms/core/large_array.h"
#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Which samples of a volume are inside. In a level set those less than the isovalue. In any other volume the
/// background is outside: samples on the other side of the isovalue are inside, so that dense fog is. A sample
/// exactly at the isovalue is outside.
struct InsideRule {
  float isovalue = 0.0f;
  float scale = 1.0f;  ///< −1 where greater values are inside

  /// Negative inside, in units of the grid's values.
  float signed_value(float value) const { return scale * (value - isovalue); }
  bool operator()(float value) const { return signed_value(value) < 0.0f; }
};

/// Leaves are numbered in the order of the tree, which is that of a walk over its lowest internal nodes. In one of
/// these, 16³ leaves wide, a leaf's number is that of the node's first leaf plus its rank in the child mask, so a
/// neighbour costs a few operations on words at hand.
class LeafTable {
 public:
  /// Reads every sample once. Where a tile of one sign meets a tile of the other, or a leaf's first layer, the tree is
  /// copied and the tile made a leaf, so that every edge with a change of sign starts in a leaf.
  LeafTable(const LevelSet& level_set, double isovalue, RunContext& context);

  std::size_t size() const { return values_.size(); }
  const InsideRule& rule() const { return rule_; }
  const openvdb::FloatTree& tree() const { return *tree_; }

  const float* values(std::size_t leaf) const { return values_[leaf]; }
  const BlockMask& inside(std::size_t leaf) const { return inside_[leaf]; }
  /// inside() for what neighbour() gives.
  const BlockMask& signs(std::int32_t leaf) const {
    return leaf >= 0 ? inside_[static_cast<std::size_t>(leaf)] : leaf == kUniformInside ? kAllInside : kAllOutside;
  }
  /// Whether anything that is inside and not active is less than `distance` from the isovalue. Looks at tiles, and only
  /// where none is inside at samples, too.
  bool has_inactive_inside_nearer_than(float distance) const;
  /// Samples of the band, at the bits of BlockMask.
  BlockMask active(std::size_t leaf) const;
  openvdb::Coord lower(std::size_t leaf) const;

  /// A leaf's number, or kUniformOutside or kUniformInside where there is none; each offset −1, 0 or 1.
  std::int32_t neighbour(std::size_t leaf, int dx, int dy, int dz) const;
  /// The leaf itself and its seven neighbours one step up (`side` 1) or down (−1) along each axis or not: at
  /// |dx| + 2|dy| + 4|dz|. As neighbour(), but the eight cost little more than one.
  std::array<std::int32_t, 8> neighbours(std::size_t leaf, int side) const;
  /// All neighbours, by neighbour_slot(), and the leaf itself at 13.
  std::array<std::int32_t, 27> surroundings(std::size_t leaf) const;
  /// The numbers of all leaves, in ascending order of the leaves' coordinates (x, y, z).
  std::vector<std::uint32_t> in_order_of_place() const;

 private:
  static constexpr BlockMask kAllOutside{}, kAllInside{~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull};
  using Leaf = openvdb::FloatTree::LeafNodeType;
  using LargeNode = openvdb::FloatTree::RootNodeType::ChildNodeType;
  using TreeNode = LargeNode::ChildNodeType;
  static constexpr int kWords = 64;  ///< of a mask of 16³ bits
  using NodeMask = std::array<std::uint64_t, kWords>;

  static constexpr float kNoTile = -std::numeric_limits<float>::infinity();

  struct Node {
    openvdb::Coord lower;
    const TreeNode* source = nullptr;
    NodeMask child{}, tile_inside{};
    std::array<std::uint32_t, kWords> rank{};  ///< number of the first leaf of each word
    std::array<std::int32_t, 27> neighbours{};  ///< by neighbour_slot(); a node's number or kUniform…
    float nearest_inside = kNoTile;  ///< signed value of the inside tile that is nearest to the isovalue
  };
  struct Place {
    std::uint32_t node;
    std::uint32_t slot;  ///< in the node, 256x+16y+z
  };

  void number_leaves(RunContext& context);
  void read_signs(RunContext& context);
  bool is_complete(RunContext& context) const;
  bool tiles_meet(const Node& node) const;
  std::vector<openvdb::CoordBBox> large_tiles_unlike_background(RunContext& context) const;
  bool meets_background(const openvdb::CoordBBox& tile) const;
  bool differs_from_tile_below(std::size_t leaf, int axis) const;
  std::int32_t find(const Node& node, std::uint32_t slot) const;
  static void find_three(const Node& node, std::uint32_t slot, std::int32_t* result);
  std::vector<openvdb::Coord> missing_leaves(RunContext& context) const;

  openvdb::FloatTree::ConstPtr tree_;
  InsideRule rule_;
  std::vector<Node> nodes_;
  LargeArray<Place> places_;
  LargeArray<const Leaf*> leaves_;
  LargeArray<const float*> values_;
  LargeArray<BlockMask> inside_;
};

/// As FloatTree::evalActiveVoxelBoundingBox(), which reads where a leaf is from the leaf itself, and so waits for memory as
/// often as there are leaves. Most lie within the box of those before them, and then the node above tells.
openvdb::CoordBBox active_box(const openvdb::FloatTree& tree);

/// Placement of a grid: its affine map, with the origin of single precision chosen near its active voxels.
/// @throws Error for a grid with perspective.
IndexToWorld placement_of(const openvdb::FloatGrid& grid);

/// The rule for a grid. @throws Error if the isovalue or the background is not finite.
InsideRule inside_rule(const openvdb::FloatGrid& grid, double isovalue);

/// Tiles, as origins of 8³ blocks, that meet a sample of the other sign in another tile.
std::vector<openvdb::Coord> tiles_between_signs(const openvdb::FloatTree& tree, const InsideRule& is_inside,
                                                RunContext& context);

}  // namespace hermesh
