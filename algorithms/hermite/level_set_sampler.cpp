#include <tbb/parallel_sort.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <tuple>

#include "algorithms/core/leaf_table.h"
#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/parallel.h"
#include "algorithms/hermite/edge_kernels/edge_kernels.h"
#include "algorithms/hermite/incomplete_stencil.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {
namespace {

constexpr float kNoData = std::numeric_limits<float>::infinity();

/// Rows along z of a leaf and its surroundings that a stencil reads: bit y+1 of word x+1.
struct RowMask {
  std::array<std::uint16_t, 11> y{};

  void add(int x, std::uint32_t rows) { y[x + 1] = static_cast<std::uint16_t>(y[x + 1] | rows); }
  bool has(int x, int row) const { return (y[x + 1] >> (row + 1)) & 1; }
};

/// Which rows the stencils of a leaf's crossing edges read, and in which of them the samples before the leaf's first and
/// behind its last.
struct RowsNeeded {
  RowMask any, below, above;

  explicit RowsNeeded(const std::array<BlockMask, 3>& edges) {
    constexpr std::uint64_t kFirstZ = 0x0101010101010101u;
    for (int x = 0; x < 8; ++x) {
      for (int axis = 0; axis < 3; ++axis)
        if (edges[axis][x] != 0) add_edges(any, x, rows_with(edges[axis][x], ~std::uint64_t{0}), axis);
      const std::uint64_t across = edges[0][x] | edges[1][x] | edges[2][x];
      // A difference along z is taken at both ends of an edge.
      const std::uint32_t first = rows_with(across, kFirstZ), last = rows_with(across, kFirstZ << 7);
      for (RowMask* side : {&below, &above}) {
        const std::uint64_t bits = side == &below ? kFirstZ : kFirstZ << 7;
        side->add(x, (side == &below ? first : last) << 1);
        side->add(x + 1, rows_with(edges[0][x], bits) << 1);
        side->add(x, rows_with(edges[1][x], bits) << 2);
      }
      // The upper end of an edge along z lies above; the differences across it are taken there, too.
      add_edges(above, x, rows_with(edges[2][x], kFirstZ << 7), 2);
      above.add(x, rows_with(edges[2][x], kFirstZ << 6) << 1);
    }
  }

 private:
  /// Bit y is set if the row has one of `bits`.
  static std::uint32_t rows_with(std::uint64_t word, std::uint64_t bits) {
    word &= bits;
    word |= word >> 4;
    word |= word >> 2;
    word |= word >> 1;
    return static_cast<std::uint32_t>(((word & 0x0101010101010101u) * 0x0102040810204080u) >> 56);
  }

  /// Rows of the stencils of edges along `axis` that start in `rows` (bit y) of layer x.
  static void add_edges(RowMask& mask, int x, std::uint32_t rows, int axis) {
    const std::uint32_t own = rows << 1, around = rows | (rows << 1) | (rows << 2);
    if (axis == 0) {
      mask.add(x - 1, own);
      mask.add(x, around);
      mask.add(x + 1, around);
      mask.add(x + 2, own);
    } else if (axis == 1) {
      mask.add(x - 1, own | (own << 1));
      mask.add(x, around | (rows << 3));
      mask.add(x + 1, own | (own << 1));
    } else {
      mask.add(x - 1, own);
      mask.add(x, around);
      mask.add(x + 1, own);
    }
  }
};

/// A leaf's samples and its neighbours' from one step below it to two beyond, at strides of kX, kY and 1, as far as its
/// stencils read them. Samples that are no data are infinite or not less than the background in magnitude.
class Apron {
 public:
  static constexpr int kX = 11 * 16, kY = 16;
  static constexpr int kStride[3] = {kX, kY, 1};
  static constexpr int index(int x, int y, int z) { return kX * (x + 1) + kY * (y + 1) + (z + 4); }

  /// `masked`: samples that are not active are no data. It is not asked of level sets, where all but the band has the
  /// background's magnitude.
  Apron(const LeafTable& table, std::size_t leaf, const std::array<BlockMask, 3>& edges, bool masked)
      : table_(table), leaf_(leaf), masked_(masked) {
    const RowsNeeded needed(edges);
    for (int x = -1; x < 10; ++x)
      for (std::uint32_t rows = needed.any.y[x + 1]; rows != 0; rows &= rows - 1) {
        const int y = std::countr_zero(rows) - 1;
        gather_row(x, y, needed.below.has(x, y), needed.above.has(x, y));
      }
  }

  const float* values() const { return values_; }

 private:
  struct Source {
    const float* values = nullptr;  ///< of the leaf there; null for none
    bool known = false;
    BlockMask active;
  };

  const Source& source(int slot) {
    Source& result = sources_[slot];
    if (result.known) return result;
    result.known = true;
    const std::int32_t there = table_.neighbour(leaf_, slot / 9 - 1, slot / 3 % 3 - 1, slot % 3 - 1);
    if (there >= 0) {
      result.values = table_.values(static_cast<std::size_t>(there));
      if (masked_) result.active = table_.active(static_cast<std::size_t>(there));
    }
    return result;
  }

  void gather_row(int x, int y, bool below, bool above) {
    const int column = 9 * ((x >> 3) + 1) + 3 * ((y >> 3) + 1), row = 64 * (x & 7) + 8 * (y & 7);
    float* at = values_ + index(x, y, 0);
    const Source& own = source(column + 1);
    if (own.values)
      std::memcpy(at, own.values + row, 8 * sizeof(float));
    else
      std::fill(at, at + 8, kNoData);
    if (below) {
      const Source& before = source(column);
      at[-1] = before.values ? before.values[row + 7] : kNoData;
    }
    if (above) {
      const Source& after = source(column + 2);
      at[8] = after.values ? after.values[row] : kNoData;
      at[9] = after.values ? after.values[row + 1] : kNoData;
    }
    if (masked_) drop_inactive(column, row, at);
  }

  void drop_inactive(int column, int row, float* at) {
    const auto inactive = [&](int slot, int z) {
      return sources_[slot].values && !test(sources_[slot].active, row + z);
    };
    if (inactive(column, 7)) at[-1] = kNoData;
    for (int z = 0; z < 8; ++z)
      if (inactive(column + 1, z)) at[z] = kNoData;
    for (int z = 0; z < 2; ++z)
      if (inactive(column + 2, z)) at[8 + z] = kNoData;
  }

  const LeafTable& table_;
  const std::size_t leaf_;
  const bool masked_;
  Source sources_[27];
  alignas(64) float values_[11 * kX];
};

SignLeaf sign_leaf(const LeafTable& table, std::size_t leaf) {
  SignLeaf result{};
  result.inside = table.inside(leaf);
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t there = table.neighbour(leaf, axis == 0, axis == 1, axis == 2);
    result.beyond[axis] = there >= 0                ? first_layer(table.inside(static_cast<std::size_t>(there)), axis)
                          : there == kUniformInside ? ~std::uint64_t{0}
                                                    : 0;
  }
  return result;
}

/// What sampling needs to know of the whole volume.
struct Volume : SampledVolume {
  edge_kernels::Sample* sample;
};

/// Writes the crossings of one leaf, each as `make` turns it from an EdgeCrossing.
template <class Crossing, class Make>
void sample_leaf(const Volume& volume, std::size_t leaf, const std::array<BlockMask, 3>& edges, Crossing* out,
                 Make&& make) {
  const Apron apron(volume.table, leaf, edges, volume.masked);
  const InsideRule& rule = volume.table.rule();
  edge_kernels::Edges batch;
  for (int axis = 0; axis < 3; ++axis) {
    batch.count = 0;
    for_each_bit(edges[axis], [&](int sample) {
      batch.at[batch.count++] = Apron::index(sample >> 6, (sample >> 3) & 7, sample & 7);
    });
    volume.sample(apron.values(), Apron::kStride[axis], Apron::kStride[(axis + 1) % 3],
                  Apron::kStride[(axis + 2) % 3], rule.isovalue, rule.scale, batch);
    for (int i = 0; i < batch.count; ++i) {
      EdgeCrossing crossing{batch.offset[i], {}};
      for (int a = 0; a < 3; ++a) crossing.normal[(axis + a) % 3] = batch.normal[a][i];
      if (!(batch.largest[i] < volume.data_below)) {
        const int place = batch.at[i];
        crossing = IncompleteStencil(volume, leaf).sample(place / Apron::kX - 1, place / Apron::kY % 11 - 1,
                                                          place % Apron::kY - 4, axis);
      }
      *out++ = make(crossing);
    }
  }
}

/// A leaf that owns crossings: its place in the result's order.
struct LiveLeaf {
  std::array<std::int32_t, 3> lower;
  std::uint32_t leaf;
  bool operator<(const LiveLeaf& other) const { return lower < other.lower; }
};

/// The samples that the next leaf's stencils read: they lie where no machine can guess, and waiting for them costs more
/// than the arithmetic. The neighbours along z are leaves that come next or came before.
void prefetch(const LeafTable& table, std::size_t leaf) {
  const auto lines = [&](int dx, int dy, int first, int stride, int count) {
    const std::int32_t there = table.neighbour(leaf, dx, dy, 0);
    if (there < 0) return;
    const float* values = table.values(static_cast<std::size_t>(there)) + first;
    for (int i = 0; i < count; ++i) __builtin_prefetch(values + stride * i);
  };
  constexpr int kLine = 16;  // samples
  lines(0, 0, 0, kLine, 32);
  lines(1, 0, 0, kLine, 8);              // layers 0 and 1
  lines(-1, 0, 7 * 64, kLine, 4);        // layer 7
  lines(0, 1, 0, 64, 8);                 // rows 0 and 1 of each layer
  lines(0, -1, 7 * 8, 64, 8);            // row 7
}

template <class Crossing, class Make>
SparseHermite<Crossing> sample(const LevelSet& level_set, double isovalue, RunContext& context, Make&& make) {
  SparseHermite<Crossing> result;
  result.placement = placement_of(*level_set.grid().grid);
  const LeafTable table = [&] {
    Stage stage(context, "read signs");
    return LeafTable(level_set, isovalue, context);
  }();
  const Volume volume{sampled_volume(table, level_set), edge_kernels::chosen()};
  Stage stage(context, "Hermite data from the level set");
  result.outermost_inside = table.rule()(table.tree().background());

  std::vector<std::uint16_t> counts(table.size());
  parallel_blocks(table.size(), context, [&](std::size_t i) {
    int crossings = 0;
    for (const BlockMask& axis : crossing_edges(sign_leaf(table, i))) crossings += count(axis);
    counts[i] = static_cast<std::uint16_t>(crossings);
  });
  std::vector<LiveLeaf> live;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (counts[i] == 0) continue;
    const openvdb::Coord lower = table.lower(i);
    live.push_back({{lower.x(), lower.y(), lower.z()}, static_cast<std::uint32_t>(i)});
  }
  tbb::parallel_sort(live.begin(), live.end());
  std::vector<std::uint64_t> first(live.size());
  for (std::size_t i = 0; i < live.size(); ++i) first[i] = counts[live[i].leaf];
  result.crossings.resize(exclusive_scan(first, "edge crossings"));
  result.leaves.resize(live.size());
  parallel_blocks(live.size(), context, [&](std::size_t i) {
    if (i + 1 < live.size()) prefetch(table, live[i + 1].leaf);
    SignLeaf leaf = sign_leaf(table, live[i].leaf);
    leaf.lower = live[i].lower;
    leaf.first = static_cast<std::uint32_t>(first[i]);
    sample_leaf(volume, live[i].leaf, crossing_edges(leaf), result.crossings.data() + first[i], make);
    result.leaves[i] = leaf;
  });
  return result;
}

}  // namespace

FloatHermite sample_level_set(const LevelSet& level_set, double isovalue, RunContext& context) {
  return sample<EdgeCrossing>(level_set, isovalue, context, [](const EdgeCrossing& crossing) { return crossing; });
}

PackedHermite sample_level_set_packed(const LevelSet& level_set, double isovalue, NormalCodeId code,
                                      RunContext& context) {
  PackedHermite result = with_normal_code(code, [&](auto chosen) {
    return sample<PackedCrossing>(level_set, isovalue, context,
                                  [](const EdgeCrossing& crossing) { return pack<decltype(chosen)>(crossing); });
  });
  result.normal_code = code;
  return result;
}

}  // namespace hermesh
