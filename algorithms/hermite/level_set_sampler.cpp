#include <algorithm>
#include <array>
#include <optional>

#include "algorithms/core/leaf_table.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/hermite/leaf_stencils.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {
namespace {

/// A leaf that owns crossings.
struct LiveLeaf {
  std::uint32_t leaf;
  std::uint32_t number;  ///< in the result
  std::uint32_t first;   ///< number of its first crossing
};

/// Count, scan, fill.
template <class Crossing>
class Sampler {
 public:
  Sampler(const SampledVolume& volume, edge_kernels::Sample<Crossing>* sample, RunContext& context)
      : volume_(volume), table_(volume.table), sample_(sample), context_(context) {}

  void run(SparseHermite<Crossing>& result) {
    result.outermost_inside = table_.rule()(table_.tree().background());
    result.crossings.resize(find_live_leaves());
    result.leaves.resize(live_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, live_.size(), 64), [&](const auto& range) {
      context_.check();
      Batch batches[2];  // one's samples are on their way while the other is worked on
      const auto prepare = [&](std::size_t first) {
        Batch& batch = batches[first / kBatch & 1];
        batch.count = static_cast<int>(std::min(kBatch, range.end() - first));
        for (std::size_t i = 0; i < std::size_t(batch.count); ++i) add(live_[first + i], batch, i, result);
      };
      prepare(range.begin());
      for (std::size_t first = range.begin(); first < range.end(); first += kBatch) {
        if (first + kBatch < range.end()) prepare(first + kBatch);
        const Batch& batch = batches[first / kBatch & 1];
        sample_(batch.inputs.data(), batch.count, batch.out.data());
      }
    });
  }

 private:
  static constexpr std::size_t kBatch = edge_kernels::kBatch;
  /// Leaves whose crossings are found together.
  struct Batch {
    std::array<std::optional<LeafStencils>, kBatch> stencils;
    std::array<edge_kernels::LeafInput, kBatch> inputs;
    std::array<Crossing*, kBatch> out;
    int count;
  };

  /// Returns how many crossings there are.
  std::uint64_t find_live_leaves() {
    LargeArray<std::uint16_t> counts(table_.size());
    parallel_blocks(table_.size(), context_, [&](std::size_t leaf) {
      counts[leaf] = static_cast<std::uint16_t>(kernels_.count(
          upper_signs(leaf, table_.neighbour(leaf, 1, 0, 0), table_.neighbour(leaf, 0, 1, 0), table_.neighbour(leaf, 0, 0, 1))));
    });
    LargeArray<LiveLeaf> by_leaf(table_.size());
    std::uint64_t crossings = 0;
    std::uint32_t live = 0;
    for (const std::uint32_t leaf : table_.in_order_of_place()) {
      if (counts[leaf] == 0) continue;
      by_leaf[leaf] = {leaf, live++, static_cast<std::uint32_t>(crossings)};
      crossings += counts[leaf];
    }
    check_indices(crossings, "edge crossings");
    // The work goes in the order of the tree, which has neighbours closer together.
    live_.reserve(live);
    for (std::size_t leaf = 0; leaf < counts.size(); ++leaf)
      if (counts[leaf] != 0) live_.push_back(by_leaf[leaf]);
    return crossings;
  }

  /// x, y and z: numbers of the leaves above along each axis.
  edge_kernels::UpperSigns upper_signs(std::size_t leaf, std::int32_t x, std::int32_t y, std::int32_t z) const {
    edge_kernels::UpperSigns signs{};
    signs.inside[0] = table_.inside(leaf).data();
    signs.inside[1] = table_.signs(x).data();
    signs.inside[2] = table_.signs(y).data();
    signs.inside[4] = table_.signs(z).data();
    return signs;
  }

  /// Writes all of the leaf but its crossings, and what these are made from to that place of the batch.
  void add(const LiveLeaf& live, Batch& batch, std::size_t place, SparseHermite<Crossing>& result) const {
    LeafStencils& stencils = batch.stencils[place].emplace(volume_, live.leaf);
    stencils.prefetch();
    const auto& around = stencils.around();
    const std::int32_t above[3] = {around[neighbour_slot(1, 0, 0)], around[neighbour_slot(0, 1, 0)],
                                   around[neighbour_slot(0, 0, 1)]};
    edge_kernels::LeafInput& input = batch.inputs[place];
    input.signs = upper_signs(live.leaf, above[0], above[1], above[2]);
    stencils.fill(input);
    batch.out[place] = result.crossings.data() + live.first;
    SignLeaf& leaf = result.leaves[live.number];
    const openvdb::Coord lower = table_.lower(live.leaf);
    leaf.lower = {lower.x(), lower.y(), lower.z()};
    leaf.first = live.first;
    leaf.inside = table_.inside(live.leaf);
    for (int axis = 0; axis < 3; ++axis) leaf.beyond[axis] = first_layer(table_.signs(above[axis]), axis);
  }

  const SampledVolume& volume_;
  const LeafTable& table_;
  edge_kernels::Sample<Crossing>* sample_;
  RunContext& context_;
  const edge_kernels::Kernels& kernels_ = edge_kernels::chosen();
  std::vector<LiveLeaf> live_;
};

template <class Crossing>
SparseHermite<Crossing> sample(const LevelSet& level_set, double isovalue,
                               edge_kernels::Sample<Crossing>* sample_leaves, RunContext& context) {
  SparseHermite<Crossing> result;
  result.placement = placement_of(*level_set.grid().grid);
  const LeafTable table = [&] {
    Stage stage(context, "read signs");
    return LeafTable(level_set, isovalue, context);
  }();
  Stage stage(context, "Hermite data from the level set");
  Sampler<Crossing>(sampled_volume(table, level_set), sample_leaves, context).run(result);
  return result;
}

}  // namespace

FloatHermite sample_level_set(const LevelSet& level_set, double isovalue, RunContext& context) {
  return sample<EdgeCrossing>(level_set, isovalue, edge_kernels::chosen().sample, context);
}

PackedHermite sample_level_set_packed(const LevelSet& level_set, double isovalue, NormalCodeId code,
                                      RunContext& context) {
  PackedHermite result = sample<PackedCrossing>(
      level_set, isovalue, edge_kernels::chosen().sample_packed[static_cast<int>(code)], context);
  result.normal_code = code;
  return result;
}

}  // namespace hermesh
