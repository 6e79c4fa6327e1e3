#include "algorithms/voxelization/inside/regions.h"

#include <tbb/parallel_for.h>

#include <memory>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

/// The voxels of a block from which one may step to the upper neighbour within the block, by axis.
struct Steps {
  BlockMask up[3];
};

/// Steps between voxels that no triangle separates. Along x nobody steps from the last word.
Steps steps_between(const kernels::EdgeBits& crossed) {
  Steps steps;
  for (std::size_t x = 0; x < 8; ++x) {
    steps.up[0][x] = ~crossed.word[0][x];
    steps.up[1][x] = ~crossed.word[1][x] & kBelowTopY;
    steps.up[2][x] = ~crossed.word[2][x] & kBelowTopZ;
  }
  return steps;
}

/// Steps between neighbours both of which are in `free`: cells without a block on a coarse level.
Steps steps_among(const BlockMask& free) {
  Steps steps;
  for (std::size_t x = 0; x < 8; ++x) {
    steps.up[0][x] = x < 7 ? free[x] & free[x + 1] : 0;
    steps.up[1][x] = free[x] & free[x] >> 8 & kBelowTopY;
    steps.up[2][x] = free[x] & free[x] >> 1 & kBelowTopZ;
  }
  return steps;
}

/// Lets the bits of one layer spread along its steps, all at once, until nothing is added. A step leads both
/// ways.
std::uint64_t spread_in_word(std::uint64_t m, std::uint64_t up_y, std::uint64_t up_z) {
  std::uint64_t before;
  do {
    before = m;
    m |= (m & up_z) << 1 | (m >> 1 & up_z);
    m |= (m & up_y) << 8 | (m >> 8 & up_y);
  } while (m != before);
  return m;
}

/// Finds all voxels of `free` that can be reached from its first one.
BlockMask reach_from_first(const BlockMask& free, const Steps& steps) {
  BlockMask reached{};
  for (std::size_t x = 0; x < 8; ++x)
    if (free[x]) {
      // Only the lowest bit, the first in the order of the voxels.
      reached[x] = free[x] & -free[x];
      break;
    }
  bool changed = true;
  // Takes over from both neighbouring layers, then spreads within the layer.
  const auto visit = [&](std::size_t x) {
    std::uint64_t m = reached[x];
    if (x > 0) m |= reached[x - 1] & steps.up[0][x - 1];
    if (x < 7) m |= reached[x + 1] & steps.up[0][x];
    if (m == 0) return;
    m = spread_in_word(m, steps.up[1][x], steps.up[2][x]);
    changed |= m != reached[x];
    reached[x] = m;
  };
  while (changed) {
    changed = false;
    // Up and down in turn: one sweep crosses all layers that lie in its way.
    for (std::size_t x = 0; x < 8; ++x) visit(x);
    for (std::size_t x = 8; x-- > 0;) visit(x);
  }
  return reached;
}

/// Parts `free` into connected sets, in the order of their first voxels.
void add_components(BlockMask free, const Steps& steps, std::vector<BlockMask>& components) {
  const auto any = [&] {
    std::uint64_t bits = 0;
    for (const std::uint64_t word : free) bits |= word;
    return bits != 0;
  };
  while (any()) {
    components.push_back(reach_from_first(free, steps));
    for (std::size_t x = 0; x < 8; ++x) free[x] &= ~components.back()[x];
  }
}

/// A level of blocks of 8³ cells. On the finest level the cells are voxels; above, they are the blocks of the
/// level below, and the components are those of the cells without a block.
struct Level {
  std::vector<BlockAt> blocks;
  std::vector<std::uint32_t> first;  ///< component of each block, as a node
  std::vector<BlockMask> components;
  std::uint32_t node = 0;  ///< number of the first component's node
};

/// Fills in a level's components: components_of(i, list) adds those of block i. Chunks of a size that depends
/// on nothing are put together in their order, so that the numbers are the same at any thread count.
template <class F>
void find_components(Level& level, const RunContext& context, F&& components_of) {
  const std::size_t n = level.blocks.size();
  constexpr std::size_t kChunk = 256;
  std::vector<std::vector<BlockMask>> found((n + kChunk - 1) / kChunk);
  level.first.assign(n + 1, 0);
  tbb::parallel_for(std::size_t(0), found.size(), [&](std::size_t chunk) {
    context.check();
    for (std::size_t i = chunk * kChunk; i < std::min(n, (chunk + 1) * kChunk); ++i) {
      const std::size_t before = found[chunk].size();
      components_of(i, found[chunk]);
      level.first[i + 1] = std::uint32_t(found[chunk].size() - before);
    }
  });
  for (std::size_t i = 0; i < n; ++i) level.first[i + 1] += level.first[i];
  level.components.reserve(level.first[n]);
  for (std::vector<BlockMask>& chunk : found) {
    level.components.insert(level.components.end(), chunk.begin(), chunk.end());
    chunk = {};
  }
}

/// All levels, and a set of disjoint regions over their components. Empty space is a component of the
/// coarsest kind of cell that it fills, so that space costs by surface and not by volume.
class Hierarchy {
 public:
  Hierarchy(const BlockTable& table, const std::vector<kernels::EdgeBits>& crossed, const RunContext& context)
      : crossed_(crossed), context_(context) {
    tables_.push_back(&table);
    levels_.emplace_back();
    levels_[0].blocks = table.blocks();
    find_components(levels_[0], context, [&](std::size_t i, std::vector<BlockMask>& out) {
      BlockMask free;
      free.fill(~0ull);
      add_components(free, steps_between(crossed[i]), out);
    });
    // Eight times coarser each time, until all blocks are around the origin.
    while (!add_level()) {
    }
    std::uint32_t node = 1;  // 0 is infinity
    for (Level& level : levels_) {
      level.node = node;
      node += std::uint32_t(level.components.size());
    }
    sets_ = DisjointSets(node);
    // Joining is for one thread; the sets do not depend on the order.
    for (std::size_t l = 0; l < levels_.size(); ++l) connect(l);
  }

  Level& finest() { return levels_[0]; }
  /// The node that stands for the region of a component of the finest level.
  std::uint32_t root(std::uint32_t component) { return sets_.find(levels_[0].node + component); }

 private:
  /// Adds the level above the coarsest one. True when it has only the eight blocks around zero, so that there
  /// is nothing beyond but infinity.
  bool add_level() {
    const BlockTable& below = *tables_.back();
    std::vector<BlockSet> set(1);
    bool last = true;
    for (const BlockTable::Tile& tile : below.tiles()) {
      set[0].insert(tile.at);
      for (const std::int32_t c : tile.at) last = last && (c == 0 || c == -1);
    }
    own_.push_back(std::make_unique<BlockTable>(set));
    tables_.push_back(own_.back().get());
    Level& level = levels_.emplace_back();
    level.blocks = tables_.back()->blocks();
    find_components(level, context_, [&](std::size_t i, std::vector<BlockMask>& out) {
      // A bit of a tile is a block of the level below, so that the others are empty cells.
      BlockMask free = below.tiles()[below.find_tile(level.blocks[i])].mask;
      for (std::uint64_t& word : free) word = ~word;
      add_components(free, steps_among(free), out);
    });
    return last;
  }

  /// Finds the node of the empty space at a cell of level l that has no block: on the first level whose block
  /// holds it.
  std::uint32_t empty_at(std::size_t l, BlockAt cell) const {
    for (; l + 1 < levels_.size(); ++l) {
      const BlockAt parent = tile_of(cell);
      const std::uint32_t block = tables_[l + 1]->find(parent);
      if (block != BlockTable::kNone) {
        const Level& level = levels_[l + 1];
        const unsigned place = place_in_tile(cell);
        for (std::uint32_t c = level.first[block]; c < level.first[block + 1]; ++c)
          if (level.components[c][place >> 6] >> (place & 63) & 1) return level.node + c;
      }
      cell = parent;
    }
    return Regions::kOutside;
  }

  /// Joins the components of a level's blocks to what is across their faces: blocks of the level, or empty
  /// space.
  void connect(std::size_t l) {
    const Level& level = levels_[l];
    BlockFinder finder(*tables_[l]);
    for (std::uint32_t i = 0; i < level.blocks.size(); ++i) {
      if (i % 1024 == 0) context_.check();
      for (int axis = 0; axis < 3; ++axis)
        for (int side = 0; side < 2; ++side) {
          BlockAt at = level.blocks[i];
          at[std::size_t(axis)] += side ? 1 : -1;
          const std::uint32_t j = finder.find(at);
          if (j == BlockTable::kNone) connect_to_empty(l, i, axis, side, empty_at(l, at));
          // Two blocks are joined once, from the lower one, which owns the edges between them.
          else if (side == 1)
            connect_blocks(l, i, j, axis);
        }
    }
  }

  /// Joins the components that have a cell on that side of a block to the empty space beyond.
  void connect_to_empty(std::size_t l, std::uint32_t block, int axis, int side, std::uint32_t node) {
    const Level& level = levels_[l];
    for (std::uint32_t c = level.first[block]; c < level.first[block + 1]; ++c)
      if (face(level.components[c], axis, side)) sets_.join(level.node + c, node);
  }

  void connect_blocks(std::size_t l, std::uint32_t lower, std::uint32_t upper, int axis) {
    const Level& level = levels_[l];
    std::uint64_t open = ~0ull;
    // Only voxels have triangles between them; empty cells that touch are one space.
    if (l == 0) {
      BlockMask bits;
      for (std::size_t x = 0; x < 8; ++x) bits[x] = crossed_[lower].word[axis][x];
      open = ~face(bits, axis, 1);
    }
    for (std::uint32_t a = level.first[lower]; a < level.first[lower + 1]; ++a) {
      const std::uint64_t side = face(level.components[a], axis, 1) & open;
      if (!side) continue;
      for (std::uint32_t b = level.first[upper]; b < level.first[upper + 1]; ++b)
        if (side & face(level.components[b], axis, 0)) sets_.join(level.node + a, level.node + b);
    }
  }

  const std::vector<kernels::EdgeBits>& crossed_;
  const RunContext& context_;
  std::vector<const BlockTable*> tables_;  ///< tables_[l] numbers the blocks of level l
  std::vector<std::unique_ptr<BlockTable>> own_;
  std::vector<Level> levels_;
  DisjointSets sets_;
};

}  // namespace

std::uint64_t face(const BlockMask& bits, int axis, int side) {
  if (axis == 0) return bits[side ? 7 : 0];
  std::uint64_t result = 0;
  for (std::size_t x = 0; x < 8; ++x) {
    if (axis == 1) {
      result |= (bits[x] >> (side ? 56 : 0) & 255u) << (8 * x);
    } else {
      const std::uint64_t column = bits[x] >> (side ? 7 : 0) & kFirstZ;
      // The product gathers the eight bits of a column, one in each byte, in its top byte.
      result |= (column * 0x0102040810204080ull >> 56) << (8 * x);
    }
  }
  return result;
}

BlockMask differs_from_upper(const BlockMask& bits, const BlockMask& upper, int axis) {
  BlockMask result;
  for (std::size_t x = 0; x < 8; ++x) {
    std::uint64_t next;
    if (axis == 0)
      next = x < 7 ? bits[x + 1] : upper[0];
    else if (axis == 1)
      next = bits[x] >> 8 | upper[x] << 56;
    else
      next = (bits[x] >> 1 & kBelowTopZ) | (upper[x] & kFirstZ) << 7;
    result[x] = bits[x] ^ next;
  }
  return result;
}

Regions find_regions(const BlockTable& table, const std::vector<kernels::EdgeBits>& crossed,
                     const RunContext& context) {
  Regions regions;
  if (table.size() == 0) return regions;
  Hierarchy hierarchy(table, crossed, context);
  Level& finest = hierarchy.finest();
  regions.first = finest.first;
  regions.components.resize(finest.components.size());
  // Regions get their numbers in the order of their first component, whatever node is the root of their set.
  // Node 0, infinity, is the root of its own.
  std::vector<std::uint32_t> number_of_root;
  regions.count = 1;
  for (std::uint32_t c = 0; c < finest.components.size(); ++c) {
    const std::uint32_t root = hierarchy.root(c);
    if (root >= number_of_root.size()) number_of_root.resize(root + 1, 0);
    if (root != Regions::kOutside && number_of_root[root] == 0) number_of_root[root] = regions.count++;
    regions.components[c] = {finest.components[c], number_of_root[root]};
  }
  return regions;
}

}  // namespace hermesh
