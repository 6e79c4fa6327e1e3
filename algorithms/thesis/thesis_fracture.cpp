#include "algorithms/thesis/thesis_fracture.h"

#include <algorithm>
#include <chrono>
#include <limits>

#include "algorithms/core/parallel.h"
#include "algorithms/core/run_context.h"
#include "algorithms/fracture/labelled_solid.h"
#include "algorithms/hermite/combine.h"
#include "algorithms/thesis/adaptive_dual_contouring/adaptive_dual_contouring.h"
#include "algorithms/thesis/voxels/dense_hermite.h"

namespace hermesh {
namespace {

using At = Cutters::At;
using Codes = std::array<CutCode, 512>;

/// A part of space as a solid: all blocks of a box around the object, those of the outermost layer being
/// outside of every solid.
class CodeSolid {
 public:
  CodeSolid(const FloatHermite& object, const Cutters& cutters, CutCode code)
      : placement_(object.placement), cutters_(cutters), code_(code) {
    At lower, upper;
    lower.fill(std::numeric_limits<std::int32_t>::max());
    upper.fill(std::numeric_limits<std::int32_t>::min());
    for (const SignLeaf& leaf : object.leaves)
      for (int a = 0; a < 3; ++a) {
        lower[a] = std::min(lower[a], leaf.lower[a]);
        upper[a] = std::max(upper[a], leaf.lower[a]);
      }
    for (int a = 0; a < 3; ++a) {
      // Two blocks more on every side: an empty layer, which closes the solid, and one between it and the
      // object, so that the closing faces do not intersect the object.
      first_[a] = lower[a] - 16;
      size_[a] = (upper[a] - lower[a]) / 8 + 5;
    }
    masks_.resize(std::size_t(size_[0]) * std::size_t(size_[1]) * std::size_t(size_[2]));
  }

  /// Computes signs of all blocks first, since an edge at a block's upper side needs those of the next block;
  /// then crossings.
  FloatHermite run(RunContext& context) {
    parallel_blocks(masks_.size(), context, [&](std::size_t b) {
      // Most blocks contain nothing of one cell among hundreds, and this test is far cheaper than all their
      // codes.
      if (is_border(b) || !cutters_.may_hold(lower_of(b), code_)) return;
      Codes codes;
      cutters_.codes(lower_of(b), codes);
      for (int i = 0; i < 512; ++i)
        if (codes[static_cast<std::size_t>(i)] == code_) masks_[b][i >> 6] |= std::uint64_t{1} << (i & 63);
    });
    std::vector<std::vector<EdgeCrossing>> crossings(masks_.size());
    std::vector<SignLeaf> leaves(masks_.size());
    parallel_blocks(masks_.size(), context, [&](std::size_t b) {
      leaves[b] = leaf_at(b);
      const std::array<BlockMask, 3> edges = crossing_edges(leaves[b]);
      if (any(edges[0]) || any(edges[1]) || any(edges[2])) crossings[b] = crossings_of(leaves[b], edges);
    });
    FloatHermite result;
    result.placement = placement_;
    // Blocks in lexicographic order, as in SparseHermite.
    for (std::size_t b = 0; b < masks_.size(); ++b) {
      if (crossings[b].empty()) continue;
      leaves[b].first = static_cast<std::uint32_t>(result.crossings.size());
      result.leaves.push_back(leaves[b]);
      result.crossings.insert(result.crossings.end(), crossings[b].begin(), crossings[b].end());
    }
    return result;
  }

 private:
  /// Returns the position of a block in the box, in blocks.
  std::array<std::int32_t, 3> place(std::size_t b) const {
    const auto y = static_cast<std::size_t>(size_[1]), z = static_cast<std::size_t>(size_[2]);
    return {static_cast<std::int32_t>(b / (y * z)), static_cast<std::int32_t>(b / z % y),
            static_cast<std::int32_t>(b % z)};
  }
  /// Returns the index coordinates of a block's first sample.
  At lower_of(std::size_t b) const {
    const auto p = place(b);
    return {first_[0] + 8 * p[0], first_[1] + 8 * p[1], first_[2] + 8 * p[2]};
  }
  /// Returns true if a block is in the outermost layer.
  bool is_border(std::size_t b) const {
    const auto p = place(b);
    for (int a = 0; a < 3; ++a)
      if (p[a] == 0 || p[a] == size_[a] - 1) return true;
    return false;
  }

  /// Returns a block's signs, with those of the first samples beyond its upper sides.
  SignLeaf leaf_at(std::size_t b) const {
    SignLeaf leaf{lower_of(b), 0, masks_[b], {}};
    const std::size_t steps[3] = {std::size_t(size_[1]) * std::size_t(size_[2]), std::size_t(size_[2]), 1};
    const auto p = place(b);
    for (int axis = 0; axis < 3; ++axis)
      if (p[axis] + 1 < size_[axis]) leaf.beyond[axis] = first_layer(masks_[b + steps[axis]], axis);
    return leaf;
  }

  /// Returns the crossings of a block's edges by axis and sample, the order of Hermite data.
  std::vector<EdgeCrossing> crossings_of(const SignLeaf& leaf, const std::array<BlockMask, 3>& edges) const {
    // Codes of the block itself, last, and of its upper neighbour along each axis.
    std::array<Codes, 4> codes;
    cutters_.codes(leaf.lower, codes[3]);
    std::vector<EdgeCrossing> result;
    for (int axis = 0; axis < 3; ++axis) {
      At next = leaf.lower;
      next[axis] += 8;
      cutters_.codes(next, codes[axis]);
      for_each_bit(edges[axis], [&](int sample) {
        int to[3] = {sample >> 6, (sample >> 3) & 7, sample & 7};
        ++to[axis];
        const auto there = static_cast<std::size_t>(sample_index(to[0] & 7, to[1] & 7, to[2] & 7));
        const CutCode first = codes[3][static_cast<std::size_t>(sample)],
                      second = codes[to[axis] > 7 ? axis : 3][there];
        result.push_back(crossing(leaf, sample, axis, first, second));
      });
    }
    return result;
  }

  /// Returns a crossing, whose normal points out of the solid. Where the box closes the solid there is no
  /// cutter, and the middle of the edge is used.
  EdgeCrossing crossing(const SignLeaf& leaf, int sample, int axis, CutCode first, CutCode second) const {
    const At at{leaf.lower[0] + (sample >> 6), leaf.lower[1] + ((sample >> 3) & 7),
                leaf.lower[2] + (sample & 7)};
    EdgeCrossing result{0.5f, {}};
    result.normal[axis] = 1.0f;
    if (first != second)
      if (const auto found = cutters_.crossing(at, axis, first, second)) result = found->crossing;
    const bool inside_first = test(leaf.inside, sample);
    // The normal points along the edge from inside to outside. A cutter does not know which of its sides the
    // solid is on.
    if ((result.normal[axis] >= 0) != inside_first)
      for (float& n : result.normal) n = -n;
    return result;
  }

  const IndexToWorld placement_;
  const Cutters& cutters_;
  const CutCode code_;
  At first_{};
  std::array<std::int32_t, 3> size_{};
  std::vector<BlockMask> masks_;
};

/// Converts the data to the form that a rule combines.
template <class Data>
Data converted(const FloatHermite& hermite, RunContext& context) {
  if constexpr (std::is_same_v<Data, ThesisDense>)
    return to_dense<ThesisVoxel>(hermite, context);
  else
    return hermite;
}

bool is_empty(const FloatHermite& hermite) { return hermite.leaves.empty(); }
bool is_empty(const ThesisDense& hermite) { return hermite.leaves() == 0; }

/// The sequential steps of §7.1, on grids of one form.
template <class Data>
class InTurn {
 public:
  InTurn(const FloatHermite& object, const Cutters& cutters, double threshold,
         const std::function<void(ThesisPiece&&)>& hand_over, RunContext& context)
      : object_(object),
        cutters_(cutters),
        threshold_(threshold),
        hand_over_(hand_over),
        context_(context),
        rest_(converted<Data>(object, context)) {
    // The statistics of the meshes are summed here, so that there is one note for all pieces.
    meshing_.cancel = context.cancel;
  }

  void run() {
    // Solids have Hermite data of their own; planes and Voronoi cells are made into solids code by code.
    const bool solids = cutters_.count() > 0 && !cutters_.plane_sides() && cutters_.signs(0, {}).has_value();
    std::vector<CutCode> codes = codes_within(object_, cutters_, context_);
    if (solids) {  // each is a solid of its own, and the rest belongs to no cutter
      codes.resize(cutters_.count());
      for (std::size_t k = 0; k < codes.size(); ++k) codes[k] = k;
    }
    for (std::size_t i = 0; i < codes.size(); ++i) {
      context_.check();
      take(codes[i], solids);
      context_.progress("fracture", double(i + 1) / double(codes.size()));
    }
    if (!is_empty(rest_)) {
      Stopwatch watch;
      ThesisPiece last{"what no cutter takes", meshed(rest_), 0.0, 0.0, 0.0};
      last.extraction_seconds = watch.seconds();
      if (!last.mesh.empty()) hand_over_(std::move(last));
    }
    report();
  }

 private:
  /// Cuts one piece off, meshes it and hands it over.
  void take(CutCode code, bool solids) {
    ThesisPiece piece;
    piece.name = cutters_.name_of(code);
    Stopwatch watch;
    // The first step of §7.1: the cutter as a Hermite grid.
    FloatHermite made;
    if (!solids) made = solid_of_code(object_, cutters_, code, context_);
    const FloatHermite* const solid = solids ? cutters_.solid(code) : &made;
    Data cutter;
    if (solid) cutter = converted<Data>(*solid, context_);
    piece.conversion_seconds = watch.seconds();
    Data taken;
    if (solid) {
      // The second and the third: the rest is the object from now on.
      taken = combine(Boolean::intersect, rest_, cutter, context_);
      rest_ = combine(Boolean::subtract, std::move(rest_), std::move(cutter), context_);
    }
    piece.csg_seconds = watch.seconds();
    if (solid && !is_empty(taken)) piece.mesh = meshed(taken);
    piece.extraction_seconds = watch.seconds();
    hand_over_(std::move(piece));
  }

  /// Meshes a piece separately, by chapter 6: along a boundary its points may differ from those of the next
  /// piece.
  PolygonMesh meshed(const Data& piece) {
    return adaptive_dual_contouring(piece, {.threshold = threshold_}, nullptr, meshing_);
  }

  void report() {
    const auto sum = [&](const char* name) {
      double total = 0.0;
      for (const auto& [figure, value] : meshing_.figures) total += figure == name ? value : 0.0;
      context_.figure(name, total);
      return total;
    };
    sum("escaped");
    const double lost = sum("lost_crossings"), needless = sum("needless_crossings");
    if (lost + needless > 0)
      context_.note("in the 10-byte data of the pieces " + std::to_string(static_cast<std::uint64_t>(lost)) +
                    " crossings are missing, which leaves holes, and " +
                    std::to_string(static_cast<std::uint64_t>(needless)) +
                    " lie between samples of one sign, which makes polygons that bound nothing");
  }

  const FloatHermite& object_;
  const Cutters& cutters_;
  const double threshold_;
  const std::function<void(ThesisPiece&&)>& hand_over_;
  RunContext& context_;
  RunContext meshing_;
  Data rest_;  ///< the part that no cutter has taken yet
};

}  // namespace

FloatHermite solid_of_code(const FloatHermite& object, const Cutters& cutters, CutCode code,
                           RunContext& context) {
  return CodeSolid(object, cutters, code).run(context);
}

std::vector<CutCode> codes_within(const FloatHermite& object, const Cutters& cutters, RunContext& context) {
  LabelledSolid solid = whole_solid(object, context);
  label_by_codes(solid, cutters, context);
  return solid.code_values;
}

void thesis_fracture(const FloatHermite& object, const Cutters& cutters, const ThesisFractureOptions& options,
                     const std::function<void(ThesisPiece&&)>& hand_over, RunContext& context) {
  if (options.rule == ThesisFractureOptions::Rule::printed)
    InTurn<ThesisDense>(object, cutters, options.threshold, hand_over, context).run();
  else
    InTurn<FloatHermite>(object, cutters, options.threshold, hand_over, context).run();
}

}  // namespace hermesh
