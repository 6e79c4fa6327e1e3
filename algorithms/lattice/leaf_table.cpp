#include "algorithms/lattice/leaf_table.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <unordered_map>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

using openvdb::Coord;
using Accessor = openvdb::tree::ValueAccessor<const openvdb::FloatTree>;

constexpr std::array<float, 512> make_no_samples() {
  std::array<float, 512> values{};
  for (float& value : values) value = std::numeric_limits<float>::infinity();
  return values;
}
constexpr std::array<float, 512> kNoSamples = make_no_samples();

/// Distances of prefetching, in leaves and in leaves' samples: their latency exceeds all other costs.
constexpr std::size_t kLeavesAhead = 16, kSamplesAhead = 4;

/// Most pairs of blocks that may change their sign where neither holds samples. A few bytes of a damaged file
/// can describe a surface of any size; extractors need about 15 kB for the 64 edges of a pair (leaves, their
/// copies, a crossing and a polygon each), so this is a gibibyte. Level sets have none, and a cube that is
/// one tile reaches it at a width of 864 voxels.
constexpr double kMostTilePairs = 70e3;

/// Calls f(own, there, axis, width) for squares of blocks of the tile's faces across an axis that border a
/// tile whose value satisfies `wanted`: the first block within, the first beyond, and the width in samples.
/// Squares are as large as the tiles beyond.
template <class Wanted, class F>
void for_each_bordering_tile(const openvdb::FloatTree& tree, const openvdb::CoordBBox& tile, Wanted&& wanted,
                             F&& f) {
  using LargeNode = openvdb::FloatTree::RootNodeType::ChildNodeType;
  using Node = LargeNode::ChildNodeType;
  openvdb::tree::ValueAccessor<const openvdb::FloatTree> access(tree);
  const int size = tile.dim().x();
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto square = [&](auto&& self, Coord own, Coord there, int width) -> void {
      // A square is divided where a node of its own width lies beyond, and omitted where finally a leaf does.
      // A tile beyond that is wider than the square counts with the square's width.
      const bool divided = width > int(Node::DIM) ? access.probeConstNode<LargeNode>(there) != nullptr
                           : width > 8            ? access.probeConstNode<Node>(there) != nullptr
                                                  : access.probeConstLeaf(there) != nullptr;
      if (!divided) {
        if (wanted(access.getValue(there))) f(own, there, axis, width);
        return;
      }
      if (width == 8) return;
      const int part = width > int(Node::DIM) ? int(Node::DIM) : 8;
      for (int a = 0; a < width; a += part)
        for (int b = 0; b < width; b += part) {
          Coord from = own, to = there;
          from[u] += a, from[v] += b, to[u] += a, to[v] += b;
          self(self, from, to, part);
        }
    };
    for (const int side : {-1, 1}) {
      Coord own = tile.min(), there = tile.min();
      if (side > 0) own[axis] += size - 8;
      there[axis] += side > 0 ? size : -8;
      square(square, own, there, size);
    }
  }
}

constexpr std::int32_t uniform(bool inside) { return inside ? kUniformInside : kUniformOutside; }

Coord coord_of(const std::array<std::int32_t, 3>& at) { return {at[0], at[1], at[2]}; }

}  // namespace

InsideRule inside_rule(const openvdb::FloatGrid& grid, double isovalue) {
  if (!std::isfinite(isovalue)) throw Error("the isovalue must be a finite number");
  if (!std::isfinite(grid.background())) throw Error("the volume's background value is not finite");
  InsideRule rule;
  const bool greater_is_inside =
      grid.getGridClass() != openvdb::GRID_LEVEL_SET && grid.background() < isovalue;
  rule.scale = greater_is_inside ? -1.0f : 1.0f;
  // The isovalue is rounded away from the inside, so that comparisons of floats agree with the exact
  // isovalue.
  constexpr float kLargest = std::numeric_limits<float>::max();
  rule.isovalue = static_cast<float>(std::clamp(isovalue, -double(kLargest), double(kLargest)));
  if (!greater_is_inside && rule.isovalue < isovalue) rule.isovalue = std::nextafter(rule.isovalue, kLargest);
  if (greater_is_inside && rule.isovalue > isovalue) rule.isovalue = std::nextafter(rule.isovalue, -kLargest);
  return rule;
}

std::vector<Coord> tiles_between_signs(const openvdb::FloatTree& tree, const InsideRule& is_inside,
                                       RunContext& context) {
  // Of two tiles of different sign, one is unlike the background; the others may fill infinite space.
  const bool background = is_inside(tree.background());
  std::vector<openvdb::CoordBBox> tiles;
  openvdb::FloatTree::ValueAllCIter it = tree.cbeginValueAll();
  it.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1);
  for (; it; ++it)
    if (is_inside(*it) != background) tiles.push_back(it.getBoundingBox());
  // Counted before anything is listed: a damaged file is rejected before it takes memory. Only the side
  // unlike the background is traversed, so that each pair is counted once.
  std::vector<double> pairs(tiles.size());
  const auto bordering = [&](std::size_t i, auto&& f) {
    for_each_bordering_tile(
        tree, tiles[i], [&](float value) { return is_inside(value) == background; }, f);
  };
  parallel_blocks(tiles.size(), context, [&](std::size_t i) {
    bordering(
        i, [&](const Coord&, const Coord&, int, int width) { pairs[i] += double(width / 8) * (width / 8); });
  });
  const double crossed = std::accumulate(pairs.begin(), pairs.end(), 0.0);
  if (crossed > kMostTilePairs)
    throw Error("the volume changes its sign between tiles, without samples of a narrow band, over " +
                std::to_string(64 * static_cast<std::int64_t>(crossed)) + " faces of voxels, more than the " +
                std::to_string(64 * static_cast<std::int64_t>(kMostTilePairs)) +
                " that are looked at: give it a narrow band, or resample it at a larger voxel size");
  std::vector<std::vector<Coord>> found(tiles.size());
  parallel_blocks(tiles.size(), context, [&](std::size_t i) {
    bordering(i, [&](const Coord& own, const Coord& there, int axis, int width) {
      for (int a = 0; a < width; a += 8)
        for (int b = 0; b < width; b += 8)
          for (Coord block : {own, there}) {
            block[(axis + 1) % 3] += a, block[(axis + 2) % 3] += b;
            found[i].push_back(block);
          }
    });
  });
  // Joined in the order of the tiles.
  std::vector<Coord> all;
  for (const auto& list : found) all.insert(all.end(), list.begin(), list.end());
  return all;
}

LeafPlaces::LeafPlaces(const LevelSet& level_set, double isovalue)
    : tree_(level_set.grid().grid->constTreePtr()), rule_(inside_rule(*level_set.grid().grid, isovalue)) {}

LeafPlaces::LeafPlaces(const LevelSet& level_set, double isovalue, RunContext& context)
    : LeafPlaces(level_set, isovalue) {
  number_leaves(context, true);
}

float LeafPlaces::background() const { return tree_->background(); }
float LeafPlaces::value_at(std::size_t leaf, int x, int y, int z) const {
  return tree_->getValue(coord_of(lower(leaf)).offsetBy(x, y, z));
}
bool LeafPlaces::is_active_at(std::size_t leaf, int x, int y, int z) const {
  return tree_->isValueOn(coord_of(lower(leaf)).offsetBy(x, y, z));
}

void LeafPlaces::find_values(std::size_t leaf) { values_[leaf + kUniforms] = leaves_[leaf]->buffer().data(); }

void LeafPlaces::number_leaves(RunContext& context, bool with_values) {
  std::vector<const TreeNode*> sources;
  tree_->getNodes(sources);
  nodes_.assign(sources.size(), {});
  std::unordered_map<Coord, std::int32_t> index;
  std::vector<std::uint64_t> counts(sources.size());
  for (std::size_t i = 0; i < sources.size(); ++i) {
    index.emplace(sources[i]->origin(), static_cast<std::int32_t>(i));
    counts[i] = sources[i]->getChildMask().countOn();
  }
  // The scan turns counts into the number of each node's first leaf.
  const std::uint64_t total = exclusive_scan(counts, "leaves");
  places_.resize(total);
  leaves_.resize(total);
  // The two numbers for "no leaf" are negative; with the array shifted by two, values() reads them without a
  // branch.
  values_.resize(total + kUniforms);
  std::fill_n(values_.begin(), kUniforms, kNoSamples.data());
  around_.resize(total);
  numbers_.resize(sources.size());
  const auto each_node = [&](auto&& f) { parallel_blocks(sources.size(), context, f, 1); };
  // A node writes only its own entry and those of its own leaves.
  each_node([&](std::size_t i) {
    Node& node = nodes_[i];
    node.source = sources[i];
    const Coord lower = node.source->origin();
    node.lower = {lower.x(), lower.y(), lower.z()};
    Accessor access(*tree_);
    for (int slot = 0; slot < 27; ++slot) {
      constexpr int kWidth = TreeNode::DIM;
      const Coord there =
          lower.offsetBy(kWidth * (slot / 9 - 1), kWidth * (slot / 3 % 3 - 1), kWidth * (slot % 3 - 1));
      const auto found = index.find(there);
      node.neighbours[slot] = found != index.end() ? found->second : uniform(rule_(access.getValue(there)));
    }
    find_tiles(node);
    number(node, static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(counts[i]));
    if (!with_values) return;
    const std::size_t first = node.first_at.front(), end = node.first_at.back();
    for (std::size_t leaf = first; leaf < std::min(first + kLeavesAhead, end); ++leaf) ask_for(leaf);
    for (std::size_t leaf = first; leaf < end; ++leaf) {
      if (leaf + kLeavesAhead < end) ask_for(leaf + kLeavesAhead);
      find_values(leaf);
    }
  });
  // Second, since the surroundings of a node are copied from its neighbours' numbers; each node writes its
  // own boundary, which no other one reads.
  each_node([&](std::size_t i) { number_around(i); });
  nodes_in_order_.resize(sources.size());
  std::iota(nodes_in_order_.begin(), nodes_in_order_.end(), 0u);
  std::ranges::sort(nodes_in_order_, {}, [&](std::uint32_t node) { return nodes_[node].lower; });
}

/// Finds the slots of the node with children, the tiles inside, and the tile inside that is nearest to the
/// isovalue.
void LeafPlaces::find_tiles(Node& node) const {
  static_assert(TreeNode::NUM_VALUES == 64 * kWords);
  for (int word = 0; word < kWords; ++word) {
    node.child[word] = node.source->getChildMask().getWord<std::uint64_t>(word);
    const auto* const table = node.source->getTable() + 64 * word;
    // All slots are read, without branches; the result for pointers to children is masked.
    std::uint64_t inside = 0;
    for (int bit = 0; bit < 64; ++bit)
      inside |= static_cast<std::uint64_t>(rule_(table[bit].getValue())) << bit;
    node.tile_inside[word] = inside & ~node.child[word];
    for (std::uint64_t left = node.tile_inside[word]; left != 0; left &= left - 1)
      node.nearest_inside =
          std::max(node.nearest_inside, rule_.signed_value(table[std::countr_zero(left)].getValue()));
  }
}

/// Numbers the node's leaves from `next` on in the order of its slots, which is that of OpenVDB's traversal.
void LeafPlaces::number(Node& node, std::uint32_t index, std::uint32_t next) {
  Numbers& numbers = numbers_[index];
  // A row is 16 slots along z, a quarter of a word of the masks.
  for (int row = 0; row < 256; ++row) {
    if (row % 16 == 0) node.first_at[row / 16] = next;
    std::int32_t* to = &numbers[number_slot(row >> 4, row & 15, 0)];
    const int word = row >> 2, shift = 16 * (row & 3);
    const auto inside = static_cast<std::uint32_t>(node.tile_inside[word] >> shift & 0xffff);
    for (int z = 0; z < 16; ++z) to[z] = uniform(inside >> z & 1);
    for (std::uint64_t left = node.child[word] >> shift & 0xffff; left != 0; left &= left - 1) {
      const int z = std::countr_zero(left);
      to[z] = static_cast<std::int32_t>(next);
      places_[next] = {index, static_cast<std::uint32_t>(16 * row + z)};
      around_[next] = to + z;
      leaves_[next++] = node.source->getTable()[16 * row + z].getChild();
    }
  }
  node.first_at[16] = next;
}

/// Fills the boundary of the node's numbers, one step around it, from those of its neighbours.
void LeafPlaces::number_around(std::size_t node) {
  for (int slot = 0; slot < 27; ++slot) {
    if (slot == neighbour_slot(0, 0, 0)) continue;
    const int step[3] = {slot / 9 - 1, slot / 3 % 3 - 1, slot % 3 - 1};
    const std::int32_t there = nodes_[node].neighbours[slot];
    // The part of the boundary in that direction: a face of 16² slots, an edge of 16 or a corner.
    int first[3], end[3];
    for (int axis = 0; axis < 3; ++axis) {
      first[axis] = step[axis] < 0 ? -1 : step[axis] > 0 ? 16 : 0;
      end[axis] = step[axis] == 0 ? 16 : first[axis] + 1;
    }
    for (int x = first[0]; x < end[0]; ++x)
      for (int y = first[1]; y < end[1]; ++y) {
        std::int32_t* to = &numbers_[node][number_slot(x, y, first[2])];
        const int count = end[2] - first[2];
        if (there < 0) {
          std::fill_n(to, count, there);
        } else {
          // Coordinates −1 and 16 become 15 and 0 of the neighbour.
          const Numbers& from = numbers_[static_cast<std::size_t>(there)];
          std::copy_n(&from[number_slot(x & 15, y & 15, first[2] & 15)], count, to);
        }
      }
  }
}

LeafTable::LeafTable(const LevelSet& level_set, double isovalue, RunContext& context)
    : LeafPlaces(level_set, isovalue) {
  number_leaves(context, false);
  read_signs(context);
  if (is_complete(context)) return;
  // Rare: bands thinner than a voxel, manually made tiles. A new leaf may meet further tiles of the other
  // sign only where the tile that it was made from did, so one round is enough.
  auto copy = std::make_shared<openvdb::FloatTree>(*tree_);
  do {
    for (const Coord& lower : missing_leaves(context)) copy->touchLeaf(lower);
    tree_ = copy;
    number_leaves(context, false);
    read_signs(context);
  } while (!is_complete(context));
}

void throw_not_finite() {
  throw Error("the volume holds a value that is not finite; replace it before the extraction");
}

void LeafTable::read_signs(RunContext& context) {
  inside_.resize(size());
  // The flag is only ever set, so that no order matters.
  std::atomic<bool> not_finite{false};
  const SignReader& reader = chosen_kernels<SignReader>();
  const auto read_range = [&](std::size_t begin, std::size_t end) {
    bool finite = true;
    constexpr std::size_t kLine = 16;
    // The leaf must be in the cache before its pointer to the samples can be read, and these prefetched.
    const auto find = [&](std::size_t i) {
      find_values(i);
      for (std::size_t sample = 0; sample < 512; sample += kLine) __builtin_prefetch(values(i) + sample);
    };
    for (std::size_t i = begin; i < std::min(begin + kLeavesAhead, end); ++i) ask_for(i);
    for (std::size_t i = begin; i < std::min(begin + kSamplesAhead, end); ++i) find(i);
    for (std::size_t i = begin; i < end; ++i) {
      if (i + kLeavesAhead < end) ask_for(i + kLeavesAhead);
      if (i + kSamplesAhead < end) find(i + kSamplesAhead);
      finite &= reader.leaf(values(i), rule_, inside_[i].data());
    }
    if (!finite) not_finite = true;
  };
  parallel_ranges(size(), context, RangeFunction(read_range), 64);
  if (not_finite) throw_not_finite();
}

std::optional<float> LeafPlaces::nearest_tile_inside() const {
  float nearest = kNoTile;
  for (const Node& node : nodes_) nearest = std::max(nearest, node.nearest_inside);
  return nearest == kNoTile ? std::nullopt : std::optional(nearest);
}

bool LeafTable::has_inactive_inside_nearer_than(float distance) const {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, size(), 64), false,
      [&](const auto& range, bool found) {
        for (std::size_t leaf = range.begin(); leaf < range.end() && !found; ++leaf) {
          // Inside, signed values are negative: nearer than `distance` is greater than −distance.
          const BlockMask mask = active(leaf);
          const float* samples = values(leaf);
          for (int word = 0; word < 8; ++word)
            for (std::uint64_t bits = inside_[leaf][word] & ~mask[word]; bits != 0; bits &= bits - 1)
              found = found || rule_.signed_value(samples[64 * word + std::countr_zero(bits)]) > -distance;
        }
        return found;
      },
      [](bool a, bool b) { return a || b; });
}

BlockMask LeafPlaces::active(std::size_t leaf) const {
  BlockMask mask;
  for (int word = 0; word < 8; ++word)
    mask[word] = leaves_[leaf]->getValueMask().getWord<std::uint64_t>(word);
  return mask;
}

std::vector<LeafPlaces::Slab> LeafPlaces::slabs() const {
  std::vector<Slab> result;
  const std::span<const std::uint32_t> nodes = nodes_in_order_;
  const auto x_of = [&](std::size_t i) { return nodes_[nodes[i]].lower[0]; };
  // Nodes of one x are adjacent; each group makes 16 layers of leaves.
  for (std::size_t first = 0, end; first < nodes.size(); first = end) {
    for (end = first + 1; end < nodes.size() && x_of(end) == x_of(first); ++end) continue;
    for (int x = 0; x < 16; ++x) result.push_back({nodes.subspan(first, end - first), x});
  }
  return result;
}

/// Returns true if two tiles of different sign touch, both within the node or one in it and one beyond. Rows
/// of 16 along z are compared with their neighbours as bits.
bool LeafPlaces::tiles_meet(const Node& node) const {
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
      // Pairs are tested from below, except at the node's lower sides: beyond may be a tile as large as the
      // node, which tests nothing itself.
      if (y == 0) met |= meet(own, row_at(x, -1, 0));
      if (x == 0) met |= meet(own, row_at(-1, y, 0));
    }
  return met != 0;
}

/// Returns true if all signs of the first layer along the axis are `inside`.
bool LeafPlaces::first_layer_is(const BlockMask& signs, int axis, bool inside) {
  const std::uint64_t layer = first_layers(axis == 1, axis == 2);
  for (int x = 0; x < (axis == 0 ? 1 : 8); ++x)
    if ((signs[x] & layer) != (inside ? layer : 0)) return false;
  return true;
}

bool LeafPlaces::tiles_of_both_signs_meet(RunContext& context) const {
  // Nodes with smaller tiles first, a few operations on bits for each.
  std::atomic<bool> meet{false};
  parallel_blocks(nodes_.size(), context, [&](std::size_t i) {
    if (!meet && tiles_meet(nodes_[i])) meet = true;
  });
  if (meet) return true;
  // Tiles as large as a node or larger: only the few unlike the background.
  const std::vector<openvdb::CoordBBox> tiles = large_tiles_unlike_background(context);
  parallel_blocks(tiles.size(), context, [&](std::size_t i) {
    if (!meet && meets_background(tiles[i])) meet = true;
  });
  return meet;
}

/// Returns true if every edge with a change of sign starts in a leaf.
bool LeafTable::is_complete(RunContext& context) const {
  // Edges that end in a leaf and start in none, then edges between two tiles; all others start in a leaf.
  std::atomic<bool> complete{true};
  parallel_blocks(size(), context, [&](std::size_t i) {
    for (int axis = 0; axis < 3; ++axis)
      if (differs_from_tile_below(i, inside_[i], axis)) complete = false;
  });
  return complete && !tiles_of_both_signs_meet(context);
}

std::vector<openvdb::CoordBBox> LeafPlaces::large_tiles_unlike_background(RunContext& context) const {
  const bool background = rule_(tree_->background());
  std::vector<openvdb::CoordBBox> found;
  const auto add = [&](const Coord& lower, int width) {
    found.push_back(openvdb::CoordBBox::createCube(lower, width));
  };
  for (auto it = tree_->root().cbeginValueAll(); it; ++it)
    if (rule_(*it) != background) add(it.getCoord(), LargeNode::DIM);
  std::vector<const LargeNode*> nodes;
  tree_->getNodes(nodes);
  // An iterator over the tiles would take longer than all other work on signs.
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

/// Returns true if a tile as large as a node or larger touches another one with the background's sign.
bool LeafPlaces::meets_background(const openvdb::CoordBBox& box) const {
  const bool background = rule_(tree_->background());
  Accessor access(*tree_);
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1}) {
      Coord there = box.min();
      there[axis] += side > 0 ? box.dim()[axis] : -1;
      // Smaller tiles beyond were compared from their own side.
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
      if (!differs_from_tile_below(i, inside_[i], axis)) continue;
      // The leaf below owns the edges that lead into this one.
      Coord there = coord_of(lower(i));
      there[axis] -= 8;
      missing.push_back(there);
    }
  return missing;
}

std::array<BlockMask, 3> LeafTable::crossing_edges(std::size_t leaf) const {
  std::array<BlockMask, 3> edges;
  for (int axis = 0; axis < 3; ++axis) {
    const BlockMask above =
        shifted_mask(axis == 0, axis == 1, axis == 2, [&](int x, int y, int z) -> const BlockMask& {
          return x + y + z == 0 ? inside(leaf) : signs(neighbour(leaf, x, y, z));
        });
    for (std::size_t x = 0; x < 8; ++x) edges[std::size_t(axis)][x] = inside(leaf)[x] ^ above[x];
  }
  return edges;
}

void LeafTable::throw_no_leaf(std::size_t leaf, int x, int y, int z) const {
  const auto at = [](int i, int j, int k) {
    return "(" + std::to_string(i) + ", " + std::to_string(j) + ", " + std::to_string(k) + ")";
  };
  const auto [first_x, first_y, first_z] = lower(leaf);
  throw Error(
      "an extractor looked up the sample " + at(x, y, z) + " of the leaf at " +
      at(first_x, first_y, first_z) +
      ", where the volume has no leaf; LeafPlaces::neighbour() tells what is outside or inside throughout");
}

LevelSet with_leaves(const LevelSet& level_set, std::span<const std::array<std::int32_t, 3>> lowers) {
  const openvdb::FloatGrid::Ptr copy = level_set.grid().grid->deepCopy();
  for (const auto& lower : lowers) copy->tree().touchLeaf(coord_of(lower));
  return make_level_set(copy);
}

}  // namespace hermesh
