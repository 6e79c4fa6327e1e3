#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
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

/// Memory for as many crossings as a thread finds; what was taken stays where it is.
template <class Crossing>
class CrossingStore {
 public:
  /// Room for `count` crossings and for kOutRoom of a kernel behind.
  Crossing* room_for(std::size_t count) {
    if (used_ + count + edge_kernels::kOutRoom > kBlock) {
      // This allocator keeps what it is given back. Pages that the system has to clear each time cost as much
      // as a fifth of the whole work.
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

/// Signs of leaves that are asked for in ascending order.
class LeafSigns {
 public:
  explicit LeafSigns(const LeafPlaces& leaves) : leaves_(leaves) {}

  /// Writes the leaf's `inside` and `beyond` to `signs`.
  void read(std::size_t leaf, SignLeaf& signs) {
    // Leaves of a column follow one another along z, so the signs above one leaf are the own signs of the
    // next.
    if (leaf_above_ == static_cast<std::int64_t>(leaf))
      signs.inside = above_;
    else
      finite_ &= reader_.leaf(leaves_.values(leaf), leaves_.rule(), signs.inside.data());
    signs.beyond[0] = first_rows(leaves_.neighbour(leaf, 1, 0, 0), 8);
    signs.beyond[1] = first_rows(leaves_.neighbour(leaf, 0, 1, 0), 64);
    const std::int32_t above = leaves_.neighbour(leaf, 0, 0, 1);
    if (above >= 0) {
      leaf_above_ = above;  // comes next, mostly
      finite_ &= reader_.leaf(leaves_.values(above), leaves_.rule(), above_.data());
      signs.beyond[2] = first_layer(above_, 2);
    } else {
      signs.beyond[2] = uniform(above);
    }
    for (int axis = 0; axis < 3; ++axis)
      complete_ &= !leaves_.differs_from_tile_below(leaf, signs.inside, axis);
  }
  /// Whether all samples of the leaves were finite, and all crossed edges that end in them start in leaves.
  bool finite() const { return finite_; }
  bool complete() const { return complete_; }

 private:
  static std::uint64_t uniform(std::int32_t tile) { return tile == kUniformInside ? ~std::uint64_t{0} : 0; }
  /// Signs of eight rows that start `stride` samples apart, in a leaf or a tile.
  std::uint64_t first_rows(std::int32_t there, std::size_t stride) const {
    return there < 0 ? uniform(there) : reader_.rows(leaves_.values(there), stride, leaves_.rule());
  }

  const LeafPlaces& leaves_;
  const SignReader& reader_ = chosen_kernels<SignReader>();
  std::int64_t leaf_above_ = -1;
  BlockMask above_;
  bool finite_ = true, complete_ = true;
};

/// Every sample comes from memory once: a leaf's signs are read, its crossed edges found and their crossings
/// made while caches hold it. Only then it is known how many crossings there are before a leaf's, and they
/// are copied to their places.
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

  /// Returns false if edges with a change of sign start in no leaf; then the result is of no use.
  bool run(SparseHermite<Crossing>& result) {
    // What one thread alone can do, or nearly, others need not wait for.
    bool tiles_meet = false;
    tbb::task_group beside;
    beside.run([&] { tiles_meet = leaves_.tiles_of_both_signs_meet(context_); });
    beside.run([&] { result.placement = placement_of(level_set_); });
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, leaves_.size(), 64), [&](const auto& range) {
      context_.check();
      sample_leaves(range.begin(), range.end());
    });
    // Errors are thrown here, by one thread: which sample was found first must not matter.
    beside.wait();
    if (not_finite_) throw_not_finite();
    if (incomplete_ || tiles_meet) return false;
    result.outermost_inside = leaves_.rule()(leaves_.background());
    copy(result);
    return true;
  }

 private:
  static constexpr std::size_t kBatch = edge_kernels::kBatch;
  /// Leaves whose crossings are found together.
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
    // By the time that a leaf's turn comes its samples have come from memory, and before them what tells
    // where they are.
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
      // Without a branch: which leaves have crossings no processor guesses.
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
      // Only leaves with crossings get a place, and stencils are gathered for no others.
      signs_[leaf].lower = leaves_.lower(leaf);
      batch.stencils[i].emplace(volume_, leaf).fill(batch.inputs[i]);
      count += found_[leaf].count;
    }
    CrossingStore<Crossing>& store = stores_.local();
    Crossing* out = store.room_for(count);
    // In the order of the leaves of the batch, so each gets the next `count` records.
    sample_(batch.inputs.data(), static_cast<int>(batch.size), out);
    store.take(count);
    for (std::size_t i = 0; i < batch.size; ++i) {
      found_[batch.leaf[i]].crossings = out;
      out += found_[batch.leaf[i]].count;
    }
    batch.size = 0;
  }

  /// Asks for what lies where no machine can guess, and waiting for it costs more than the arithmetic: the
  /// leaf's samples, and those just above along x and y. What lies below was read before, and above along z
  /// lies the next leaf. (Inlined always: g++ takes a function that does nothing else for one without an
  /// effect, and drops the calls.)
  [[gnu::always_inline]] void ask_for(std::size_t leaf) const {
    const float *own = leaves_.values(leaf), *x = leaves_.values(leaves_.neighbour(leaf, 1, 0, 0)),
                *y = leaves_.values(leaves_.neighbour(leaf, 0, 1, 0));
    constexpr int kLine = 16;  // samples
    for (int i = 0; i < 32; ++i) __builtin_prefetch(own + kLine * i);
    for (int i = 0; i < 8; ++i) __builtin_prefetch(x + kLine * i);
    for (int i = 0; i < 8; ++i) __builtin_prefetch(y + 64 * i);
  }

  /// Copies the crossings to their places in the result, which are in order of (x, y, z): count, scan and
  /// fill by slabs of one x.
  void copy(SparseHermite<Crossing>& result) {
    const std::vector<LeafPlaces::Slab> slabs = leaves_.slabs();
    std::vector<std::uint64_t> live(slabs.size()), crossings(slabs.size());
    const auto each_slab = [&](auto&& f) {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, slabs.size()), [&](const auto& range) {
        context_.check();
        for (std::size_t i = range.begin(); i < range.end(); ++i) f(i);
      });
    };
    each_slab([&](std::size_t i) {
      std::uint64_t leaves_with_any = 0, total = 0;  // sums of neighbouring slabs share a cache line
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
        // From here on the leaf knows where its crossings are, whichever thread made them.
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
  LargeArray<SignLeaf> signs_;  ///< signs by leaf; without a place where no edge is crossed
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
    // First on the assumption that all crossed edges start in leaves, as they do where a band encloses the
    // surface: then signs and crossings are made in one sweep over the samples.
    const LeafPlaces leaves(level_set, isovalue, context);
    const std::optional<SampledVolume> volume = sampled_volume(leaves, level_set);
    if (volume && Sampler<Crossing>(level_set, *volume, sample_leaves, context).run(result)) return result;
  }
  // Rare: signs must be known beforehand, to tell which samples are data, or to make leaves of tiles.
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
