#include "algorithms/labels/label_surface.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "algorithms/core/parallel.h"

namespace hermesh {
namespace {

/// Half the side of the window of columns, and the greatest height in it.
constexpr int kRadius = 3, kMostHeight = 5;
constexpr int kColumns = (2 * kRadius + 1) * (2 * kRadius + 1);
/// Weights of the squares of slopes and curvatures in the fit, so that those which no column determines are
/// 0.
constexpr double kSlopeRidge = 0.5, kCurvatureRidge = 2.0;
/// Least slope of a plane that determines a crossing on an edge across its height.
constexpr double kLeastSlope = 1e-3;

/// A column of the window, and the columns nearer to the middle that it may continue, as indices in
/// kWindow; −1 for none.
struct Column {
  int u, v;
  std::array<int, 2> before;
};

/// The columns of the window in order of their distance along the axes.
const std::array<Column, kColumns>& window() {
  static const auto columns = [] {
    std::array<Column, kColumns> result{};
    std::size_t n = 0;
    for (int u = -kRadius; u <= kRadius; ++u)
      for (int v = -kRadius; v <= kRadius; ++v) result[n++] = {u, v, {-1, -1}};
    std::ranges::stable_sort(result, {}, [](const Column& c) { return std::abs(c.u) + std::abs(c.v); });
    const auto number = [&](int u, int v) {
      return static_cast<int>(
          std::ranges::find_if(result, [&](const Column& c) { return c.u == u && c.v == v; }) -
          result.begin());
    };
    for (Column& c : result) {
      // The column along the longer side first.
      const int along_u = c.u == 0 ? -1 : number(c.u - (c.u > 0 ? 1 : -1), c.v),
                along_v = c.v == 0 ? -1 : number(c.u, c.v - (c.v > 0 ? 1 : -1));
      c.before = std::abs(c.u) >= std::abs(c.v) ? std::array{along_u, along_v} : std::array{along_v, along_u};
    }
    return result;
  }();
  return columns;
}

/// Labels of the samples around a block.
class LabelsAround {
 public:
  static constexpr int kLower = -1 - kMostHeight, kSide = 8 - 2 * kLower;
  static_assert(kLower >= -8 && kLower + kSide <= 16);
  static constexpr std::array<int, 3> kStep = {kSide * kSide, kSide, 1};

  template <class LabelAt>  // of a LatticePlace
  LabelsAround(const HermiteView::Block& block, LabelAt&& label_at) : labels_(kSide * kSide * kSide) {
    std::size_t n = 0;
    for (int x = kLower; x < kLower + kSide; ++x)
      for (int y = kLower; y < kLower + kSide; ++y)
        for (int z = kLower; z < kLower + kSide; ++z)
          labels_[n++] = label_at(locate(block.neighbours, x, y, z));
  }
  /// Returns the index of a sample of the block.
  static int index(int sample) {
    return ((sample >> 6) - kLower) * kStep[0] + (((sample >> 3) & 7) - kLower) * kStep[1] +
           ((sample & 7) - kLower);
  }
  std::uint32_t operator[](int index) const { return labels_[static_cast<std::size_t>(index)]; }

 private:
  std::vector<std::uint32_t> labels_;
};

using Terms = Eigen::Matrix<double, 6, 1>;
using NormalMatrix = Eigen::Matrix<double, 6, 6>;

/// The terms of a quadric over a column: 1, u, v, u², v², uv.
Terms terms_of(const Column& c) { return Terms(1.0, c.u, c.v, c.u * c.u, c.v * c.v, c.u * c.v); }
NormalMatrix ridge() {
  return Terms(0.0, kSlopeRidge, kSlopeRidge, kCurvatureRidge, kCurvatureRidge, kCurvatureRidge).asDiagonal();
}

/// Constants of the fit: the terms of each column, and the weights of the heights of a whole window for the
/// height and the slopes in the middle.
struct FitTables {
  std::array<Terms, kColumns> terms;
  Eigen::Matrix<double, 3, kColumns> weights;

  static const FitTables& get() {
    static const FitTables tables = [] {
      FitTables result;
      NormalMatrix normal = ridge();
      Eigen::Matrix<double, 6, kColumns> all;
      for (std::size_t i = 0; i < kColumns; ++i) {
        result.terms[i] = terms_of(window()[i]);
        normal += result.terms[i] * result.terms[i].transpose();
        all.col(static_cast<Eigen::Index>(i)) = result.terms[i];
      }
      const Eigen::Matrix<double, 6, kColumns> solution = normal.ldlt().solve(all);
      result.weights = solution.topRows<3>();
      return result;
    }();
    return tables;
  }
};

/// The quadric fitted to the height field around an edge.
struct Fit {
  int columns = 0;
  double height = 0.0;                      ///< at the edge, above its middle, along its axis
  std::array<double, 2> slope{};            ///< along the two axes after the edge's
  std::array<std::array<bool, 2>, 2> next;  ///< columns beside the edge that belong to the field, by these
                                            ///< axes, below and above
};

/// Fits the field of the edge from the sample `at`, whose ends have different labels.
Fit fit(const LabelsAround& labels, int at, int axis) {
  const int up = LabelsAround::kStep[static_cast<std::size_t>(axis)],
            u = LabelsAround::kStep[static_cast<std::size_t>((axis + 1) % 3)],
            v = LabelsAround::kStep[static_cast<std::size_t>((axis + 2) % 3)];
  const std::uint32_t behind = labels[at], front = labels[at + up];
  constexpr int kNone = 100;
  std::array<int, kColumns> heights;
  heights.fill(kNone);
  heights[0] = 0;
  Fit result{.columns = 1, .next = {}};
  bool flat = true;
  const std::array<Column, kColumns>& columns = window();
  for (std::size_t i = 1; i < kColumns; ++i) {
    const Column& column = columns[i];
    const int foot = at + column.u * u + column.v * v;
    int height = kNone;
    for (const int before : column.before) {
      if (before < 0 || heights[static_cast<std::size_t>(before)] == kNone) continue;
      for (const int step : {0, 1, -1}) {
        const int h = heights[static_cast<std::size_t>(before)] + step;
        if (std::abs(h) > kMostHeight) continue;
        const int place = foot + h * up;
        if (labels[place] != behind || labels[place + up] != front) continue;
        height = h;
        break;
      }
      if (height != kNone) break;
    }
    if (height == kNone) continue;
    heights[i] = height;
    ++result.columns;
    if (std::abs(column.u) + std::abs(column.v) == 1)
      result.next[column.v != 0][column.u + column.v > 0] = true;
    flat = flat && height == 0;
  }
  if (flat) return result;  // exactly
  const FitTables& tables = FitTables::get();
  Eigen::Vector3d quadric = Eigen::Vector3d::Zero();
  if (result.columns == kColumns) {
    for (std::size_t i = 0; i < kColumns; ++i)
      quadric += double(heights[i]) * tables.weights.col(static_cast<Eigen::Index>(i));
  } else {
    NormalMatrix normal = ridge();
    Terms right = Terms::Zero();
    for (std::size_t i = 0; i < kColumns; ++i) {
      if (heights[i] == kNone) continue;
      normal.selfadjointView<Eigen::Lower>().rankUpdate(tables.terms[i]);
      right += double(heights[i]) * tables.terms[i];
    }
    const Terms solution = normal.ldlt().solve(right);
    quadric = solution.head<3>();
  }
  result.height = quadric[0];
  result.slope = {quadric[1], quadric[2]};
  return result;
}

/// Returns the crossing of the edge from the sample `at` (index in `labels`), whose ends have different
/// labels; the normal towards the background, or from the first to the second label.
EdgeCrossing crossing_of(const LabelsAround& labels, int at, int axis, double distance) {
  const int up = LabelsAround::kStep[static_cast<std::size_t>(axis)];
  const std::uint32_t first = labels[at], second = labels[at + up];
  const auto finished = [&](double height, const Eigen::Vector3d& towards_second) {
    const Eigen::Vector3d n = (first == 0 ? -1.0 : 1.0) * towards_second.normalized();
    return EdgeCrossing{static_cast<float>(0.5 + std::clamp(height, -distance, distance)),
                        {static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2])}};
  };
  const auto normal_of = [](const Fit& plane, int along) {
    Eigen::Vector3d n;
    n[along] = 1.0;
    n[(along + 1) % 3] = -plane.slope[0];
    n[(along + 2) % 3] = -plane.slope[1];
    return n;
  };
  const Fit own = fit(labels, at, axis);
  int most = own.columns;
  double height = own.height;
  Eigen::Vector3d normal = normal_of(own, axis);
  if (own.columns == kColumns) return finished(height, normal);
  for (int other = 0; other < 3; ++other) {
    if (other == axis) continue;
    const int aside = LabelsAround::kStep[static_cast<std::size_t>(other)];
    const bool is_first_lateral = (other + 1) % 3 == axis;
    for (const int end : {0, 1})  // the end of this edge that the adjacent face of a voxel belongs to
      for (const int side : {1, -1}) {
        const int from = at + end * up, to = from + side * aside;
        if (labels[to] != (end == 0 ? second : first)) continue;
        const Fit plane = fit(labels, std::min(from, to), other);
        // The column through the other end of this edge must be a step of the field.
        if (plane.columns <= most || !plane.next[is_first_lateral ? 0 : 1][end == 0]) continue;
        const double slope = plane.slope[is_first_lateral ? 0 : 1];
        // Heights are along the axis, from the middle between `from` and `to`, which is half a step aside.
        const double here = -0.5 * side - plane.height;
        most = plane.columns;
        height = std::abs(slope) < kLeastSlope ? 0.0 : end - 0.5 + here / slope;
        normal = normal_of(plane, other);
        // Towards the second label, as the field's normal is if its upper side has that label.
        const bool second_above = (end == 0) == (side > 0);
        if (!second_above) normal = -normal;
      }
  }
  return finished(height, normal);
}

}  // namespace

LabelSurface::LabelSurface(const LabelMap& map, double distance, RunContext& context) : map_(map) {
  const Stage stage(context, "surfaces between labels");
  const auto lowers = with_those_below(map.lowers);
  blocks_.resize(lowers.size());
  parallel_blocks(lowers.size(), context, [&](std::size_t b) {
    HermiteView::Block& block = blocks_[b];
    block = {};
    block.lower = lowers[b];
    const auto found = std::ranges::lower_bound(map.lowers, lowers[b]);
    block.leaf = found != map.lowers.end() && *found == lowers[b]
                     ? static_cast<std::int32_t>(found - map.lowers.begin())
                     : -1;
    if (block.leaf < 0) return;
    for (int i = 0; i < 512; ++i)
      if (map.values(block.leaf, i) > 0)
        block.inside[static_cast<std::size_t>(i >> 6)] |= std::uint64_t{1} << (i & 63);
  });
  find_neighbours(blocks_, context);
  std::vector<std::uint64_t> counts(blocks_.size());
  find_edges(counts, context);
  const std::uint64_t total = exclusive_scan(counts, "edge crossings");
  first_.assign(counts.begin(), counts.end());
  crossings_.resize(total);
  parallel_blocks(
      blocks_.size(), context, [&](std::size_t b) { fill_block(b, distance); }, 4);
}

std::int32_t LabelSurface::block_at(const At& lower) const {
  const auto found = std::ranges::lower_bound(blocks_, lower, {}, &HermiteView::Block::lower);
  return found != blocks_.end() && found->lower == lower ? static_cast<std::int32_t>(found - blocks_.begin())
                                                         : -1;
}

/// Returns the label of a block's sample, or of the next one along an axis.
std::uint32_t LabelSurface::label(std::int32_t block, int sample, int axis) const {
  const LatticePlace at =
      locate(blocks_[static_cast<std::size_t>(block)].neighbours, (sample >> 6) + (axis == 0),
             ((sample >> 3) & 7) + (axis == 1), (sample & 7) + (axis == 2));
  if (at.block < 0) return 0;
  const std::int32_t leaf = blocks_[static_cast<std::size_t>(at.block)].leaf;
  return leaf < 0 ? 0 : map_.values(leaf, at.sample);
}

void LabelSurface::find_edges(std::vector<std::uint64_t>& counts, RunContext& context) {
  constexpr int kNoAxis = 3;
  const auto uniform = [&](std::int32_t block, std::uint32_t label) {
    if (block < 0) return label == 0;
    const std::int32_t leaf = blocks_[static_cast<std::size_t>(block)].leaf;
    return leaf < 0 ? label == 0 : map_.values.is_uniform(leaf) && map_.values(leaf, 0) == label;
  };
  parallel_blocks(blocks_.size(), context, [&](std::size_t b) {
    const auto block = static_cast<std::int32_t>(b);
    HermiteView::Block& own = blocks_[b];
    const std::uint32_t first = label(block, 0, kNoAxis);
    bool all = uniform(block, first);
    for (int axis = 0; axis < 3; ++axis)
      all = all &&
            uniform(own.neighbours[static_cast<std::size_t>(neighbour_slot(axis == 0, axis == 1, axis == 2))],
                    first);
    if (!all)
      for (int sample = 0; sample < 512; ++sample) {
        const std::uint32_t here = label(block, sample, kNoAxis);
        for (int axis = 0; axis < 3; ++axis)
          if (label(block, sample, axis) != here)
            own.crossing[static_cast<std::size_t>(axis)][static_cast<std::size_t>(sample >> 6)] |=
                std::uint64_t{1} << (sample & 63);
      }
    own.count_before();
    counts[b] = static_cast<std::uint64_t>(own.crossing_count());
  });
}

void LabelSurface::fill_block(std::size_t block, double distance) {
  const HermiteView::Block& own = blocks_[block];
  if (own.crossing_count() == 0) return;
  const LabelsAround labels(own, [&](const LatticePlace& at) -> std::uint32_t {
    if (at.block < 0) return 0;
    const std::int32_t leaf = blocks_[static_cast<std::size_t>(at.block)].leaf;
    return leaf < 0 ? 0 : map_.values(leaf, at.sample);
  });
  EdgeCrossing* out = crossings_.data() + first_[block];
  own.for_each([&](int axis, int sample) {
    *out++ = crossing_of(labels, LabelsAround::index(sample), axis, distance);
  });
}

FloatHermite LabelSurface::solid(RunContext& context) const {
  const Stage stage(context, "surface of all labels");
  FloatHermite result;
  result.placement = map_.placement;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    if (b % 1024 == 0) context.check();
    const HermiteView::Block& own = blocks_[b];
    if (own.crossing_count() == 0) continue;
    SignLeaf leaf{.lower = own.lower,
                  .first = static_cast<std::uint32_t>(result.crossings.size()),
                  .inside = own.inside,
                  .beyond = {}};
    for (int axis = 0; axis < 3; ++axis)
      if (const std::int32_t next =
              own.neighbours[static_cast<std::size_t>(neighbour_slot(axis == 0, axis == 1, axis == 2))];
          next >= 0)
        leaf.beyond[static_cast<std::size_t>(axis)] =
            first_layer(blocks_[static_cast<std::size_t>(next)].inside, axis);
    const std::array<BlockMask, 3> edges = crossing_edges(leaf);
    const EdgeCrossing* crossing = crossings_.data() + first_[b];
    own.for_each([&](int axis, int sample) {
      if (test(edges[static_cast<std::size_t>(axis)], sample)) result.crossings.push_back(*crossing);
      ++crossing;
    });
    if (result.crossings.size() > leaf.first) result.leaves.push_back(leaf);
  }
  return result;
}

void LabelSurface::codes(const At& lower, std::span<CutCode, 512> codes) const {
  const std::int32_t block = block_at(lower);
  const std::int32_t leaf = block < 0 ? -1 : blocks_[static_cast<std::size_t>(block)].leaf;
  for (int i = 0; i < 512; ++i) codes[static_cast<std::size_t>(i)] = leaf < 0 ? 0 : map_.values(leaf, i);
}

std::optional<CutCrossing> LabelSurface::crossing(const At& at, int axis, CutCode, CutCode) const {
  const At lower = {at[0] & ~7, at[1] & ~7, at[2] & ~7};
  const int sample = sample_index(at[0] & 7, at[1] & 7, at[2] & 7);
  const std::int32_t block = block_at(lower);
  if (block < 0) return std::nullopt;
  const HermiteView::Block& own = blocks_[static_cast<std::size_t>(block)];
  if (!test(own.crossing[static_cast<std::size_t>(axis)], sample)) return std::nullopt;
  return CutCrossing{crossings_[first_[static_cast<std::size_t>(block)] + own.rank(axis, sample)], -1};
}

std::optional<CutCrossing> LabelSurface::nearest(const At& at, int axis, CutCode first, CutCode) const {
  const At lower = {at[0] & ~7, at[1] & ~7, at[2] & ~7};
  const std::int32_t block = block_at(lower);
  if (block < 0) return std::nullopt;
  const std::uint32_t own = label(block, sample_index(at[0] & 7, at[1] & 7, at[2] & 7), 3);
  EdgeCrossing crossing{own == first ? 1.0f : 0.0f, {}};
  crossing.normal[static_cast<std::size_t>(axis)] = 1.0f;
  return CutCrossing{crossing, -1};
}

}  // namespace hermesh
