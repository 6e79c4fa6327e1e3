#include "algorithms/hermite/hermite_view.h"

#include <algorithm>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using Lower = std::array<std::int32_t, 3>;

/// Returns the positions, in ascending order and each once, of the blocks without a leaf that have a cell
/// with a crossing edge.
std::vector<Lower> blocks_without_leaf(std::span<const SignLeaf> leaves, RunContext& context) {
  std::vector<std::uint8_t> missing(leaves.size());
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    // Computing the crossing edges again for the blocks is faster than storing them.
    const unsigned wanted = blocks_below(crossing_edges(leaves[i]));
    for (int down = 1; down < 7; ++down)
      // A lower block precedes this one, so only the leaves before it are searched.
      if (wanted >> down & 1 &&
          !std::ranges::binary_search(leaves.first(i), block_below(leaves[i].lower, down), {},
                                      &SignLeaf::lower))
        missing[i] = static_cast<std::uint8_t>(missing[i] | 1u << down);
  });
  std::vector<Lower> found;
  for (std::size_t i = 0; i < leaves.size(); ++i)
    for (int down = 1; down < 7; ++down)
      if (missing[i] >> down & 1) found.push_back(block_below(leaves[i].lower, down));
  std::ranges::sort(found);
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

/// Returns the sign of an added block, which has no leaf and owns no crossing edge. All of its samples have
/// one sign, as have the missing blocks up to the nearest owner above: no edge between them is crossed.
bool sign_of_added(const HermiteView::Blocks& blocks, const HermiteView::Block& block) {
  for (int d = 1; d < 8; ++d) {
    const std::int32_t there = block.neighbours[neighbour_slot(d & 1, (d >> 1) & 1, d >> 2)];
    if (there >= 0 && blocks[there].leaf >= 0) return (blocks[there].inside[0] & 1) != 0;
  }
  return false;
}

/// Blocks of one x and y, which are consecutive.
struct Column {
  std::array<std::int32_t, 2> lower;
  std::size_t first;
};

}  // namespace

unsigned blocks_below(const std::array<BlockMask, 3>& edges) {
  // Returns true if an edge along `axis` starts in the first layers along the axes whose bits are set in
  // `down`.
  const auto touches = [&](int axis, int down) {
    const std::uint64_t bits = first_layers(down & 2, down & 4);
    for (int x = 0; x < (down & 1 ? 1 : 8); ++x)
      if (edges[axis][x] & bits) return true;
    return false;
  };
  unsigned wanted = 0;
  for (int down = 1; down < 7; ++down)
    for (int axis = 0; axis < 3; ++axis)
      if (!((down >> axis) & 1) && touches(axis, down)) wanted |= 1u << down;
  return wanted;
}

std::array<std::int32_t, 3> block_below(const std::array<std::int32_t, 3>& lower, int down) {
  return {lower[0] - 8 * (down & 1), lower[1] - 8 * ((down >> 1) & 1), lower[2] - 8 * (down >> 2)};
}

void find_neighbours(HermiteView::Blocks& blocks, RunContext& context) {
  // Column by column: each block's three neighbours in an adjacent one follow those of the previous block.
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
      const auto there =
          std::lower_bound(columns.begin(), columns.end() - 1, wanted,
                           [](const Column& column, const auto& lower) { return column.lower < lower; });
      const bool found = there != columns.end() - 1 && there->lower == wanted;
      std::size_t next = found ? there->first : 0;
      const std::size_t end = found ? (there + 1)->first : 0;
      for (std::size_t i = columns[c].first; i < columns[c + 1].first; ++i) {
        const std::int32_t z = blocks[i].lower[2];
        // Both columns ascend, so one sweep over them finds all neighbors in linear time.
        while (next < end && blocks[next].lower[2] < z - 8) ++next;
        for (std::size_t slot = 0, at = next; slot < 3; ++slot) {
          const bool hit = at < end && blocks[at].lower[2] == z + 8 * (static_cast<int>(slot) - 1);
          blocks[i].neighbours[3 * static_cast<std::size_t>(beside) + slot] =
              hit ? static_cast<std::int32_t>(at++) : -1;
        }
      }
    }
  });
}

HermiteView::HermiteView(std::span<const SignLeaf> leaves, const IndexToWorld& placement, RunContext& context)
    : placement_(placement) {
  const std::vector<Lower> added = blocks_without_leaf(leaves, context);
  std::vector<std::size_t> leaves_before;  // by added block
  for (const Lower& lower : added) {
    const auto at = std::ranges::lower_bound(leaves, lower, {}, &SignLeaf::lower);
    leaves_before.push_back(static_cast<std::size_t>(at - leaves.begin()));
  }
  blocks_.resize(leaves.size() + added.size());
  parallel_blocks(leaves.size(), context, [&](std::size_t i) {
    // Leaves and added blocks are merged in order.
    const auto added_before = std::ranges::upper_bound(leaves_before, i) - leaves_before.begin();
    Block& block = blocks_[i + static_cast<std::size_t>(added_before)];
    block.lower = leaves[i].lower;
    block.leaf = static_cast<std::int32_t>(i);
    block.inside = leaves[i].inside;
    block.crossing = crossing_edges(leaves[i]);
    block.count_before();
  });
  for (std::size_t i = 0; i < added.size(); ++i) {
    Block& block = blocks_[leaves_before[i] + i];
    block = {};
    block.lower = added[i];
    block.leaf = -1;
  }
  find_neighbours(blocks_, context);
  // Only signs of leaves are read here, which no thread writes.
  parallel_blocks(added.size(), context, [&](std::size_t i) {
    Block& block = blocks_[leaves_before[i] + i];
    if (sign_of_added(blocks_, block)) block.inside = kAllInside;
  });
}

BlockMask cells_with_crossings(const HermiteView::Blocks& blocks, std::size_t block) {
  return cells_with_edges(
      blocks, block, [&](std::int32_t there) -> const auto& { return blocks[there].crossing; });
}

}  // namespace hermesh
