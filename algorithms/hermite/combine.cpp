#include "algorithms/hermite/combine.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/hermite/normal_codes.h"

namespace hermesh {
namespace {

using Lower = std::array<std::int32_t, 3>;
using Leaves = LargeArray<SignLeaf>;

/// Approximate number of leaves of each operand in a chunk: about 0.1 ms of work, enough for a task.
constexpr std::size_t kLeavesPerChunk = 512;
constexpr std::size_t kCrossingsPerChunk = std::size_t{1} << 16;

// Leaves are in ascending order of (x, y, z), so those of a column along z follow one another.
bool before(const SignLeaf& leaf, const Lower& lower) { return leaf.lower < lower; }

/// Returns the number of the first leaf that is not before `lower`.
std::size_t first_not_before(const Leaves& leaves, const Lower& lower) {
  return static_cast<std::size_t>(std::lower_bound(leaves.begin(), leaves.end(), lower, before) -
                                  leaves.begin());
}

/// Returns the number of the first of the leaves `begin` to `end` that is not before `lower`, by doubling
/// steps and then bisection: the time grows with the logarithm of the distance to the answer.
std::size_t first_not_before(const Leaves& leaves, std::size_t begin, std::size_t end, const Lower& lower) {
  std::size_t step = 1;
  while (begin + step < end && leaves[begin + step].lower < lower) {
    begin += step;
    step *= 2;
  }
  const auto first = leaves.begin();
  const auto last = first + static_cast<std::ptrdiff_t>(std::min(begin + step, end));
  return static_cast<std::size_t>(
      std::lower_bound(first + static_cast<std::ptrdiff_t>(begin), last, lower, before) - first);
}

bool same_column(const SignLeaf& a, const SignLeaf& b) {
  return a.lower[0] == b.lower[0] && a.lower[1] == b.lower[1];
}

template <class Crossing>
std::size_t first_crossing(const SparseHermite<Crossing>& hermite, std::size_t leaf) {
  return leaf < hermite.leaves.size() ? hermite.leaves[leaf].first : hermite.crossings.size();
}

SignLeaf combined_signs(const BooleanRule& rule, const SignLeaf& a, const SignLeaf& b) {
  SignLeaf result;
  result.lower = a.lower;
  result.first = 0;
  for (int x = 0; x < 8; ++x) result.inside[x] = rule.inside(a.inside[x], b.inside[x]);
  for (int axis = 0; axis < 3; ++axis) result.beyond[axis] = rule.inside(a.beyond[axis], b.beyond[axis]);
  return result;
}

void turn(SignLeaf& leaf) {
  for (std::uint64_t& word : leaf.inside) word = ~word;
  for (std::uint64_t& word : leaf.beyond) word = ~word;
}

std::uint32_t count_crossings(const SignLeaf& leaf) {
  int sum = 0;
  for (const BlockMask& axis : crossing_edges(leaf)) sum += count(axis);
  return static_cast<std::uint32_t>(sum);
}

/// Count, scan, fill over chunks of whole columns. The first pass merges the two sequences of leaves into
/// runs from one operand or both, and counts; the second writes.
template <class Code>
class Combination {
 public:
  using Crossing = typename Code::Crossing;
  using Hermite = SparseHermite<Crossing>;

  Combination(Boolean boolean, const Hermite& a, const Hermite& b) : rule_(boolean), a_(a), b_(b) {}

  Hermite result(RunContext& context) {
    Hermite result;
    result.placement = a_.placement;
    result.normal_code = a_.normal_code;
    result.outermost_inside = (rule_.inside(a_.outermost_inside, b_.outermost_inside) & 1) != 0;
    // Count. A chunk is whole columns, since the sign of a missing leaf depends on the previous leaf in its
    // column.
    std::vector<Chunk> chunks = chunks_of_columns();
    parallel_blocks(
        chunks.size(), context, [&](std::size_t i) { merge(chunks[i]); }, 1);
    // Scan: the sums of the previous chunks are the chunk's position in the result.
    std::size_t leaves = 0, crossings = 0;
    for (Chunk& chunk : chunks) {
      leaves += std::exchange(chunk.leaves, leaves);
      crossings += std::exchange(chunk.crossings, crossings);
    }
    if (crossings > std::numeric_limits<std::uint32_t>::max())
      throw Error("the combined Hermite data would have " + std::to_string(crossings) +
                  " crossings, more than 32 bits can number; use larger voxels");
    // Fill.
    result.leaves.resize(leaves);
    result.crossings.resize(crossings);
    parallel_blocks(
        chunks.size(), context, [&](std::size_t i) { fill(chunks[i], result); }, 1);
    return result;
  }

 private:
  enum class From { a, b, both };
  /// Consecutive leaves: in `a` from leaf number `a`, in `b` from number `b`, or in both.
  struct Run {
    From from;
    std::size_t a, b, count;
  };
  struct Chunk {
    std::size_t a_begin, a_end, b_begin, b_end;
    std::vector<Run> runs;
    std::size_t leaves = 0,
                crossings = 0;  ///< sizes of its part of the result, then sums of the previous chunks
  };

  /// Divides both operands at the columns of every 512th leaf of either operand.
  std::vector<Chunk> chunks_of_columns() const {
    std::vector<Lower> cuts;
    for (const Leaves* leaves : {&a_.leaves, &b_.leaves})
      for (std::size_t i = 0; i < leaves->size(); i += kLeavesPerChunk) {
        const Lower& lower = (*leaves)[i].lower;
        // The least z is the beginning of the column.
        cuts.push_back({lower[0], lower[1], std::numeric_limits<std::int32_t>::min()});
      }
    std::sort(cuts.begin(), cuts.end());
    cuts.erase(std::unique(cuts.begin(), cuts.end()), cuts.end());
    std::vector<Chunk> chunks(cuts.size());
    // From the back, where the end of a chunk is the beginning of the next one. The first division is at the
    // first leaf of either operand.
    std::size_t a_end = a_.leaves.size(), b_end = b_.leaves.size();
    for (std::size_t i = cuts.size(); i-- > 0;) {
      chunks[i].a_end = a_end, chunks[i].b_end = b_end;
      a_end = chunks[i].a_begin = first_not_before(a_.leaves, cuts[i]);
      b_end = chunks[i].b_begin = first_not_before(b_.leaves, cuts[i]);
    }
    return chunks;
  }

  void merge(Chunk& chunk) const {
    std::size_t i = chunk.a_begin, j = chunk.b_begin;
    while (i < chunk.a_end || j < chunk.b_end) {
      const bool a_ends = i == chunk.a_end, b_ends = j == chunk.b_end;
      // Leaves at the same position are combined sample by sample; a run of leaves of one operand, up to the
      // next leaf of the other, is preserved or dropped as a whole.
      if (!a_ends && !b_ends && a_.leaves[i].lower == b_.leaves[j].lower) {
        add_both(chunk, i++, j++);
      } else if (b_ends || (!a_ends && a_.leaves[i].lower < b_.leaves[j].lower)) {
        const std::size_t end =
            b_ends ? chunk.a_end : first_not_before(a_.leaves, i, chunk.a_end, b_.leaves[j].lower);
        const SignLeaf* last_of_b = j > chunk.b_begin ? &b_.leaves[j - 1] : nullptr;
        add_from_one(chunk, From::a, a_, i, end, last_of_b, b_.outermost_inside);
        i = end;
      } else {
        const std::size_t end =
            a_ends ? chunk.b_end : first_not_before(b_.leaves, j, chunk.b_end, a_.leaves[i].lower);
        const SignLeaf* last_of_a = i > chunk.a_begin ? &a_.leaves[i - 1] : nullptr;
        add_from_one(chunk, From::b, b_, j, end, last_of_a, a_.outermost_inside);
        j = end;
      }
    }
  }

  /// Adds leaves `begin` to `end` of one operand, where the other has none. In the column of the other's
  /// previous leaf it has the sign beyond this leaf, and further on that of infinity.
  void add_from_one(Chunk& chunk, From from, const Hermite& own, std::size_t begin, std::size_t end,
                    const SignLeaf* last_of_other, bool outermost) const {
    std::size_t end_of_column = begin;
    if (last_of_other && same_column(*last_of_other, own.leaves[begin])) {
      const Lower& lower = own.leaves[begin].lower;
      // The greatest integer is not a multiple of 8, so no leaf starts there.
      end_of_column = first_not_before(own.leaves, begin, end,
                                       {lower[0], lower[1], std::numeric_limits<std::int32_t>::max()});
      // Beyond its last leaf in the column the sign is the same over the whole layer.
      const bool sign = (last_of_other->beyond[2] & 1) != 0;
      if (keeps(from, sign)) add_run(chunk, from, own, begin, end_of_column);
    }
    if (end_of_column < end && keeps(from, outermost)) add_run(chunk, from, own, end_of_column, end);
  }

  bool keeps(From from, bool sign_of_other) const {
    return from == From::a ? rule_.keeps_a(sign_of_other) : rule_.keeps_b(sign_of_other);
  }

  void add_run(Chunk& chunk, From from, const Hermite& own, std::size_t begin, std::size_t end) const {
    append(chunk, {from, begin, begin, end - begin});
    chunk.leaves += end - begin;
    // By subtraction, without reading the run's leaves.
    chunk.crossings += first_crossing(own, end) - first_crossing(own, begin);
  }

  void add_both(Chunk& chunk, std::size_t i, std::size_t j) const {
    const std::uint32_t crossings = count_crossings(combined_signs(rule_, a_.leaves[i], b_.leaves[j]));
    // Leaves without a crossing edge are omitted, or equal data could differ.
    if (crossings == 0) return;
    append(chunk, {From::both, i, j, 1});
    chunk.leaves += 1;
    chunk.crossings += crossings;
  }

  static void append(Chunk& chunk, const Run& run) {
    if (!chunk.runs.empty()) {
      Run& last = chunk.runs.back();
      // A run that continues the previous one becomes part of it, so fill() copies in one piece.
      if (last.from == run.from && last.a + last.count == run.a && last.b + last.count == run.b) {
        last.count += run.count;
        return;
      }
    }
    chunk.runs.push_back(run);
  }

  void fill(const Chunk& chunk, Hermite& result) const {
    SignLeaf* leaf = result.leaves.data() + chunk.leaves;
    std::size_t crossing = chunk.crossings;
    for (const Run& run : chunk.runs) {
      if (run.from == From::both) {
        for (std::size_t i = 0; i < run.count; ++i)
          crossing = write_both(run.a + i, run.b + i, leaf[i], result.crossings.data(), crossing);
      } else if (run.from == From::a) {
        crossing = write_one(a_, run.a, run.count, false, leaf, result.crossings.data(), crossing);
      } else {
        crossing = write_one(b_, run.b, run.count, rule_.turns_b(), leaf, result.crossings.data(), crossing);
      }
      leaf += run.count;
    }
  }

  static std::size_t write_one(const Hermite& from, std::size_t begin, std::size_t count, bool turned,
                               SignLeaf* leaf, Crossing* crossings, std::size_t first) {
    const std::size_t source = first_crossing(from, begin), end = first_crossing(from, begin + count);
    // Unless it is complemented, the run is copied; the numbers of first crossings change by a constant.
    std::memcpy(leaf, from.leaves.data() + begin, count * sizeof(SignLeaf));
    // Modulo 2³², so correct also if `source` is greater.
    const auto shift = static_cast<std::uint32_t>(first - source);
    for (std::size_t i = 0; i < count; ++i) {
      leaf[i].first += shift;
      if (turned) turn(leaf[i]);
    }
    if (turned)
      std::transform(from.crossings.begin() + static_cast<std::ptrdiff_t>(source),
                     from.crossings.begin() + static_cast<std::ptrdiff_t>(end), crossings + first,
                     Code::negated);
    else if (end > source)
      std::memcpy(crossings + first, from.crossings.data() + source, (end - source) * sizeof(Crossing));
    return first + (end - source);
  }

  std::size_t write_both(std::size_t i, std::size_t j, SignLeaf& leaf, Crossing* crossings,
                         std::size_t first) const {
    leaf = combined_signs(rule_, a_.leaves[i], b_.leaves[j]);
    leaf.first = static_cast<std::uint32_t>(first);
    const std::array<BlockMask, 3> edges = crossing_edges(leaf), edges_a = crossing_edges(a_.leaves[i]),
                                   edges_b = crossing_edges(b_.leaves[j]);
    Sources from{a_.crossings.data() + a_.leaves[i].first, b_.crossings.data() + b_.leaves[j].first};
    Crossing* to = crossings + first;
    for (int axis = 0; axis < 3; ++axis)
      for (int x = 0; x < 8; ++x)
        to = write_edges(from, edges_a[axis][x], edges_b[axis][x], edges[axis][x], leaf.inside[x], to);
    return static_cast<std::size_t>(to - crossings);
  }

  struct Sources {
    const Crossing *a, *b;
  };

  /// Writes the crossings of the 64 edges of one word, given those crossed by `a`, by `b`, and in the result,
  /// and the result's signs at their first samples.
  Crossing* write_edges(Sources& from, std::uint64_t a, std::uint64_t b, std::uint64_t kept,
                        std::uint64_t inside, Crossing* to) const {
    // No edge of the word is in the result: skip the crossings of both operands.
    if (kept == 0) {
      from.a += std::popcount(a);
      from.b += std::popcount(b);
      return to;
    }
    for (std::uint64_t left = a | b; left != 0; left &= left - 1) {
      // In order of the samples, so that both cursors advance with the bits and no rank is computed.
      const std::uint64_t bit = left & (~left + 1);
      const bool in_a = (a & bit) != 0, in_b = (b & bit) != 0;
      if (kept & bit) *to++ = taken(from, in_a, in_b, (inside & bit) != 0);
      from.a += in_a;
      from.b += in_b;
    }
    return to;
  }

  /// Returns the crossing of the result. The crossing operands are unpredictable, so the only branch is on
  /// equal offsets.
  Crossing taken(const Sources& from, bool in_a, bool in_b, bool first_inside) const {
    // If one operand crosses the edge, its crossing replaces the other's, which is not read.
    const Crossing* const of_a = in_a ? from.a : from.b;
    const Crossing* const of_b = in_b ? from.b : from.a;
    const bool both = in_a & in_b;
    bool takes_b = (!in_a) | (in_b & rule_.template prefers_offset_of_b<Code>(*of_a, *of_b, first_inside));
    if (both & (Code::offset(*of_a) == Code::offset(*of_b)))
      takes_b = rule_.template prefers_normal_of_b<Code>(*of_a, *of_b);
    const Crossing crossing = *(takes_b ? of_b : of_a);
    return (takes_b & rule_.turns_b()) ? Code::negated(crossing) : crossing;
  }

  BooleanRule rule_;
  const Hermite &a_, &b_;
};

/// Calls f(crossing code) with the code of the grid's crossings.
template <class Crossing, class F>
auto with_crossing_code(const SparseHermite<Crossing>& hermite, F&& f) {
  if constexpr (std::is_same_v<Crossing, EdgeCrossing>)
    return f(FloatCrossingCode{});
  else
    return with_normal_code(hermite.normal_code,
                            [&](auto code) { return f(PackedCrossingCode<decltype(code)>{}); });
}

template <class Crossing>
void check_comparable(const SparseHermite<Crossing>& a, const SparseHermite<Crossing>& b) {
  if (!same_lattice(a.placement, b.placement))
    throw Error("Hermite data on different lattices cannot be combined; sample both with the same voxels");
  if (std::is_same_v<Crossing, PackedCrossing> && a.normal_code != b.normal_code)
    throw Error("Hermite data with normals in the codes " + std::string(name(a.normal_code)) + " and " +
                std::string(name(b.normal_code)) + " cannot be combined; pack both in the same code");
}

}  // namespace

template <class Crossing>
SparseHermite<Crossing> combine(Boolean boolean, const SparseHermite<Crossing>& a,
                                const SparseHermite<Crossing>& b, RunContext& context) {
  check_comparable(a, b);
  Stage stage(context, "combine Hermite data");
  return with_crossing_code(
      a, [&](auto code) { return Combination<decltype(code)>(boolean, a, b).result(context); });
}

template <class Crossing>
SparseHermite<Crossing> complement(SparseHermite<Crossing> hermite, RunContext& context) {
  Stage stage(context, "complement Hermite data");
  hermite.outermost_inside = !hermite.outermost_inside;
  with_crossing_code(hermite, [&](auto code) {
    using Code = decltype(code);
    const auto in_chunks = [&](auto& array, std::size_t size, auto&& change) {
      const auto change_chunk = [&](std::size_t chunk) {
        const std::size_t end = std::min(array.size(), (chunk + 1) * size);
        for (std::size_t i = chunk * size; i < end; ++i) change(array[i]);
      };
      parallel_blocks((array.size() + size - 1) / size, context, change_chunk, 1);
    };
    in_chunks(hermite.leaves, kLeavesPerChunk, turn);
    in_chunks(hermite.crossings, kCrossingsPerChunk,
              [](Crossing& crossing) { crossing = Code::negated(crossing); });
  });
  return hermite;
}

template FloatHermite combine(Boolean, const FloatHermite&, const FloatHermite&, RunContext&);
template PackedHermite combine(Boolean, const PackedHermite&, const PackedHermite&, RunContext&);
template FloatHermite complement(FloatHermite, RunContext&);
template PackedHermite complement(PackedHermite, RunContext&);

}  // namespace hermesh
