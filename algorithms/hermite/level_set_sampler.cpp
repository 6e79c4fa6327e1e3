#include <tbb/enumerable_thread_specific.h>
#include <tbb/scalable_allocator.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <new>
#include <optional>

#include "algorithms/core/parallel.h"
#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/hermite/leaf_stencils.h"
#include "algorithms/hermite/samplers.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/leaf_table.h"

namespace hermesh {
namespace {

/// Memory for the crossings found by one thread, at constant addresses.
template <class Crossing>
class CrossingStore {
 public:
  /// Returns room for `count` crossings and for kOutRoom of a kernel after them.
  Crossing* room_for(std::size_t count) {
    if (used_ + count + edge_kernels::kOutRoom > kBlock) {
      // This allocator reuses freed memory. Pages that the system has to clear cost up to a fifth of the
      // total time.
      blocks_.emplace_back(static_cast<Crossing*>(scalable_malloc(kBlock * sizeof(Crossing))));
      if (!blocks_.back()) throw std::bad_alloc();
      used_ = 0;
    }
    return blocks_.back().get() + used_;
  }
  void take(std::size_t count) { used_ += count; }

 private:
  static constexpr std::size_t kBlock = std::size_t{1} << 18;
  static_assert(kBlock >= edge_kernels::kBatch * edge_kernels::kMostCrossings + edge_kernels::kOutRoom);
  struct Free {
    void operator()(Crossing* block) const { scalable_free(block); }
  };
  std::vector<std::unique_ptr<Crossing, Free>> blocks_;
  std::size_t used_ = kBlock;
};

/// Reads the signs of leaves in ascending order.
class LeafSigns {
 public:
  explicit LeafSigns(const LeafPlaces& leaves) : leaves_(leaves) {}

  /// Writes the leaf's `inside` and `beyond` to `signs`.
  void read(std::size_t leaf, SignLeaf& signs) {
    // Leaves of a column are consecutive along z, so the signs above one leaf are those of the next.
    if (leaf_above_ == static_cast<std::int64_t>(leaf))
      signs.inside = above_;
    else
      finite_ &= reader_.leaf(leaves_.values(leaf), leaves_.rule(), signs.inside.data());
    signs.beyond[0] = first_rows(leaves_.neighbour(leaf, 1, 0, 0), 8);
    signs.beyond[1] = first_rows(leaves_.neighbour(leaf, 0, 1, 0), 64);
    const std::int32_t above = leaves_.neighbour(leaf, 0, 0, 1);
    if (above >= 0) {
      leaf_above_ = above;  // usually the next one
      finite_ &= reader_.leaf(leaves_.values(above), leaves_.rule(), above_.data());
      signs.beyond[2] = first_layer(above_, 2);
    } else {
      signs.beyond[2] = uniform(above);
    }
    for (int axis = 0; axis < 3; ++axis)
      complete_ &= !leaves_.differs_from_tile_below(leaf, signs.inside, axis);
  }
  /// True if all samples of the leaves were finite, or all crossed edges that end in them start in leaves.
  bool finite() const { return finite_; }
  bool complete() const { return complete_; }

 private:
  static std::uint64_t uniform(std::int32_t tile) { return tile == kUniformInside ? ~std::uint64_t{0} : 0; }
  /// Returns the signs of eight rows that start `stride` samples apart, in a leaf or a tile.
  std::uint64_t first_rows(std::int32_t there, std::size_t stride) const {
    return there < 0 ? uniform(there) : reader_.rows(leaves_.values(there), stride, leaves_.rule());
  }

  const LeafPlaces& leaves_;
  const SignReader& reader_ = chosen_kernels<SignReader>();
  std::int64_t leaf_above_ = -1;
  BlockMask above_;
  bool finite_ = true, complete_ = true;
};

/// Reads every sample from memory once: a leaf's signs are read, its crossed edges found and their crossings
/// computed while they are in the cache. Only then the number of crossings before a leaf's is known, and they
/// are copied to their positions.
template <class Crossing>
class Sampler {
 public:
  Sampler(const LevelSet& level_set, const SampledVolume& volume, edge_kernels::Sample<Crossing>* sample,
          RunContext& context)
      : level_set_(level_set),
        volume_(volume),
        leaves_(volume.leaves),
        sample_(sample),
        context_(context),
        signs_(leaves_.size()),
        found_(leaves_.size()) {}

  /// Returns false if edges with a change of sign start in no leaf; the result is then invalid.
  bool run(SparseHermite<Crossing>& result) {
    // Sequential work runs concurrently.
    bool tiles_meet = false;
    tbb::task_group beside;
    beside.run([&] { tiles_meet = leaves_.tiles_of_both_signs_meet(context_); });
    beside.run([&] { result.placement = placement_of(level_set_); });
    const auto sample = [&](std::size_t begin, std::size_t end) { sample_leaves(begin, end); };
    parallel_ranges(leaves_.size(), context_, RangeFunction(sample), 64);
    // Errors are thrown here by one thread, so that they do not depend on the order of samples.
    beside.wait();
    if (not_finite_) throw_not_finite();
    if (incomplete_ || tiles_meet) return false;
    result.outermost_inside = leaves_.rule()(leaves_.background());
    copy(result);
    return true;
  }

 private:
  static constexpr std::size_t kBatch = edge_kernels::kBatch;
  /// Leaves whose crossings are computed together.
  struct Batch {
    std::array<std::optional<LeafStencils>, kBatch> stencils;
    std::array<edge_kernels::EdgeInput, kBatch> inputs;
    std::array<std::size_t, kBatch> leaf;
    std::size_t size = 0;
  };
  struct Found {
    const Crossing* crossings;
    std::uint32_t count;
  };

  void sample_leaves(std::size_t first, std::size_t end) {
    // Prefetches leaves, and their samples later.
    constexpr std::size_t kAhead = 6, kFurtherAhead = 18;
    for (std::size_t leaf = first; leaf < std::min(first + kAhead, end); ++leaf) ask_for(leaf);
    LeafSigns signs(leaves_);
    Batch batch;
    for (std::size_t leaf = first; leaf < end; ++leaf) {
      if (leaf + kFurtherAhead < leaves_.size()) leaves_.ask_for_neighbours(leaf + kFurtherAhead);
      if (leaf + kAhead < leaves_.size()) ask_for(leaf + kAhead);
      SignLeaf& to = signs_[leaf];
      signs.read(leaf, to);
      const int count =
          kernels_.crossed(to.inside.data(), to.beyond.data(), batch.inputs[batch.size].crossing);
      found_[leaf].count = static_cast<std::uint32_t>(count);
      // Without a branch, since it would be unpredictable.
      batch.leaf[batch.size] = leaf;
      batch.size += count != 0;
      if (batch.size == kBatch) finish(batch);
    }
    if (batch.size > 0) finish(batch);
    if (!signs.finite()) not_finite_ = true;
    if (!signs.complete()) incomplete_ = true;
  }

  void finish(Batch& batch) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < batch.size; ++i) {
      const std::size_t leaf = batch.leaf[i];
      signs_[leaf].lower = leaves_.lower(leaf);
      batch.stencils[i].emplace(volume_, leaf).fill(batch.inputs[i]);
      count += found_[leaf].count;
    }
    CrossingStore<Crossing>& store = stores_.local();
    Crossing* out = store.room_for(count);
    // In the order of the leaves of the batch.
    sample_(batch.inputs.data(), static_cast<int>(batch.size), out);
    store.take(count);
    for (std::size_t i = 0; i < batch.size; ++i) {
      found_[batch.leaf[i]].crossings = out;
      out += found_[batch.leaf[i]].count;
    }
    batch.size = 0;
  }

  /// Prefetches the leaf's samples, and those just above along x and y, whose latency exceeds the arithmetic.
  /// Those below were read before, and above along z lies the next leaf. (Always inlined: g++ considers the
  /// function free of effects and drops calls.)
  [[gnu::always_inline]] void ask_for(std::size_t leaf) const {
    const float *own = leaves_.values(leaf), *x = leaves_.values(leaves_.neighbour(leaf, 1, 0, 0)),
                *y = leaves_.values(leaves_.neighbour(leaf, 0, 1, 0));
    constexpr int kLine = 16;  // samples
    for (int i = 0; i < 32; ++i) __builtin_prefetch(own + kLine * i);
    for (int i = 0; i < 8; ++i) __builtin_prefetch(x + kLine * i);
    for (int i = 0; i < 8; ++i) __builtin_prefetch(y + 64 * i);
  }

  /// Copies the crossings to the result in order of (x, y, z): count, scan and fill by slabs of one x.
  void copy(SparseHermite<Crossing>& result) {
    const std::vector<LeafPlaces::Slab> slabs = leaves_.slabs();
    std::vector<std::uint64_t> live(slabs.size()), crossings(slabs.size());
    const auto each_slab = [&](auto&& f) { parallel_blocks(slabs.size(), context_, f, 1); };
    each_slab([&](std::size_t i) {
      std::uint64_t leaves_with_any = 0, total = 0;  // local: sums of neighbouring slabs share a cache line
      leaves_.for_each_range(slabs[i], [&](std::size_t first, std::size_t end) {
        for (std::size_t leaf = first; leaf < end; ++leaf) {
          leaves_with_any += found_[leaf].count != 0;
          total += found_[leaf].count;
        }
      });
      live[i] = leaves_with_any, crossings[i] = total;
    });
    result.leaves.resize(exclusive_scan(live, "leaves"));
    result.crossings.resize(exclusive_scan(crossings, "edge crossings"));
    each_slab([&](std::size_t i) {
      std::uint64_t number = live[i], first = crossings[i];
      leaves_.for_each_leaf(slabs[i], [&](std::uint32_t leaf) {
        const Found found = found_[leaf];
        if (found.count == 0) return;
        SignLeaf& to = result.leaves[number++] = signs_[leaf];
        to.first = static_cast<std::uint32_t>(first);
        std::copy_n(found.crossings, found.count, result.crossings.data() + first);
        first += found.count;
      });
    });
  }

  const LevelSet& level_set_;
  const SampledVolume& volume_;
  const LeafPlaces& leaves_;
  edge_kernels::Sample<Crossing>* sample_;
  RunContext& context_;
  const edge_kernels::Kernels& kernels_ = chosen_kernels<edge_kernels::Kernels>();
  LargeArray<SignLeaf> signs_;  ///< signs by leaf; without a position where no edge is crossed
  LargeArray<Found> found_;     ///< crossings by leaf
  tbb::enumerable_thread_specific<CrossingStore<Crossing>> stores_;
  std::atomic<bool> not_finite_{false}, incomplete_{false};
};

template <class Crossing>
SparseHermite<Crossing> sample(const LevelSet& level_set, double isovalue,
                               edge_kernels::Sample<Crossing>* sample_leaves, RunContext& context) {
  SparseHermite<Crossing> result;
  const Stage stage(context, "Hermite data from the level set");
  {
    // First assume that all crossed edges start in leaves, as they do if a band encloses the surface: then
    // signs and crossings are computed in one sweep over the samples.
    const LeafPlaces leaves(level_set, isovalue, context);
    const std::optional<SampledVolume> volume = sampled_volume(leaves, level_set);
    if (volume && Sampler<Crossing>(level_set, *volume, sample_leaves, context).run(result)) return result;
  }
  // Rare: signs must be known first, to determine which samples are data, or to make leaves of tiles.
  const LeafTable table(level_set, isovalue, context);
  const SampledVolume volume = sampled_volume(table, level_set);
  Sampler<Crossing>(level_set, volume, sample_leaves, context).run(result);
  return result;
}

}  // namespace

FloatHermite sample_level_set(const LevelSet& level_set, double isovalue, RunContext& context) {
  return sample<EdgeCrossing>(level_set, isovalue, chosen_kernels<edge_kernels::Kernels>().sample, context);
}

PackedHermite sample_level_set_packed(const LevelSet& level_set, double isovalue, NormalCodeId code,
                                      RunContext& context) {
  const auto& kernels = chosen_kernels<edge_kernels::Kernels>();
  PackedHermite result =
      sample<PackedCrossing>(level_set, isovalue, kernels.sample_packed[static_cast<int>(code)], context);
  result.normal_code = code;
  return result;
}

}  // namespace hermesh
