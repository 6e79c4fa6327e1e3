#include "algorithms/fracture/labelled_solid.h"

#include <tbb/parallel_sort.h>

#include <algorithm>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using Lower = std::array<std::int32_t, 3>;
using ViewBlock = HermiteView::Block;

/// The first samples of all blocks with an inside sample: of leaves, and of blocks without a leaf between two
/// leaves of a column along z, which are inside if the leaf below leaves that sign behind (SparseHermite).
std::vector<Lower> blocks_with_samples(const FloatHermite& hermite) {
  std::vector<Lower> result;
  for (std::size_t i = 0; i < hermite.leaves.size(); ++i) {
    const SignLeaf& leaf = hermite.leaves[i];
    if (any(leaf.inside)) result.push_back(leaf.lower);
    if (!(leaf.beyond[2] & 1)) continue;
    const bool last = i + 1 == hermite.leaves.size() || hermite.leaves[i + 1].lower[0] != leaf.lower[0] ||
                      hermite.leaves[i + 1].lower[1] != leaf.lower[1];
    // Nothing is inside above the last leaf of a column, for the solid has an end.
    if (last) continue;
    // Where the layer beyond is mixed, the block above has a crossing edge: it is the next leaf, and no block
    // lies between the two. Otherwise one bit of the layer gives the sign of all samples.
    for (std::int32_t z = leaf.lower[2] + 8; z < hermite.leaves[i + 1].lower[2]; z += 8)
      result.push_back({leaf.lower[0], leaf.lower[1], z});
  }
  return result;
}

/// The codes of one block as numbers in a list of those that occur in it.
struct BlockCodes {
  std::vector<CutCode> values;
  LabelField::Values numbers{};  ///< 0 outside, else 1 + index in `values`
};

/// Queries the cutters for one block. Only codes of inside samples are stored, because outside samples belong
/// to no piece.
BlockCodes codes_of_block(const ViewBlock& block, const Cutters& cutters) {
  std::array<CutCode, 512> codes;
  cutters.codes(block.lower, codes);
  BlockCodes result;
  for_each_bit(block.inside, [&](int i) { result.values.push_back(codes[static_cast<std::size_t>(i)]); });
  std::sort(result.values.begin(), result.values.end());
  result.values.erase(std::unique(result.values.begin(), result.values.end()), result.values.end());
  for_each_bit(block.inside, [&](int i) {
    const auto at =
        std::lower_bound(result.values.begin(), result.values.end(), codes[static_cast<std::size_t>(i)]);
    result.numbers[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(at - result.values.begin()) + 1;
  });
  return result;
}

}  // namespace

std::vector<Lower> with_those_below(const std::vector<Lower>& blocks) {
  std::vector<Lower> all;
  all.reserve(8 * blocks.size());
  for (const Lower& b : blocks)
    for (int down = 0; down < 8; ++down)
      all.push_back({b[0] - 8 * (down & 1), b[1] - 8 * ((down >> 1) & 1), b[2] - 8 * (down >> 2)});
  // Equal entries are indistinguishable, so an unstable sort gives the same list at any thread count.
  tbb::parallel_sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

void LabelField::assign(std::int32_t block, const Values& values) {
  const auto b = static_cast<std::size_t>(block);
  // A block of one value needs no array: `set` may leave it one, `assign` never does.
  const bool uniform =
      std::all_of(values.begin(), values.end(), [&](std::uint32_t v) { return v == values[0]; });
  uniform_[b] = values[0];
  if (uniform)
    values_[b].reset();
  else if (values_[b])
    *values_[b] = values;
  else
    values_[b] = std::make_unique<Values>(values);
}

void LabelField::set(std::int32_t block, int sample, std::uint32_t value) {
  const auto b = static_cast<std::size_t>(block);
  if (!values_[b]) {
    if (uniform_[b] == value) return;
    values_[b] = std::make_unique<Values>();
    values_[b]->fill(uniform_[b]);
  }
  (*values_[b])[static_cast<std::size_t>(sample)] = value;
}

std::size_t LabelField::memory_bytes() const {
  std::size_t bytes = uniform_.capacity() * (sizeof(std::uint32_t) + sizeof(void*));
  for (const auto& values : values_) bytes += values ? sizeof(Values) : 0;
  return bytes;
}

bool gather_labels(const LabelledSolid& solid, const LabelField& field, std::int32_t block, LabelCube& cube) {
  const auto& neighbours = solid.blocks[static_cast<std::size_t>(block)].neighbours;
  std::array<std::int32_t, 8> from;
  // A missing neighbour is outside, label 0. With one label all around no edge that begins in the block is
  // crossed, and the 729 labels need not be copied: so it is with most blocks of a solid.
  bool mixed = !field.is_uniform(block);
  const std::uint32_t own = field(block, 0);
  for (int up = 0; up < 8; ++up) {
    from[up] = neighbours[neighbour_slot(up & 1, (up >> 1) & 1, up >> 2)];
    mixed = mixed || (from[up] < 0 ? own != 0 : !field.is_uniform(from[up]) || field(from[up], 0) != own);
  }
  if (!mixed) return false;
  for (int x = 0; x < 9; ++x)
    for (int y = 0; y < 9; ++y)
      for (int z = 0; z < 9; ++z) {
        const std::int32_t there = from[(x >> 3) | (y >> 3) << 1 | (z >> 3) << 2];
        cube[static_cast<std::size_t>(81 * x + 9 * y + z)] =
            there < 0 ? 0 : field(there, sample_index(x & 7, y & 7, z & 7));
      }
  return true;
}

CornerLabels labels_in(const LabelCube& cube, int cell) {
  const int at = 81 * (cell >> 6) + 9 * ((cell >> 3) & 7) + (cell & 7);
  CornerLabels labels;
  for (int c = 0; c < 8; ++c)
    labels[c] = cube[static_cast<std::size_t>(at + 81 * (c & 1) + 9 * ((c >> 1) & 1) + (c >> 2))];
  return labels;
}

LabelledSolid whole_solid(const FloatHermite& hermite, RunContext& context) {
  const Stage stage(context, "blocks of the solid");
  if (hermite.outermost_inside) throw Error("the solid has no end: everything far away is inside");
  LabelledSolid solid;
  solid.placement = hermite.placement;
  const std::vector<Lower> lowers = with_those_below(blocks_with_samples(hermite));
  solid.blocks.resize(lowers.size());
  solid.labels = LabelField(lowers.size());
  solid.codes = LabelField(lowers.size());
  // Each thread fills in whole blocks, and counts are summed after it.
  std::vector<std::uint64_t> samples(lowers.size());
  parallel_blocks(lowers.size(), context, [&](std::size_t b) {
    ViewBlock& block = solid.blocks[b];
    block = {};
    block.lower = lowers[b];
    const SignLeaf* leaf = hermite.find(lowers[b]);
    block.leaf = leaf ? static_cast<std::int32_t>(leaf - hermite.leaves.data()) : -1;
    if (leaf)
      block.inside = leaf->inside;
    else if (hermite.sign_without_leaf(lowers[b]))
      block.inside = kAllInside;
    samples[b] = static_cast<std::uint64_t>(count(block.inside));
    LabelField::Values values{};
    // All samples have one piece and one code until label_by_codes() assigns others.
    for_each_bit(block.inside, [&](int i) { values[static_cast<std::size_t>(i)] = 1; });
    solid.labels.assign(static_cast<std::int32_t>(b), values);
    solid.codes.assign(static_cast<std::int32_t>(b), values);
  });
  for (const std::uint64_t n : samples) solid.samples += n;
  find_neighbours(solid.blocks, context);
  // Code 1 belongs to the only piece; its value is not used yet.
  solid.code_values = {0};
  solid.code_of = {0, 1};
  return solid;
}

void label_by_codes(LabelledSolid& solid, const Cutters& cutters, RunContext& context) {
  const Stage stage(context, "label samples");
  const std::size_t n = solid.blocks.size();
  // First every block numbers its own codes, for the list of all is known only when all blocks are done;
  // codes are sparse (patterns of up to 64 planes), so they cannot be indices themselves.
  std::vector<std::vector<CutCode>> values(n);
  parallel_blocks(n, context, [&](std::size_t b) {
    BlockCodes codes = codes_of_block(solid.blocks[b], cutters);
    solid.codes.assign(static_cast<std::int32_t>(b), codes.numbers);
    values[b] = std::move(codes.values);
  });
  solid.code_values.clear();
  for (const auto& list : values) {
    solid.code_values.insert(solid.code_values.end(), list.begin(), list.end());
    // Blocks repeat each other's codes: to drop doubles every million bounds the memory.
    if (solid.code_values.size() < 1'000'000 && &list != &values.back()) continue;
    std::sort(solid.code_values.begin(), solid.code_values.end());
    solid.code_values.erase(std::unique(solid.code_values.begin(), solid.code_values.end()),
                            solid.code_values.end());
  }
  // Then convert a block's numbers to indices into the ascending list of all, which is independent of the
  // thread schedule.
  parallel_blocks(n, context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    // `codes` holds the block's own numbers here, and those of the whole list from here on.
    std::vector<std::uint32_t> number(values[b].size() + 1);
    for (std::size_t i = 0; i < values[b].size(); ++i)
      number[i + 1] = static_cast<std::uint32_t>(
          std::lower_bound(solid.code_values.begin(), solid.code_values.end(), values[b][i]) -
          solid.code_values.begin() + 1);
    LabelField::Values global;
    for (int i = 0; i < 512; ++i) global[static_cast<std::size_t>(i)] = number[solid.codes(block, i)];
    solid.codes.assign(block, global);
    solid.labels.assign(block, global);
  });
  solid.code_of.resize(solid.code_values.size() + 1);
  for (std::size_t i = 0; i < solid.code_of.size(); ++i) solid.code_of[i] = static_cast<std::uint32_t>(i);
}

}  // namespace hermesh
