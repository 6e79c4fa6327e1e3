#include "algorithms/thesis/adaptive_dual_contouring/edge_source.h"

#include <algorithm>
#include <atomic>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/thesis/voxels/dense_tree.h"
#include "algorithms/thesis/voxels/voxels.h"

namespace hermesh {
namespace {

using Lower = std::array<std::int32_t, 3>;
using Leaf = ThesisDenseTree::LeafNodeType;

Lower lower_of(const openvdb::Coord& at) { return {at.x(), at.y(), at.z()}; }
openvdb::Coord coord_of(const Lower& at) { return {at[0], at[1], at[2]}; }

/// Returns the tagged edges of a leaf, by axis.
std::array<BlockMask, 3> tagged_edges(const ThesisVoxel* voxels) {
  std::array<BlockMask, 3> tags{};
  for (int sample = 0; sample < 512; ++sample)
    for (int axis = 0; axis < 3; ++axis)
      tags[axis][sample >> 6] |= std::uint64_t{voxels[sample].crosses(axis)} << (sample & 63);
  return tags;
}

}  // namespace

std::array<SignLattice::Part, 8> SparseEdges::signs(std::int32_t number) const {
  // A missing block owns no crossing edge, so all its samples have the sign of the sample before them.
  const HermiteView::Block& block = blocks()[number];
  std::array<SignLattice::Part, 8> parts;
  std::array<std::int32_t, 8> leaf;
  for (int part = 0; part < 8; ++part) {
    const std::int32_t there = block.neighbours[neighbour_slot(part >> 2, (part >> 1) & 1, part & 1)];
    leaf[part] = there >= 0 ? blocks()[there].leaf : -1;
    if (there >= 0) {
      parts[part].inside = &blocks()[there].inside;
      continue;
    }
    // One step down from the part, along the lowest of its axes; that part precedes this one, and part 0
    // exists.
    const int before = part & (part - 1), axis = part & 1 ? 2 : part & 2 ? 1 : 0;
    parts[part].uniform = leaf[before] >= 0      ? hermite_.leaves[leaf[before]].beyond[axis] & 1
                          : parts[before].inside ? (*parts[before].inside)[0] & 1
                                                 : parts[before].uniform;
  }
  return parts;
}

void SparseEdges::read(std::int32_t number, int axis, const BlockMask& wanted, EdgeCrossing* out) const {
  const HermiteView::Block& block = blocks()[number];
  // Crossings are stored by axis and then by sample, so the wanted ones are found by counting bits.
  const EdgeCrossing* next =
      hermite_.crossings.data() + hermite_.leaves[block.leaf].first + block.before[axis][0];
  for (int x = 0; x < 8; ++x) {
    const std::uint64_t word = block.crossing[axis][x];
    if (!(word & wanted[x])) {
      next += std::popcount(word);
      continue;
    }
    for (std::uint64_t bits = word; bits != 0; bits &= bits - 1, ++next)
      if (wanted[x] >> std::countr_zero(bits) & 1) *out++ = *next;
  }
}

PackedEdges::PackedEdges(ThesisDense hermite, RunContext& context) : hermite_(std::move(hermite)) {
  // Blocks ascend by their positions.
  std::vector<const Leaf*> leaves;
  hermite_.grid->tree().getNodes(leaves);
  std::ranges::sort(leaves, {}, [](const Leaf* leaf) { return lower_of(leaf->origin()); });
  // Every leaf is a block, with or without a tagged edge, so that missing blocks have one sign.
  std::vector<Lower> places, around;
  for (const Leaf* leaf : leaves) {
    places.push_back(lower_of(leaf->origin()));
    const unsigned wanted = blocks_below(tagged_edges(leaf->buffer().data()));
    for (int down = 1; down < 7; ++down)
      if (wanted >> down & 1) around.push_back(block_below(places.back(), down));
  }
  places.insert(places.end(), around.begin(), around.end());
  std::ranges::sort(places);
  places.erase(std::unique(places.begin(), places.end()), places.end());
  blocks_.resize(places.size());
  voxels_.resize(places.size());
  parallel_blocks(places.size(), context, [&](std::size_t b) {
    HermiteView::Block& block = blocks_[b];
    block = {};
    block.lower = places[b];
    const auto at = std::ranges::lower_bound(leaves, block.lower, {},
                                             [](const Leaf* leaf) { return lower_of(leaf->origin()); });
    const bool found = at != leaves.end() && lower_of((*at)->origin()) == block.lower;
    block.leaf = found ? static_cast<std::int32_t>(at - leaves.begin()) : -1;
    voxels_[b] = found ? (*at)->buffer().data() : nullptr;
    if (!found) {
      // Without tagged edges and of one sign.
      block.inside = sign_without_block(block.lower) ? kAllInside : kAllOutside;
      return;
    }
    for (int sample = 0; sample < 512; ++sample)
      block.inside[sample >> 6] |= std::uint64_t{voxels_[b][sample].inside()} << (sample & 63);
    block.crossing = tagged_edges(voxels_[b]);
    block.count_before();
  });
  find_neighbours(blocks_, context);
  count_edges(context);
}

bool PackedEdges::sign_without_block(const Lower& lower) const {
  // A tile or the background.
  return hermite_.grid->tree().getValue(coord_of(lower)).inside();
}

std::array<SignLattice::Part, 8> PackedEdges::signs(std::int32_t number) const {
  const HermiteView::Block& block = blocks_[number];
  std::array<SignLattice::Part, 8> parts;
  for (int part = 0; part < 8; ++part) {
    const int d[3] = {part >> 2, (part >> 1) & 1, part & 1};
    const std::int32_t there = block.neighbours[neighbour_slot(d[0], d[1], d[2])];
    if (there >= 0)
      parts[part].inside = &blocks_[there].inside;
    else
      parts[part].uniform = sign_without_block(
          {block.lower[0] + 8 * d[0], block.lower[1] + 8 * d[1], block.lower[2] + 8 * d[2]});
  }
  return parts;
}

void PackedEdges::read(std::int32_t number, int axis, const BlockMask& wanted, EdgeCrossing* out) const {
  for_each_bit(wanted, [&](int sample) { *out++ = voxels_[number][sample].get(axis); });
}

void PackedEdges::count_edges(RunContext& context) {
  std::atomic<std::size_t> tagged = 0, lost = 0, needless = 0;
  parallel_blocks(blocks_.size(), context, [&](std::size_t b) {
    const HermiteView::Block& block = blocks_[b];
    const std::array<SignLattice::Part, 8> parts = signs(static_cast<std::int32_t>(b));
    // A leaf of SparseHermite determines which edges change their sign.
    SignLeaf leaf{block.lower, 0, block.inside, {}};
    constexpr int kPart[3] = {4, 2, 1};  // the neighbour one block up the axis
    for (int axis = 0; axis < 3; ++axis) {
      const SignLattice::Part& next = parts[kPart[axis]];
      leaf.beyond[axis] = next.inside    ? first_layer(*next.inside, axis)
                          : next.uniform ? ~std::uint64_t{0}
                                         : 0;
    }
    const std::array<BlockMask, 3> changing = crossing_edges(leaf);
    std::size_t all = 0, missing = 0, more = 0;
    for (int axis = 0; axis < 3; ++axis)
      for (int x = 0; x < 8; ++x) {
        const std::uint64_t change = changing[axis][x], tags = block.crossing[axis][x];
        all += static_cast<std::size_t>(std::popcount(tags));
        missing += static_cast<std::size_t>(std::popcount(change & ~tags));
        more += static_cast<std::size_t>(std::popcount(tags & ~change));
      }
    tagged += all, lost += missing, needless += more;
  });
  tagged_ = tagged, lost_ = lost, needless_ = needless;
}

}  // namespace hermesh
