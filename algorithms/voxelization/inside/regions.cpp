#include "algorithms/voxelization/inside/regions.h"

#include <tbb/parallel_for.h>

#include <deque>
#include <functional>
#include <numeric>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

/// The voxels of a block from which a step leads to the upper neighbour within the block, by axis.
using Steps = std::array<BlockMask, 3>;

/// Returns the steps between voxels that no triangle separates.
Steps steps_between(const kernels::EdgeBits& crossed) {
  Steps steps;
  for (int axis = 0; axis < 3; ++axis)
    steps[std::size_t(axis)] =
        ~std::to_array(crossed.word[axis]) & upper_neighbours(kAllInside, kAllOutside, axis);
  return steps;
}

/// Returns the steps between neighbours both of which are in `free`: cells without a block on a coarse level.
Steps steps_among(const BlockMask& free) {
  Steps steps;
  for (int axis = 0; axis < 3; ++axis)
    steps[std::size_t(axis)] = free & upper_neighbours(free, kAllOutside, axis);
  return steps;
}

/// Spreads the bits of one layer along its steps, in both directions, until nothing is added.
std::uint64_t spread_in_word(std::uint64_t m, std::uint64_t up_y, std::uint64_t up_z) {
  std::uint64_t before;
  do {
    before = m;
    m |= (m & up_z) << 1 | (m >> 1 & up_z);
    m |= (m & up_y) << 8 | (m >> 8 & up_y);
  } while (m != before);
  return m;
}

/// Returns the voxels of `free`, which has some, that can be reached from its first one.
BlockMask reach_from_first(const BlockMask& free, const Steps& steps) {
  BlockMask reached{};
  const std::size_t first = std::size_t(std::ranges::find_if(free, std::identity()) - free.begin());
  reached[first] = free[first] & -free[first];
  bool changed = true;
  // Takes over from both neighbouring layers, then spreads within the layer.
  const auto visit = [&](std::size_t x) {
    std::uint64_t m = reached[x];
    if (x > 0) m |= reached[x - 1] & steps[0][x - 1];
    if (x < 7) m |= reached[x + 1] & steps[0][x];
    if (m == 0) return;
    m = spread_in_word(m, steps[1][x], steps[2][x]);
    changed |= m != reached[x];
    reached[x] = m;
  };
  while (changed) {
    changed = false;
    for (std::size_t x = 0; x < 8; ++x) visit(x);
    for (std::size_t x = 8; x-- > 0;) visit(x);
  }
  return reached;
}

/// Appends the connected sets of `free` in the order of their first voxels.
void add_components(BlockMask free, const Steps& steps, std::vector<BlockMask>& components) {
  while (any(free)) {
    components.push_back(reach_from_first(free, steps));
    free = free & ~components.back();
  }
}

/// A level of blocks of 8³ cells. On the finest level the cells are voxels; above, they are the blocks of the
/// level below, and the components are those of the cells without a block.
struct Level {
  const BlockTable* table;
  std::vector<BlockAt> blocks;
  std::vector<std::uint32_t> first = {};  ///< component of each block
  std::vector<BlockMask> components = {};
  std::uint32_t node = 0;  ///< number of the first component's node
};

/// Fills in a level's components: components_of(i, list) appends those of block i. Chunks of a fixed size are
/// joined in their order, so that the numbers are the same at any thread count.
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
  std::partial_sum(level.first.begin(), level.first.end(), level.first.begin());
  level.components.reserve(level.first[n]);
  for (std::vector<BlockMask>& chunk : found) {
    level.components.insert(level.components.end(), chunk.begin(), chunk.end());
    chunk = {};
  }
}

/// All levels, and a set of disjoint regions over their components. Empty space is a component of the
/// coarsest kind of cell that it fills, so that the cost grows with the surface and not with the volume.
class Hierarchy {
 public:
  Hierarchy(const BlockTable& table, const std::vector<kernels::EdgeBits>& crossed, const RunContext& context)
      : crossed_(crossed), context_(context) {
    levels_.push_back({.table = &table, .blocks = table.blocks()});
    find_components(levels_[0], context, [&](std::size_t i, std::vector<BlockMask>& out) {
      add_components(kAllInside, steps_between(crossed[i]), out);
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
    // One thread joins them; the sets do not depend on the order.
    for (std::size_t l = 0; l < levels_.size(); ++l) connect(l);
  }

  const Level& finest() const { return levels_[0]; }
  /// Returns the node that represents the region of a component of the finest level.
  std::uint32_t root(std::uint32_t component) { return sets_.find(levels_[0].node + component); }

 private:
  /// Adds the level above the coarsest one. Returns true if it has only the eight blocks around zero, so only
  /// infinity is beyond.
  bool add_level() {
    const BlockTable& below = *levels_.back().table;
    std::vector<BlockSet> set(1);
    bool last = true;
    for (const BlockTable::Tile& tile : below.tiles()) {
      set[0].insert(tile.at);
      for (const std::int32_t c : tile.at) last = last && (c == 0 || c == -1);
    }
    const BlockTable& table = own_.emplace_back(set);
    Level& level = levels_.emplace_back(Level{.table = &table, .blocks = table.blocks()});
    find_components(level, context_, [&](std::size_t i, std::vector<BlockMask>& out) {
      // A bit of a tile is a block of the level below; the other cells are empty.
      const BlockMask free = ~below.tiles()[below.find_tile(level.blocks[i])].mask;
      add_components(free, steps_among(free), out);
    });
    return last;
  }

  /// Returns the node of the empty space at a cell of level l without a block: on the first level whose block
  /// holds it.
  std::uint32_t empty_at(std::size_t l, BlockAt cell) const {
    for (; l + 1 < levels_.size(); ++l) {
      const BlockAt parent = tile_of(cell);
      const Level& level = levels_[l + 1];
      const std::uint32_t block = level.table->find(parent);
      if (block != BlockTable::kNone)
        for (std::uint32_t c = level.first[block]; c < level.first[block + 1]; ++c)
          if (test(level.components[c], int(place_in_tile(cell)))) return level.node + c;
      cell = parent;
    }
    return Regions::kOutside;
  }

  /// Joins the components of a level's blocks to the blocks, or the empty space, across their faces.
  void connect(std::size_t l) {
    const Level& level = levels_[l];
    BlockFinder finder(*level.table);
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
    // Only voxels have triangles between them; empty cells that touch are one space.
    const std::uint64_t open = l == 0 ? ~face(std::to_array(crossed_[lower].word[axis]), axis, 1) : ~0ull;
    for (std::uint32_t a = level.first[lower]; a < level.first[lower + 1]; ++a) {
      const std::uint64_t side = face(level.components[a], axis, 1) & open;
      if (!side) continue;
      for (std::uint32_t b = level.first[upper]; b < level.first[upper + 1]; ++b)
        if (side & face(level.components[b], axis, 0)) sets_.join(level.node + a, level.node + b);
    }
  }

  const std::vector<kernels::EdgeBits>& crossed_;
  const RunContext& context_;
  std::deque<BlockTable> own_;  ///< tables of all levels except the finest
  std::vector<Level> levels_;
  DisjointSets sets_;
};

}  // namespace

BlockMask box_bits(const BlockAt& block, const Voxel& from, const Voxel& to) {
  std::int32_t first[3], last[3];
  for (std::size_t a = 0; a < 3; ++a) {
    first[a] = std::max(from[a] - 8 * block[a], 0);
    last[a] = std::min(to[a] - 8 * block[a], 7);
    if (first[a] > last[a]) return {};
  }
  const std::uint64_t row = (std::uint64_t(2) << last[2]) - (std::uint64_t(1) << first[2]);
  std::uint64_t layer = 0;
  for (std::int32_t y = first[1]; y <= last[1]; ++y) layer |= row << (8 * y);
  BlockMask bits{};
  for (std::int32_t x = first[0]; x <= last[0]; ++x) bits[std::size_t(x)] = layer;
  return bits;
}

BlockMask upper_neighbours(const BlockMask& bits, const BlockMask& upper, int axis) {
  return shifted_mask(axis == 0, axis == 1, axis == 2,
                      [&](int x, int y, int z) -> const BlockMask& { return x + y + z > 0 ? upper : bits; });
}

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

Regions find_regions(const BlockTable& table, const std::vector<kernels::EdgeBits>& crossed,
                     const RunContext& context) {
  Regions regions;
  if (table.size() == 0) return regions;
  Hierarchy hierarchy(table, crossed, context);
  const Level& finest = hierarchy.finest();
  regions.first = finest.first;
  regions.components.resize(finest.components.size());
  // Node 0, infinity, is the root of its set.
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
