#include "algorithms/hermite/hermite_view.h"

#include <algorithm>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using Lower = std::array<std::int32_t, 3>;

/// Blocks below `leaf` that hold a cell with one of its crossing edges: the cells around an edge begin at its own
/// sample and one step down each axis that is not the edge's.
void blocks_below(const SignLeaf& leaf, const std::array<BlockMask, 3>& edges, std::vector<Lower>& found) {
  constexpr std::uint64_t kFirstY = 0xff, kFirstZ = 0x0101010101010101u;
  // Whether an edge along `axis` starts in the first layers along the axes whose bits are set in `down`.
  const auto touches = [&](int axis, int down) {
    const std::uint64_t bits = (down & 2 ? kFirstY : ~std::uint64_t{0}) & (down & 4 ? kFirstZ : ~std::uint64_t{0});
    for (int x = 0; x < (down & 1 ? 1 : 8); ++x)
      if (edges[axis][x] & bits) return true;
    return false;
  };
  for (int down = 1; down < 7; ++down) {
    bool wanted = false;
    for (int axis = 0; axis < 3; ++axis)
      if (!((down >> axis) & 1)) wanted = wanted || touches(axis, down);
    if (wanted)
      found.push_back({leaf.lower[0] - 8 * (down & 1), leaf.lower[1] - 8 * ((down >> 1) & 1),
                       leaf.lower[2] - 8 * (down >> 2)});
  }
}

/// Blocks of one x and y, which follow one another.
struct Column {
  std::array<std::int32_t, 2> lower;
  std::size_t first;
};

/// Column by column, each block's three neighbours in an adjacent column lie behind those of the block before it: no search.
void find_neighbours(std::vector<HermiteView::Block>& blocks, RunContext& context) {
  std::vector<Column> columns;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    const std::array<std::int32_t, 2> lower{blocks[i].lower[0], blocks[i].lower[1]};
    if (columns.empty() || columns.back().lower != lower) columns.push_back({lower, i});
  }
  columns.push_back({{}, blocks.size()});
  parallel_blocks(columns.size() - 1, context, [&](std::size_t c) {
    for (int beside = 0; beside < 9; ++beside) {
      const std::array<std::int32_t, 2> wanted{columns[c].lower[0] + 8 * (beside / 3 - 1),
                                               columns[c].lower[1] + 8 * (beside % 3 - 1)};
      const auto there = std::lower_bound(columns.begin(), columns.end() - 1, wanted,
                                          [](const Column& column, const auto& lower) { return column.lower < lower; });
      const bool found = there != columns.end() - 1 && there->lower == wanted;
      std::size_t next = found ? there->first : 0;
      const std::size_t end = found ? (there + 1)->first : 0;
      for (std::size_t i = columns[c].first; i < columns[c + 1].first; ++i) {
        const std::int32_t z = blocks[i].lower[2];
        while (next < end && blocks[next].lower[2] < z - 8) ++next;
        for (std::size_t slot = 0, at = next; slot < 3; ++slot) {
          const bool hit = at < end && blocks[at].lower[2] == z + 8 * (static_cast<int>(slot) - 1);
          blocks[i].neighbours[3 * static_cast<std::size_t>(beside) + slot] = hit ? static_cast<std::int32_t>(at++) : -1;
        }
      }
    }
  });
}

}  // namespace

HermiteView::HermiteView(std::span<const SignLeaf> leaves, const IndexToWorld& placement, RunContext& context)
    : placement_(placement) {
  std::vector<std::vector<Lower>> below(leaves.size());
  blocks_.resize(leaves.size());
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    Block& block = blocks_[i];
    block.lower = leaves[i].lower;
    block.leaf = static_cast<std::int32_t>(i);
    block.inside = leaves[i].inside;
    block.crossing = crossing_edges(leaves[i]);
    block.count_before();
    blocks_below(leaves[i], block.crossing, below[i]);
  });
  std::vector<Lower> added;
  const auto find = [&](std::span<const Block> among, const Lower& lower) {
    const auto at = std::lower_bound(among.begin(), among.end(), lower,
                                     [](const Block& block, const Lower& wanted) { return block.lower < wanted; });
    return at != among.end() && at->lower == lower ? static_cast<std::int32_t>(at - among.begin()) : -1;
  };
  for (const auto& list : below)
    for (const Lower& lower : list)
      if (find(blocks_, lower) < 0) added.push_back(lower);
  std::sort(added.begin(), added.end());
  added.erase(std::unique(added.begin(), added.end()), added.end());

  // The signs of an added block are those of no crossing edge; extraction reads them of owners only.
  std::vector<Block> merged;
  merged.reserve(blocks_.size() + added.size());
  auto next = blocks_.begin();
  for (const Lower& lower : added) {
    while (next != blocks_.end() && next->lower < lower) merged.push_back(*next++);
    merged.emplace_back();
    merged.back().lower = lower;
  }
  merged.insert(merged.end(), next, blocks_.end());
  blocks_ = std::move(merged);
  find_neighbours(blocks_, context);
}

}  // namespace hermesh
