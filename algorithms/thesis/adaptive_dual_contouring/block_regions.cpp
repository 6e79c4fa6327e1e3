#include "algorithms/thesis/adaptive_dual_contouring/block_regions.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hermesh {
namespace {

using Eigen::Vector3d;

constexpr float kNoLimit = std::numeric_limits<float>::infinity();
/// The sum, behind those of the 512 cells, to which goes what lies in cells without a point.
constexpr std::uint16_t kNoSlot = 512;
constexpr int kAlone = -1;  ///< level of a cell that was not merged
/// Entry of a cell that is in no merged region.
constexpr std::uint8_t kNoRegion = 255;
constexpr float kMiddle =
    4.0f;  ///< planes and points are relative to the block's middle, for the sake of their squares

/// A crossing as the QEF takes it, relative to the block's middle, in voxels.
struct Plane {
  float point[3], normal[3];
  std::int8_t at[3], axis;  ///< first sample of the edge, 0 to 8
};

/// The plane of a crossing on the edge along `axis` from sample `at` of the block.
Plane plane_of(const EdgeCrossing& crossing, int axis, const int (&at)[3]) {
  Plane plane;
  for (int a = 0; a < 3; ++a) {
    plane.at[a] = static_cast<std::int8_t>(at[a]);
    plane.point[a] = static_cast<float>(at[a]) - kMiddle + (a == axis ? crossing.offset : 0.0f);
    plane.normal[a] = crossing.normal[a];
  }
  plane.axis = static_cast<std::int8_t>(axis);
  return plane;
}

/// Collects the tagged edges along an axis that a block owns and the cells of the merged block share; the
/// owner lies (d[0], d[1], d[2]) blocks above the merged one, each 0 or 1. Returns the end.
Plane* gather_owned(const EdgeSource& edges, std::int32_t owner, int axis, const int (&d)[3], Plane* plane) {
  // Of an upper neighbour the first layers count.
  const std::uint64_t layer = first_layers(d[1], d[2]);
  BlockMask wanted{};
  std::uint64_t some = 0;
  for (int x = 0; x < (d[0] ? 1 : 8); ++x)
    some |= wanted[x] = edges.blocks()[owner].crossing[axis][x] & layer;
  if (some == 0) return plane;
  std::array<EdgeCrossing, 512> data;
  edges.read(owner, axis, wanted, data.data());
  const EdgeCrossing* next = data.data();
  for_each_bit(wanted, [&](int sample) {
    *plane++ = plane_of(*next++, axis,
                        {(sample >> 6) + 8 * d[0], (sample >> 3 & 7) + 8 * d[1], (sample & 7) + 8 * d[2]});
  });
  return plane;
}

/// Collects every tagged edge of the block's cells; returns their number.
int gather_planes(const EdgeSource& edges, const HermiteView::Block& block, Plane* planes) {
  Plane* end = planes;
  for (int axis = 0; axis < 3; ++axis)
    for (int part = 0; part < 8; ++part) {
      const int d[3] = {part >> 2, (part >> 1) & 1, part & 1};
      const std::int32_t number = block.neighbours[neighbour_slot(d[0], d[1], d[2])];
      // An edge along the axis that begins in an upper neighbour on that axis is no edge of these cells. A
      // block without a leaf owns none.
      if (d[axis] || number < 0 || edges.blocks()[number].leaf < 0) continue;
      end = gather_owned(edges, number, axis, d, end);
    }
  return static_cast<int>(end - planes);
}

/// Calls f(cell) for the cells of the block, up to four, around the plane's edge.
template <class F>
void for_each_cell_around(const Plane& plane, F&& f) {
  constexpr int kStep[3] = {64, 8, 1};
  const int u = (plane.axis + 1) % 3, v = (plane.axis + 2) % 3;
  const int cell = kStep[0] * plane.at[0] + kStep[1] * plane.at[1] + kStep[2] * plane.at[2];
  for (int i = plane.at[u] == 8; i < (plane.at[u] == 0 ? 1 : 2); ++i)
    for (int j = plane.at[v] == 8; j < (plane.at[v] == 0 ? 1 : 2); ++j) f(cell - i * kStep[u] - j * kStep[v]);
}

/// Numbers of the regions by level (regions of 2³, 4³ and 8³ cells) and cell: region (i, j, k) of n³ has the
/// number n²i + nj + k.
constexpr std::array<std::array<std::uint8_t, 512>, 3> region_numbers() {
  std::array<std::array<std::uint8_t, 512>, 3> table{};
  for (int level = 0; level < 3; ++level)
    for (int cell = 0; cell < 512; ++cell) {
      const int shift = level + 1, bits = 3 - shift;
      const int i = cell >> (6 + shift), j = (cell & 63) >> (3 + shift), k = (cell & 7) >> shift;
      table[level][cell] = static_cast<std::uint8_t>((i << 2 * bits) + (j << bits) + k);
    }
  return table;
}
constexpr std::array<std::array<std::uint8_t, 512>, 3> kRegion = region_numbers();

/// The first cell of each region; the others are overwritten, as the loop goes down.
constexpr std::array<std::array<std::uint16_t, 64>, 3> first_cells() {
  std::array<std::array<std::uint16_t, 64>, 3> table{};
  for (int level = 0; level < 3; ++level)
    for (int cell = 511; cell >= 0; --cell)
      table[level][kRegion[level][cell]] = static_cast<std::uint16_t>(cell);
  return table;
}
constexpr std::array<std::array<std::uint16_t, 64>, 3> kFirstCell = first_cells();

/// Cells along the side of a region of a level.
constexpr int side_of(int level) { return 2 << level; }

/// The regions of one level: those that have active cells, those that were merged, and what is known of them.
struct Level {
  std::uint64_t present = 0, merged = 0;
  std::array<QefSum, 64> sums;
  std::array<Vector3d, 64> places;
  std::array<float, 64> limits;
  std::array<std::uint16_t, 64> points;
};

/// Merges one block. It is large, and lives on the stack of the thread that merges.
class BlockMerger {
 public:
  BlockMerger(const RegionInput& input, std::int32_t block)
      : input_(input),
        block_(input.edges.blocks()[block]),
        lattice_(input.edges.signs(block)),
        plane_count_(gather_planes(input.edges, block_, planes_.data())) {
    // Step 1 of §6.4: the mask holds the cells around tagged edges.
    for (int i = 0; i < plane_count_; ++i)
      for_each_cell_around(planes_[i],
                           [&](int cell) { active_[cell >> 6] |= std::uint64_t{1} << (cell & 63); });
    if (input.field.leaves_out_outside()) active_ = input.field.inside(block_.lower, active_);
  }

  BlockResult merge(std::uint16_t* mask, Eigen::Vector3f* points) {
    sum_cells();
    const bool merges = input_.options.threshold > 0 || input_.field.simplifies_outside();
    // Steps 2 to 4 of §6.4, level by level.
    if (merges) {
      set_limits();
      for (int level = 0; level < 3; ++level) {
        sum_regions(level);
        merge_level(level);
      }
    }
    number_cells(mask, points);
    if (levels_[0].merged) find_largest_distance();
    return result_;
  }

 private:
  /// The QEF of each active cell: every tagged edge goes to the up to four cells around its edge.
  void sum_cells() {
    slots_.fill(kNoSlot);  // what lies in cells that get no point goes to a sum of its own
    for_each_bit(active_, [&](int cell) {
      sums_[cells_].clear();
      slots_[cell] = static_cast<std::uint16_t>(cells_++);
    });
    sums_[kNoSlot].clear();
    for (int i = 0; i < plane_count_; ++i) {
      const QefSum sum = QefSum::of_plane(planes_[i].point, planes_[i].normal);
      for_each_cell_around(planes_[i], [&](int cell) { sums_[slots_[cell]] += sum; });
    }
  }

  /// Sets what E may be in each region: the least that one of its cells allows. Cells where the field says so
  /// allow any.
  void set_limits() {
    const auto threshold = static_cast<float>(input_.options.threshold);
    for (Level& level : levels_) level.limits.fill(kNoLimit);
    const FieldEvaluator& field = input_.field;
    const BlockMask bound = field.simplifies_outside() ? field.inside(block_.lower, active_) : active_;
    std::array<float, 512> scales;
    if (field.has_scale()) field.scales(block_.lower, bound, scales);
    for_each_bit(bound, [&](int cell) {
      const float limit = field.has_scale() ? threshold * scales[cell] : threshold;
      for (int level = 0; level < 3; ++level) {
        float& least = levels_[level].limits[kRegion[level][cell]];
        least = std::min(least, limit);
      }
    });
  }

  /// Adds to a region's sum, or begins it; sums are not cleared beforehand, for most are never used.
  void add(Level& level, int region, const QefSum& sum) {
    const std::uint64_t bit = std::uint64_t{1} << region;
    QefSum& total = level.sums[region];
    if (level.present & bit)
      total += sum;
    else
      total = sum;
    level.present |= bit;
  }

  /// The sums of a level from those of the one below: eq. 6.3 is additive, so no crossing is visited again.
  void sum_regions(int number) {
    Level& level = levels_[number];
    if (number == 0) {
      for_each_bit(active_, [&](int cell) { add(level, kRegion[0][cell], sums_[slots_[cell]]); });
      return;
    }
    const Level& finer = levels_[number - 1];
    for (std::uint64_t bits = finer.present; bits != 0; bits &= bits - 1) {
      const int child = std::countr_zero(bits);
      add(level, parent(number - 1, child), finer.sums[child]);
    }
  }

  /// The region of the next level that a region is in.
  static int parent(int level, int region) { return kRegion[level + 1][kFirstCell[level][region]]; }

  /// The regions whose cells are all mergeable: each child with an active cell has been merged.
  std::uint64_t mergeable(int number) const {
    std::uint64_t result = levels_[number].present;
    if (number == 0) return result;
    const Level& finer = levels_[number - 1];
    for (std::uint64_t bits = finer.present & ~finer.merged; bits != 0; bits &= bits - 1)
      result &= ~(std::uint64_t{1} << parent(number - 1, std::countr_zero(bits)));
    return result;
  }

  /// Whether a region passes the topology tests that are asked for.
  bool passes(region_topology::Signs27 signs) const {
    using Tests = AdaptiveOptions::TopologyTests;
    const Tests tests = input_.options.topology_tests;
    if (tests == Tests::both) return region_topology::passes(signs);
    if (tests == Tests::table) return region_topology::kCollapsesToOneEdge[region_topology::corners(signs)];
    return tests == Tests::none || region_topology::middles_agree(signs);
  }

  /// Tries the regions of a level, topology first: it costs a few operations, and the minimisers of those
  /// that pass are found together.
  void merge_level(int number) {
    Level& level = levels_[number];
    int candidates = 0;
    std::array<int, 64> regions;
    for (std::uint64_t bits = mergeable(number); bits != 0; bits &= bits - 1) {
      const int region = std::countr_zero(bits), cell = kFirstCell[number][region];
      const auto signs = lattice_.around(cell >> 6, (cell >> 3) & 7, cell & 7, side_of(number));
      if (passes(signs)) regions[candidates++] = region;
    }
    std::array<const QefSum*, 64> sums;
    std::array<std::uint16_t, 64> cells;
    std::array<Vector3d, 64> places;
    for (int i = 0; i < candidates; ++i) {
      sums[i] = &level.sums[regions[i]];
      cells[i] = kFirstCell[number][regions[i]];
    }
    place({sums.data(), static_cast<std::size_t>(candidates)}, cells.data(), places.data());
    for (int i = 0; i < candidates; ++i) {
      const int region = regions[i];
      if (!(sums[i]->error(places[i]) < level.limits[region])) continue;
      level.merged |= std::uint64_t{1} << region;
      level.places[region] = places[i];
    }
  }

  /// Places of points by the chosen placement, relative to the block's middle; `cells` holds the first cell
  /// of each sum's cell or region.
  void place(std::span<const QefSum* const> sums, const std::uint16_t* cells, Vector3d* places) {
    if (input_.options.placement == AdaptiveOptions::Placement::average) {
      for (std::size_t i = 0; i < sums.size(); ++i) places[i] = sums[i]->mass_point();
      return;
    }
    if (input_.options.nearest == AdaptiveOptions::Nearest::mass_point)
      return minimisers(sums, {}, input_.options.truncation, places);
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const int cell = cells[i];
      starts_[i] = Vector3d(cell >> 6, (cell >> 3) & 7, cell & 7) - Vector3d::Constant(kMiddle);
    }
    minimisers(sums, {starts_.data(), sums.size()}, input_.options.truncation, places);
  }

  /// The level of the coarsest merged region of the cell, or kAlone.
  int merged_level(int cell) const {
    for (int number = 2; number >= 0; --number)
      if (levels_[number].merged >> kRegion[number][cell] & 1) return number;
    return kAlone;
  }

  /// Numbers points in the order of the first active cell of each, and writes the mask and the points.
  void number_cells(std::uint16_t* mask, Eigen::Vector3f* points) {
    for (Level& level : levels_) level.points.fill(kNoPoint);
    merged_into_.fill(kNoRegion);
    int alone = 0;
    for_each_bit(active_, [&](int cell) {
      const int number = merged_level(cell);
      if (number == kAlone) {
        lone_cells_[alone] = static_cast<std::uint16_t>(cell);
        lone_sums_[alone++] = &sums_[slots_[cell]];
        mask[cell] = entry(result_.points++, 0);
        return;
      }
      Level& level = levels_[number];
      const int region = kRegion[number][cell];
      merged_into_[cell] = static_cast<std::uint8_t>(64 * number + region);
      if (level.points[region] == kNoPoint) {
        level.points[region] = static_cast<std::uint16_t>(result_.points++);
        ++result_.regions[number];
        put(points[level.points[region]], level.places[region], kFirstCell[number][region], side_of(number));
      }
      mask[cell] = entry(level.points[region], number + 1);
    });
    place({lone_sums_.data(), static_cast<std::size_t>(alone)}, lone_cells_.data(), lone_places_.data());
    for (int i = 0; i < alone; ++i)
      put(points[point_of(mask[lone_cells_[i]])], lone_places_[i], lone_cells_[i], 1);
  }

  /// An entry of the mask, of which point_of() and level_of() give the parts back.
  static std::uint16_t entry(std::uint32_t point, int level) {
    return static_cast<std::uint16_t>(point | static_cast<std::uint32_t>(level) << 9);
  }

  /// Writes the point of the region of that side that begins at the cell, and counts it if it is outside:
  /// nothing holds it there (trap T7).
  void put(Eigen::Vector3f& out, const Vector3d& place, int cell, int side) {
    out = (place + Vector3d::Constant(kMiddle)).cast<float>();
    const int corner[3] = {cell >> 6, (cell >> 3) & 7, cell & 7};
    float escape = 0.0f;
    for (int a = 0; a < 3; ++a)
      escape = std::max(
          {escape, static_cast<float>(corner[a]) - out[a], out[a] - static_cast<float>(corner[a] + side)});
    if (escape == 0.0f) return;
    const auto range =
        std::lower_bound(kEscapeRanges.begin(), kEscapeRanges.end(), escape) - kEscapeRanges.begin();
    ++result_.escaped[static_cast<std::size_t>(range)];
    result_.largest_escape = std::max(result_.largest_escape, escape);
  }

  /// How far the planes of merged regions are from the regions' points at most.
  void find_largest_distance() {
    double largest = 0.0;
    for (int i = 0; i < plane_count_; ++i) {
      const Plane& plane = planes_[i];
      std::uint8_t before = kNoRegion;
      for_each_cell_around(plane, [&](int cell) {
        const std::uint8_t region = merged_into_[cell];
        // Cells of a region often follow one another, and have the same distance.
        if (region == before || region == kNoRegion) return;
        before = region;
        const Vector3d& place = levels_[region >> 6].places[region & 63];
        double distance = 0.0;
        for (int a = 0; a < 3; ++a) distance += plane.normal[a] * (place[a] - plane.point[a]);
        largest = std::max(largest, std::fabs(distance));
      });
    }
    result_.largest_plane_distance = static_cast<float>(largest);
  }

  const RegionInput& input_;
  const HermiteView::Block& block_;
  const SignLattice lattice_;
  std::array<Plane, 3 * 9 * 9 * 8> planes_;
  const int plane_count_;
  BlockMask active_{};
  BlockResult result_;
  int cells_ = 0;
  std::array<std::uint16_t, 512> slots_;  ///< where the sum of each cell is
  std::array<QefSum, 513> sums_;
  std::array<std::uint8_t, 512> merged_into_;  ///< region of each cell, plus 64 times its level
  std::array<Level, 3> levels_;                ///< of regions of 2³, 4³ and 8³ cells
  std::array<std::uint16_t, 512> lone_cells_;
  std::array<const QefSum*, 512> lone_sums_;
  std::array<Vector3d, 512> lone_places_, starts_;
};

}  // namespace

BlockResult merge_block(const RegionInput& input, std::int32_t block, std::uint16_t* mask,
                        Eigen::Vector3f* points) {
  return BlockMerger(input, block).merge(mask, points);
}

}  // namespace hermesh
