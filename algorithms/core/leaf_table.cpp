#include "algorithms/core/leaf_table.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/core/simd_level.h"

namespace hermesh {
namespace {

using openvdb::Coord;
using Accessor = openvdb::tree::ValueAccessor<const openvdb::FloatTree>;

/// Signs of a leaf's 512 samples; returns false if one of them is not finite. Many at a time, because one after the other
/// they would take longer than it takes to read them. A comparison of magnitudes as whole numbers finds what is no number.
using ReadSigns = bool(const float* values, const InsideRule& rule, BlockMask& inside);

#if defined(__x86_64__)
constexpr std::int32_t kMagnitude = 0x7fffffff, kLargestFinite = 0x7f7fffff;

bool read_signs_sse2(const float* values, const InsideRule& rule, BlockMask& inside) {
  const __m128 iso = _mm_set1_ps(rule.isovalue);
  const __m128i magnitude = _mm_set1_epi32(kMagnitude), largest = _mm_set1_epi32(kLargestFinite);
  __m128i bad = _mm_setzero_si128();
  for (std::size_t word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 16; ++i) {
      const __m128 v = _mm_loadu_ps(values + 64 * word + 4 * i);
      const __m128 in = rule.scale > 0 ? _mm_cmplt_ps(v, iso) : _mm_cmpgt_ps(v, iso);
      bits |= static_cast<std::uint64_t>(_mm_movemask_ps(in)) << (4 * i);
      bad = _mm_or_si128(bad, _mm_cmpgt_epi32(_mm_and_si128(_mm_castps_si128(v), magnitude), largest));
    }
    inside[word] = bits;
  }
  return _mm_movemask_epi8(bad) == 0;
}

[[gnu::target("avx2")]] bool read_signs_avx2(const float* values, const InsideRule& rule, BlockMask& inside) {
  const __m256 iso = _mm256_set1_ps(rule.isovalue);
  const __m256i magnitude = _mm256_set1_epi32(kMagnitude);
  __m256i greatest = _mm256_setzero_si256();
  for (std::size_t word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const __m256 v = _mm256_loadu_ps(values + 64 * word + 8 * i);
      const __m256 in = rule.scale > 0 ? _mm256_cmp_ps(v, iso, _CMP_LT_OQ) : _mm256_cmp_ps(v, iso, _CMP_GT_OQ);
      bits |= static_cast<std::uint64_t>(static_cast<unsigned>(_mm256_movemask_ps(in))) << (8 * i);
      greatest = _mm256_max_epi32(greatest, _mm256_and_si256(_mm256_castps_si256(v), magnitude));
    }
    inside[word] = bits;
  }
  return _mm256_movemask_epi8(_mm256_cmpgt_epi32(greatest, _mm256_set1_epi32(kLargestFinite))) == 0;
}

[[gnu::target("avx512f")]] bool read_signs_avx512(const float* values, const InsideRule& rule, BlockMask& inside) {
  const __m512 iso = _mm512_set1_ps(rule.isovalue);
  const __m512i magnitude = _mm512_set1_epi32(kMagnitude);
  __m512i greatest = _mm512_setzero_si512();
  for (std::size_t word = 0; word < 8; ++word) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const __m512 v = _mm512_loadu_ps(values + 64 * word + 16 * i);
      const __mmask16 in = rule.scale > 0 ? _mm512_cmp_ps_mask(v, iso, _CMP_LT_OQ) : _mm512_cmp_ps_mask(v, iso, _CMP_GT_OQ);
      bits |= std::uint64_t{in} << (16 * i);
      // (With a mask, because without one GCC 12 takes the intrinsic's unused operand for one that is read.)
      greatest = _mm512_mask_max_epi32(greatest, 0xffff, greatest, _mm512_and_si512(_mm512_castps_si512(v), magnitude));
    }
    inside[word] = bits;
  }
  return _mm512_cmpgt_epi32_mask(greatest, _mm512_set1_epi32(kLargestFinite)) == 0;
}

ReadSigns& chosen_read_signs() {
  return *of_level<ReadSigns*>(chosen_simd_level(), read_signs_sse2, read_signs_avx2, read_signs_avx512);
}
#else
bool read_signs_plain(const float* values, const InsideRule& rule, BlockMask& inside) {
  bool finite = true;
  inside = {};
  for (std::size_t i = 0; i < 512; ++i) {
    inside[i >> 6] |= static_cast<std::uint64_t>(rule(values[i])) << (i & 63);
    finite = finite && std::isfinite(values[i]);
  }
  return finite;
}
ReadSigns& chosen_read_signs() { return read_signs_plain; }
#endif

constexpr std::int32_t uniform(bool inside) { return inside ? kUniformInside : kUniformOutside; }

}  // namespace

InsideRule inside_rule(const openvdb::FloatGrid& grid, double isovalue) {
  if (!std::isfinite(isovalue)) throw Error("the isovalue must be a finite number");
  if (!std::isfinite(grid.background())) throw Error("the volume's background value is not finite");
  InsideRule rule;
  const bool greater_is_inside =
      grid.getGridClass() != openvdb::GRID_LEVEL_SET && grid.background() < isovalue;
  rule.scale = greater_is_inside ? -1.0f : 1.0f;
  // The isovalue is rounded away from the inside, so that a comparison of floats decides as one with the isovalue
  // itself does.
  constexpr float kLargest = std::numeric_limits<float>::max();
  rule.isovalue = static_cast<float>(std::clamp(isovalue, -double(kLargest), double(kLargest)));
  if (!greater_is_inside && rule.isovalue < isovalue) rule.isovalue = std::nextafter(rule.isovalue, kLargest);
  if (greater_is_inside && rule.isovalue > isovalue) rule.isovalue = std::nextafter(rule.isovalue, -kLargest);
  return rule;
}

std::vector<Coord> tiles_between_signs(const openvdb::FloatTree& tree, const InsideRule& is_inside,
                                       RunContext& context) {
  // Where two tiles differ in sign, one of them is unlike the background; the others may fill space without end.
  const bool background = is_inside(tree.background());
  std::vector<openvdb::CoordBBox> tiles;
  openvdb::FloatTree::ValueAllCIter it = tree.cbeginValueAll();
  it.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; it; ++it)
    if (is_inside(*it) != background) tiles.push_back(it.getBoundingBox());
  std::vector<std::vector<Coord>> found(tiles.size());
  parallel_blocks(tiles.size(), context, [&](std::size_t i) {
    Accessor access(tree);
    const Coord size = tiles[i].dim();
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {-1, 1})
        for (int a = 0; a < size[(axis + 1) % 3]; a += 8)
          for (int b = 0; b < size[(axis + 2) % 3]; b += 8) {
            Coord own = tiles[i].min();
            own[(axis + 1) % 3] += a, own[(axis + 2) % 3] += b;
            if (side > 0) own[axis] += size[axis] - 8;
            Coord there = own;
            there[axis] += 8 * side;
            if (access.probeConstLeaf(there) || is_inside(access.getValue(there)) != background) continue;
            found[i].push_back(own);
            found[i].push_back(there);
          }
  });
  std::vector<Coord> all;
  for (const auto& list : found) all.insert(all.end(), list.begin(), list.end());
  return all;
}

LeafTable::LeafTable(const LevelSet& level_set, double isovalue, RunContext& context) {
  const openvdb::FloatGrid& grid = *level_set.grid().grid;
  rule_ = inside_rule(grid, isovalue);
  tree_ = grid.constTreePtr();
  number_leaves(context);
  read_signs(context);
  if (is_complete(context)) return;
  // Rare: bands thinner than a voxel, tiles that were made by hand. A new leaf may meet further tiles of the other sign
  // only where the tile it was made from did, so one round is enough; the loop does not rely on it.
  auto copy = std::make_shared<openvdb::FloatTree>(*tree_);
  do {
    for (const Coord& lower : missing_leaves(context)) copy->touchLeaf(lower);
    tree_ = copy;
    number_leaves(context);
    read_signs(context);
  } while (!is_complete(context));
}

void LeafTable::number_leaves(RunContext& context) {
  std::vector<const TreeNode*> sources;
  tree_->getNodes(sources);
  nodes_.assign(sources.size(), {});
  std::unordered_map<Coord, std::int32_t> index;
  std::vector<std::uint64_t> counts(sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i) {
    index.emplace(sources[i]->origin(), static_cast<std::int32_t>(i));
    counts[i] = sources[i]->getChildMask().countOn();
  }
  const std::uint64_t total = exclusive_scan(counts, "leaves");
  places_.resize(total);
  leaves_.resize(total);
  values_.resize(total);
  constexpr int kWidth = TreeNode::DIM;
  static_assert(TreeNode::NUM_VALUES == 64 * kWords);
  parallel_blocks(sources.size(), context, [&](std::size_t i) {
    Node& node = nodes_[i];
    node.source = sources[i];
    node.lower = node.source->origin();
    auto next = static_cast<std::uint32_t>(counts[i]);
    for (int word = 0; word < kWords; ++word) {
      node.child[word] = node.source->getChildMask().getWord<std::uint64_t>(word);
      node.rank[word] = next;
      for (std::uint64_t bits = node.child[word]; bits != 0; bits &= bits - 1) {
        const auto slot = static_cast<std::uint32_t>(64 * word + std::countr_zero(bits));
        places_[next] = {static_cast<std::uint32_t>(i), slot};
        leaves_[next++] = node.source->getTable()[slot].getChild();
      }
      for (int bit = 0; bit < 64; ++bit) {
        if (node.child[word] >> bit & 1) continue;
        const float value = rule_.signed_value(node.source->getTable()[64 * word + bit].getValue());
        if (!(value < 0.0f)) continue;
        node.tile_inside[word] |= std::uint64_t{1} << bit;
        node.nearest_inside = std::max(node.nearest_inside, value);
      }
    }
    Accessor access(*tree_);
    for (int slot = 0; slot < 27; ++slot) {
      const Coord there = node.lower.offsetBy(kWidth * (slot / 9 - 1), kWidth * (slot / 3 % 3 - 1), kWidth * (slot % 3 - 1));
      const auto found = index.find(there);
      node.neighbours[slot] = found != index.end() ? found->second : uniform(rule_(access.getValue(there)));
    }
  });
}

void LeafTable::read_signs(RunContext& context) {
  inside_.resize(size());
  std::atomic<bool> not_finite{false};
  ReadSigns& read = chosen_read_signs();
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size(), 64), [&](const auto& range) {
    context.check();
    bool finite = true;
    // To wait for one leaf after the other, and for the samples that it points to, would take longer than all the rest.
    constexpr std::size_t kLeavesAhead = 16, kSamplesAhead = 4, kLine = 16;
    const auto find = [&](std::size_t i) {
      values_[i] = leaves_[i]->buffer().data();
      for (std::size_t sample = 0; sample < 512; sample += kLine) __builtin_prefetch(values_[i] + sample);
    };
    for (std::size_t i = range.begin(); i < std::min(range.begin() + kLeavesAhead, range.end()); ++i)
      __builtin_prefetch(leaves_[i]);
    for (std::size_t i = range.begin(); i < std::min(range.begin() + kSamplesAhead, range.end()); ++i) find(i);
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      if (i + kLeavesAhead < range.end()) __builtin_prefetch(leaves_[i + kLeavesAhead]);
      if (i + kSamplesAhead < range.end()) find(i + kSamplesAhead);
      finite &= read(values_[i], rule_, inside_[i]);
    }
    if (!finite) not_finite = true;
  });
  if (not_finite) throw Error("the volume holds a value that is not finite; replace it before the extraction");
}

bool LeafTable::has_inactive_inside_nearer_than(float distance) const {
  float nearest = kNoTile;
  for (const Node& node : nodes_) nearest = std::max(nearest, node.nearest_inside);
  if (nearest != kNoTile) return nearest > -distance;
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, size(), 64), false,
      [&](const auto& range, bool found) {
        for (std::size_t leaf = range.begin(); leaf < range.end() && !found; ++leaf) {
          const BlockMask mask = active(leaf);
          for (int word = 0; word < 8; ++word)
            for (std::uint64_t bits = inside_[leaf][word] & ~mask[word]; bits != 0; bits &= bits - 1)
              found = found || rule_.signed_value(values_[leaf][64 * word + std::countr_zero(bits)]) > -distance;
        }
        return found;
      },
      [](bool a, bool b) { return a || b; });
}

BlockMask LeafTable::active(std::size_t leaf) const {
  BlockMask mask;
  for (int word = 0; word < 8; ++word) mask[word] = leaves_[leaf]->getValueMask().getWord<std::uint64_t>(word);
  return mask;
}

Coord LeafTable::lower(std::size_t leaf) const {
  // The leaf itself lies where no cache has it.
  const Place place = places_[leaf];
  const auto at = [&](int shift) { return static_cast<std::int32_t>(8 * (place.slot >> shift & 15)); };
  return nodes_[place.node].lower.offsetBy(at(8), at(4), at(0));
}

std::int32_t LeafTable::find(const Node& node, std::uint32_t slot) const {
  const std::uint64_t bit = std::uint64_t{1} << (slot & 63), word = node.child[slot >> 6];
  if (word & bit) return static_cast<std::int32_t>(node.rank[slot >> 6]) + std::popcount(word & (bit - 1));
  return uniform((node.tile_inside[slot >> 6] & bit) != 0);
}

std::int32_t LeafTable::neighbour(std::size_t leaf, int dx, int dy, int dz) const {
  const Place place = places_[leaf];
  const Node& node = nodes_[place.node];
  const int x = static_cast<int>(place.slot >> 8) + dx, y = static_cast<int>((place.slot >> 4) & 15) + dy,
            z = static_cast<int>(place.slot & 15) + dz;
  const auto slot = static_cast<std::uint32_t>(((x & 15) << 8) | ((y & 15) << 4) | (z & 15));
  if (((x | y | z) & ~15) == 0) return find(node, slot);
  const std::int32_t there = node.neighbours[neighbour_slot(x >> 4, y >> 4, z >> 4)];
  return there >= 0 ? find(nodes_[there], slot) : there;
}

std::array<std::int32_t, 8> LeafTable::neighbours(std::size_t leaf, int side) const {
  const Place place = places_[leaf];
  const Node& node = nodes_[place.node];
  const int x = static_cast<int>(place.slot >> 8), y = static_cast<int>((place.slot >> 4) & 15),
            z = static_cast<int>(place.slot & 15), border = side > 0 ? 15 : 0;
  std::array<std::int32_t, 8> result;
  result[0] = static_cast<std::int32_t>(leaf);
  if (x == border || y == border || z == border) {
    for (int i = 1; i < 8; ++i) result[i] = neighbour(leaf, side * (i & 1), side * (i >> 1 & 1), side * (i >> 2));
  } else {
    for (int i = 1; i < 8; ++i)
      result[i] = find(node, place.slot + static_cast<std::uint32_t>(side * (256 * (i & 1) + 16 * (i >> 1 & 1) + (i >> 2))));
  }
  return result;
}

/// find() for the slots before, at and behind `slot`, which are those of one row along z.
[[gnu::always_inline]] inline void LeafTable::find_three(const Node& node, std::uint32_t slot, std::int32_t* result) {
  const std::uint32_t at = slot >> 6, first = (slot & 63) - 1;
  const std::uint64_t child = node.child[at], inside = node.tile_inside[at];
  auto next = static_cast<std::int32_t>(node.rank[at]) + std::popcount(child & ((std::uint64_t{1} << first) - 1));
  for (std::uint32_t i = 0; i < 3; ++i) {
    const bool is_leaf = child >> (first + i) & 1;
    result[i] = is_leaf ? next : uniform(inside >> (first + i) & 1);
    next += is_leaf;
  }
}

std::array<std::int32_t, 27> LeafTable::surroundings(std::size_t leaf) const {
  const Place place = places_[leaf];
  const Node& node = nodes_[place.node];
  const int x = static_cast<int>(place.slot >> 8), y = static_cast<int>((place.slot >> 4) & 15),
            z = static_cast<int>(place.slot & 15);
  const bool within = x > 0 && x < 15 && y > 0 && y < 15;
  std::array<std::int32_t, 27> result;
  for (int row = 0; row < 9; ++row) {
    const int dx = row / 3 - 1, dy = row % 3 - 1;
    const std::int32_t there =
        within ? static_cast<std::int32_t>(place.node) : node.neighbours[neighbour_slot((x + dx) >> 4, (y + dy) >> 4, 0)];
    if (z == 0 || z == 15 || there < 0) {
      for (int dz = -1; dz <= 1; ++dz) result[neighbour_slot(dx, dy, dz)] = neighbour(leaf, dx, dy, dz);
    } else {
      const int slot = (((x + dx) & 15) << 8) | (((y + dy) & 15) << 4) | z;
      find_three(nodes_[there], static_cast<std::uint32_t>(slot), &result[neighbour_slot(dx, dy, -1)]);
    }
  }
  return result;
}

std::vector<std::uint32_t> LeafTable::in_order_of_place() const {
  // No sorting but of the few nodes: their rows of 16 along z follow one another.
  std::vector<const Node*> nodes;
  for (const Node& node : nodes_) nodes.push_back(&node);
  std::ranges::sort(nodes, [](const Node* a, const Node* b) { return a->lower < b->lower; });
  const auto end_of = [&](std::size_t first, std::size_t end, int axis) {
    std::size_t i = first;
    while (i < end && nodes[i]->lower[axis] == nodes[first]->lower[axis]) ++i;
    return i;
  };
  std::vector<std::uint32_t> result;
  result.reserve(size());
  const auto add_row = [&](const Node& node, int x, int y) {
    const int word = 4 * x + (y >> 2), shift = 16 * (y & 3);
    const std::uint64_t child = node.child[word];
    const std::uint64_t before = child & ((std::uint64_t{1} << shift) - 1);
    std::uint32_t leaf = node.rank[word] + static_cast<std::uint32_t>(std::popcount(before));
    for (int left = std::popcount(child >> shift & 0xffff); left > 0; --left) result.push_back(leaf++);
  };
  for (std::size_t slab = 0, slab_end; slab < nodes.size(); slab = slab_end) {
    slab_end = end_of(slab, nodes.size(), 0);
    for (int x = 0; x < 16; ++x)
      for (std::size_t column = slab, column_end; column < slab_end; column = column_end) {
        column_end = end_of(column, slab_end, 1);
        for (int y = 0; y < 16; ++y)
          for (std::size_t i = column; i < column_end; ++i) add_row(*nodes[i], x, y);
      }
  }
  return result;
}

/// True if two tiles of different sign touch, both within the node or one in it and one beyond. Rows of 16 along z are
/// compared with their neighbours as bits.
bool LeafTable::tiles_meet(const Node& node) const {
  struct Row {
    std::uint32_t tile, inside;
  };
  const auto row_of = [](const Node& in, int x, int y) {
    const int word = 4 * x + (y >> 2), shift = 16 * (y & 3);
    return Row{static_cast<std::uint32_t>(~in.child[word] >> shift) & 0xffff,
               static_cast<std::uint32_t>(in.tile_inside[word] >> shift) & 0xffff};
  };
  const auto row_at = [&](int x, int y, int dz) {
    const std::int32_t there = node.neighbours[neighbour_slot(x >> 4, y >> 4, dz)];
    if (there < 0) return Row{0xffff, there == kUniformInside ? 0xffffu : 0};
    return row_of(nodes_[there], x & 15, y & 15);
  };
  const auto meet = [](Row a, Row b) { return a.tile & b.tile & (a.inside ^ b.inside); };
  std::uint32_t met = 0;
  for (int x = 0; x < 16; ++x)
    for (int y = 0; y < 16; ++y) {
      const Row own = row_of(node, x, y);
      if (own.tile == 0) continue;
      const Row next = {own.tile >> 1, own.inside >> 1}, above = row_at(x, y, 1), below = row_at(x, y, -1);
      met |= meet(own, next) & 0x7fff;
      met |= meet({own.tile >> 15, own.inside >> 15}, above) & 1;
      met |= meet(own, {below.tile >> 15, below.inside >> 15}) & 1;
      met |= meet(own, y < 15 ? row_of(node, x, y + 1) : row_at(x, 16, 0));
      met |= meet(own, x < 15 ? row_of(node, x + 1, y) : row_at(16, y, 0));
      if (y == 0) met |= meet(own, row_at(x, -1, 0));
      if (x == 0) met |= meet(own, row_at(-1, y, 0));
    }
  return met != 0;
}

/// True if there is no leaf below along the axis, and the tile there is not of the sign of all samples of the leaf's
/// first layer.
bool LeafTable::differs_from_tile_below(std::size_t leaf, int axis) const {
  const std::int32_t there = neighbour(leaf, -(axis == 0), -(axis == 1), -(axis == 2));
  if (there >= 0) return false;
  constexpr std::uint64_t kLayer[3] = {~std::uint64_t{0}, 0xff, 0x0101010101010101u};
  const std::uint64_t expected = there == kUniformInside ? kLayer[axis] : 0;
  for (int x = 0; x < (axis == 0 ? 1 : 8); ++x)
    if ((inside_[leaf][x] & kLayer[axis]) != expected) return true;
  return false;
}

/// True if every edge with a change of sign starts in a leaf.
bool LeafTable::is_complete(RunContext& context) const {
  std::atomic<bool> complete{true};
  parallel_blocks(nodes_.size(), context, [&](std::size_t i) {
    if (complete && tiles_meet(nodes_[i])) complete = false;
  });
  parallel_blocks(size(), context, [&](std::size_t i) {
    for (int axis = 0; axis < 3; ++axis)
      if (differs_from_tile_below(i, axis)) complete = false;
  });
  if (!complete) return false;
  // Tiles as large as a node or larger: only those unlike the background need a look, and there are few.
  const std::vector<openvdb::CoordBBox> tiles = large_tiles_unlike_background(context);
  parallel_blocks(tiles.size(), context, [&](std::size_t i) {
    if (complete && meets_background(tiles[i])) complete = false;
  });
  return complete;
}

std::vector<openvdb::CoordBBox> LeafTable::large_tiles_unlike_background(RunContext& context) const {
  const bool background = rule_(tree_->background());
  std::vector<openvdb::CoordBBox> found;
  const auto add = [&](const Coord& lower, int width) {
    found.push_back(openvdb::CoordBBox::createCube(lower, width));
  };
  for (auto it = tree_->root().cbeginValueAll(); it; ++it)
    if (rule_(*it) != background) add(it.getCoord(), LargeNode::DIM);
  std::vector<const LargeNode*> nodes;
  tree_->getNodes(nodes);
  // An iterator over the tiles takes longer than all else that is done with a leaf's signs.
  constexpr std::size_t kTogether = 64;
  static_assert(LargeNode::NUM_VALUES % kTogether == 0);
  for (const LargeNode* node : nodes) {
    context.check();
    const auto* const table = node->getTable();
    for (std::size_t word = 0; word < LargeNode::NUM_VALUES / kTogether; ++word) {
      const auto child =
          node->getChildMask().template getWord<std::uint64_t>(static_cast<openvdb::Index>(word));
      std::uint64_t unlike = 0;
      for (std::size_t bit = 0; bit < kTogether; ++bit)
        unlike |= static_cast<std::uint64_t>(rule_(table[kTogether * word + bit].getValue()) != background)
                  << bit;
      for (unlike &= ~child; unlike != 0; unlike &= unlike - 1) {
        const auto slot = kTogether * word + static_cast<std::size_t>(std::countr_zero(unlike));
        add(node->offsetToGlobalCoord(static_cast<openvdb::Index>(slot)), TreeNode::DIM);
      }
    }
  }
  return found;
}

/// True if a tile as large as a node or larger touches another one with the background's sign.
bool LeafTable::meets_background(const openvdb::CoordBBox& box) const {
  const bool background = rule_(tree_->background());
  Accessor access(*tree_);
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1}) {
      Coord there = box.min();
      there[axis] += side > 0 ? box.dim()[axis] : -1;
      // Smaller tiles beyond were compared with this one from their own side.
      for (int a = 0; a < box.dim()[(axis + 1) % 3]; a += TreeNode::DIM)
        for (int b = 0; b < box.dim()[(axis + 2) % 3]; b += TreeNode::DIM) {
          Coord at = there;
          at[(axis + 1) % 3] += a, at[(axis + 2) % 3] += b;
          if (!access.probeConstNode<TreeNode>(at) && rule_(access.getValue(at)) == background) return true;
        }
    }
  return false;
}

std::vector<Coord> LeafTable::missing_leaves(RunContext& context) const {
  std::vector<Coord> missing = tiles_between_signs(*tree_, rule_, context);
  for (std::size_t i = 0; i < size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      if (!differs_from_tile_below(i, axis)) continue;
      Coord there = lower(i);
      there[axis] -= 8;
      missing.push_back(there);
    }
  return missing;
}

}  // namespace hermesh
