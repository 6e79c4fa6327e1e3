#include "algorithms/lattice/blocks.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>

#include "algorithms/lattice/leaf_table.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/polygon_mesh.h"

namespace hermesh {
namespace {

using openvdb::Coord;
using Tree = openvdb::FloatTree;
using Leaf = Tree::LeafNodeType;
using Accessor = openvdb::tree::ValueAccessor<const Tree>;
using BlockIndex = std::unordered_map<Coord, std::int32_t>;

constexpr BlockMask kAllOutside{};
constexpr BlockMask kAllInside{~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull, ~0ull};

Coord neighbour_of(const Coord& lower, int dx, int dy, int dz) {
  return lower.offsetBy(8 * dx, 8 * dy, 8 * dz);
}

/// Finds the blocks that must be there although the tree has no leaf for them.
class MissingBlocks {
 public:
  MissingBlocks(const Tree& tree, const std::function<bool(double)>& is_inside)
      : tree_(tree), is_inside_(is_inside) {}

  /// A leaf's six neighbours: one that is a tile of another sign than the samples next to it must become a
  /// block.
  void beside_leaf(Accessor& access, const Block& block, std::vector<Coord>& found) const {
    constexpr std::uint64_t kRow = 0xff, kFirstZ = 0x0101010101010101u;
    const Coord lower(block.lower[0], block.lower[1], block.lower[2]);
    std::uint64_t any_inside = 0, all_inside = ~0ull;
    for (const std::uint64_t word : block.inside) any_inside |= word, all_inside &= word;
    const auto check = [&](int dx, int dy, int dz, std::uint64_t some, std::uint64_t every,
                           std::uint64_t face) {
      const Coord there = neighbour_of(lower, dx, dy, dz);
      if (access.probeConstLeaf(there)) return;
      const bool inside = is_inside_(access.getValue(there));
      if (inside ? (every & face) != face : (some & face) != 0) found.push_back(there);
    };
    check(-1, 0, 0, block.inside[0], block.inside[0], ~0ull);
    check(+1, 0, 0, block.inside[7], block.inside[7], ~0ull);
    check(0, -1, 0, any_inside, all_inside, kRow);
    check(0, +1, 0, any_inside, all_inside, kRow << 56);
    check(0, 0, -1, any_inside, all_inside, kFirstZ);
    check(0, 0, +1, any_inside, all_inside, kFirstZ << 7);
  }

 private:
  const Tree& tree_;
  const std::function<bool(double)>& is_inside_;
};

/// Runs f(item, found) over 0…n−1 in parallel and joins the lists in order.
template <class F>
std::vector<Coord> collect(std::size_t n, F&& f) {
  std::vector<std::vector<Coord>> lists(n);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, n, 16),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t i = range.begin(); i < range.end(); ++i) f(i, lists[i]);
                    });
  std::vector<Coord> all;
  for (const auto& list : lists) all.insert(all.end(), list.begin(), list.end());
  return all;
}

/// As Leaf::evalActiveBoundingBox(), which looks at one voxel after the other.
void include_active(const Leaf& leaf, openvdb::CoordBBox& box) {
  Coord lowest(8), highest(-1);
  std::uint64_t any_x = 0;
  for (int x = 0; x < 8; ++x) {
    const std::uint64_t word = leaf.getValueMask().getWord<std::uint64_t>(static_cast<openvdb::Index>(x));
    if (word == 0) continue;
    lowest.x() = std::min(lowest.x(), x), highest.x() = x;
    any_x |= word;
  }
  if (any_x == 0) return;
  lowest.y() = std::countr_zero(any_x) / 8, highest.y() = 7 - std::countl_zero(any_x) / 8;
  for (const int half : {32, 16, 8}) any_x |= any_x >> half;
  const auto any_y = static_cast<std::uint8_t>(any_x);
  lowest.z() = std::countr_zero(any_y), highest.z() = 7 - std::countl_zero(any_y);
  box.expand(openvdb::CoordBBox(leaf.origin() + lowest, leaf.origin() + highest));
}

}  // namespace

openvdb::CoordBBox active_box(const openvdb::FloatTree& tree) {
  using Upper = Tree::RootNodeType::ChildNodeType;
  using Lower = Upper::ChildNodeType;
  openvdb::CoordBBox box;
  for (auto tile = tree.root().cbeginValueOn(); tile; ++tile) box.expand(tile.getCoord(), Upper::DIM);
  for (auto upper = tree.root().cbeginChildOn(); upper; ++upper) {
    for (auto tile = upper->cbeginValueOn(); tile; ++tile) box.expand(tile.getCoord(), Lower::DIM);
    for (auto lower = upper->cbeginChildOn(); lower; ++lower) {
      if (box.isInside(lower->getNodeBoundingBox())) continue;
      for (auto tile = lower->cbeginValueOn(); tile; ++tile) box.expand(tile.getCoord(), Leaf::DIM);
      for (auto leaf = lower->cbeginChildOn(); leaf; ++leaf)
        if (!box.isInside(openvdb::CoordBBox::createCube(leaf.getCoord(), Leaf::DIM))) include_active(*leaf, box);
    }
  }
  return box;
}

IndexToWorld placement_of(const openvdb::FloatGrid& grid) {
  if (!grid.transform().isLinear())
    throw Error(
        "the volume has a perspective transform, which is not supported; resample it to a linear one");
  const openvdb::Mat4R matrix = grid.transform().baseMap()->getAffineMap()->getMat4();
  IndexToWorld result;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) result.linear(row, column) = matrix(column, row);
  const Eigen::Vector3d translation(matrix(3, 0), matrix(3, 1), matrix(3, 2));

  const openvdb::CoordBBox box = active_box(grid.tree());
  Bounds world;
  if (!box.empty()) {
    for (int axis = 0; axis < 3; ++axis) {
      // Far from index zero the base moves along, so that index coordinates relative to it are small and
      // exact.
      const double middle = 0.5 * (double(box.min()[axis]) + double(box.max()[axis]));
      const double reach = 4.0 * box.extents().asVec3d()[box.maxExtent()];
      result.base[axis] =
          std::abs(middle) > reach ? 8 * static_cast<std::int32_t>(std::floor(middle / 8)) : 0;
    }
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d index((corner & 1 ? box.max() : box.min()).x(),
                                  (corner & 2 ? box.max() : box.min()).y(),
                                  (corner & 4 ? box.max() : box.min()).z());
      world.add(result.linear * index + translation);
    }
    result.origin = choose_origin(world);
  }
  const Eigen::Vector3d base(result.base[0], result.base[1], result.base[2]);
  result.offset = result.linear * base + (translation - result.origin);
  return result;
}

BlockGrid::BlockGrid(const LevelSet& level_set, double isovalue, RunContext& context)
    : level_set_(level_set), isovalue_(isovalue) {
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  scale_ = double(inside_rule(grid, isovalue).scale);
  placement_ = placement_of(grid);
  read_leaves(level_set, context);

  const Tree& tree = grid.tree();
  const std::function<bool(double)> is_inside = [this](double value) {
    return scale_ * (value - isovalue_) < 0;
  };
  const MissingBlocks missing(tree, is_inside);
  const std::size_t leaves = blocks_.size();
  std::vector<Coord> added = collect(leaves, [&](std::size_t i, std::vector<Coord>& found) {
    Accessor access(tree);
    missing.beside_leaf(access, blocks_[i], found);
  });
  const std::vector<Coord> beside_tiles = tiles_between_signs(tree, inside_rule(grid, isovalue), context);
  added.insert(added.end(), beside_tiles.begin(), beside_tiles.end());

  BlockIndex index;
  index.reserve(leaves + added.size());
  for (std::size_t i = 0; i < leaves; ++i)
    index.emplace(Coord(blocks_[i].lower[0], blocks_[i].lower[1], blocks_[i].lower[2]),
                  static_cast<std::int32_t>(i));

  std::map<float, const float*> uniform;
  const auto add = [&](std::vector<Coord> wanted) {
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    Accessor access(tree);
    for (const Coord& lower : wanted) {
      if (!index.emplace(lower, static_cast<std::int32_t>(blocks_.size())).second) continue;
      const float value = access.getValue(lower);
      const float*& values = uniform[value];
      if (!values) {
        uniform_values_.push_back(std::make_unique<std::array<float, 512>>());
        uniform_values_.back()->fill(value);
        values = uniform_values_.back()->data();
      }
      Block block;
      block.lower = {lower.x(), lower.y(), lower.z()};
      block.values = values;
      block.inside = is_inside(value) ? kAllInside : kAllOutside;
      if (access.isValueOn(lower)) block.active = kAllInside;
      blocks_.push_back(block);
    }
  };
  const auto link = [&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blocks_.size(), 32), [&](const auto& range) {
      Accessor access(tree);
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        const Coord lower(blocks_[i].lower[0], blocks_[i].lower[1], blocks_[i].lower[2]);
        for (int slot = 0; slot < 27; ++slot) {
          const Coord there = neighbour_of(lower, slot / 9 - 1, slot / 3 % 3 - 1, slot % 3 - 1);
          const auto found = index.find(there);
          blocks_[i].neighbours[slot] = found != index.end()                ? found->second
                                        : is_inside(access.getValue(there)) ? kUniformInside
                                                                            : kUniformOutside;
        }
      }
    });
  };
  add(std::move(added));
  link();

  // The first corner of a cell at the lower border of the blocks may lie where no block is yet.
  const std::vector<Coord> below = collect(blocks_.size(), [&](std::size_t i, std::vector<Coord>& found) {
    const Block& block = blocks_[i];
    const Coord lower(block.lower[0], block.lower[1], block.lower[2]);
    const auto edges = crossing_edges(static_cast<std::int32_t>(i));
    BlockMask at[3];  // samples that own an edge across the axis, so that the cell one step down that axis is
                      // active
    for (int x = 0; x < 8; ++x) {
      at[0][x] = edges[1][x] | edges[2][x];
      at[1][x] = edges[0][x] | edges[2][x];
      at[2][x] = edges[0][x] | edges[1][x];
    }
    const auto want = [&](int dx, int dy, int dz) {
      if (block.neighbours[neighbour_slot(dx, dy, dz)] < 0) found.push_back(neighbour_of(lower, dx, dy, dz));
    };
    constexpr std::uint64_t kRow = 0xff, kFirstZ = 0x0101010101010101u;
    std::uint64_t y_edge = 0, z_edge = 0, yz_edge = 0;
    for (int x = 0; x < 8; ++x) {
      y_edge |= at[1][x] & kRow;
      z_edge |= at[2][x] & kFirstZ;
      yz_edge |= edges[0][x] & 1;
    }
    if (at[0][0]) want(-1, 0, 0);
    if (y_edge) want(0, -1, 0);
    if (z_edge) want(0, 0, -1);
    if (yz_edge) want(0, -1, -1);
    if (edges[1][0] & kFirstZ) want(-1, 0, -1);
    if (edges[2][0] & kRow) want(-1, -1, 0);
  });
  if (!below.empty()) {
    add(below);
    link();
  }
}

void BlockGrid::read_leaves(const LevelSet& level_set, RunContext& context) {
  std::vector<const Leaf*> leaves;
  level_set.grid().grid->tree().getNodes(leaves);
  blocks_.resize(leaves.size());
  std::atomic<bool> finite{true};
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves.size(), 64), [&](const auto& range) {
    context.check();
    bool all_finite = true;
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const Leaf& leaf = *leaves[i];
      Block& block = blocks_[i];
      block.lower = {leaf.origin().x(), leaf.origin().y(), leaf.origin().z()};
      block.values = leaf.buffer().data();
      for (int word = 0; word < 8; ++word) {
        std::uint64_t bits = 0;
        for (int bit = 0; bit < 64; ++bit) {
          const double value = block.values[64 * word + bit];
          all_finite &= std::isfinite(value);
          bits |= static_cast<std::uint64_t>(scale_ * (value - isovalue_) < 0) << bit;
        }
        block.inside[word] = bits;
        block.active[word] = leaf.getValueMask().getWord<std::uint64_t>(word);
      }
    }
    if (!all_finite) finite = false;
  });
  if (!finite) throw Error("the volume holds a value that is not finite; replace it before the extraction");
}

void BlockGrid::throw_no_block(std::int32_t block, int x, int y, int z) const {
  const auto& lower = blocks_[static_cast<std::size_t>(block)].lower;
  const auto at = [](int i, int j, int k) {
    return "(" + std::to_string(i) + ", " + std::to_string(j) + ", " + std::to_string(k) + ")";
  };
  throw Error("an extractor looked up the sample " + at(x, y, z) + " of the block at " +
              at(lower[0], lower[1], lower[2]) +
              ", where the grid has no block; Block::neighbours tells what is outside or inside throughout");
}

BlockMask BlockGrid::shifted_inside(std::int32_t block, int dx, int dy, int dz) const {
  return shifted_mask(dx, dy, dz, [&](int ax, int ay, int az) -> const BlockMask& {
    const std::int32_t there = blocks_[block].neighbours[neighbour_slot(ax, ay, az)];
    return there >= 0 ? blocks_[there].inside : there == kUniformInside ? kAllInside : kAllOutside;
  });
}

std::array<BlockMask, 3> BlockGrid::crossing_edges(std::int32_t block) const {
  const BlockMask& own = blocks_[block].inside;
  std::array<BlockMask, 3> edges{shifted_inside(block, 1, 0, 0), shifted_inside(block, 0, 1, 0),
                                 shifted_inside(block, 0, 0, 1)};
  for (BlockMask& axis : edges)
    for (int x = 0; x < 8; ++x) axis[x] ^= own[x];
  return edges;
}

}  // namespace hermesh
