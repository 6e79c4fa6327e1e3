#include "algorithms/thesis/adaptive_dual_contouring/adaptive_dual_contouring.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <sstream>

#include "algorithms/core/large_array.h"
#include "algorithms/core/option_table.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/hermite_input.h"
#include "algorithms/thesis/adaptive_dual_contouring/edge_source.h"
#include "algorithms/thesis/adaptive_dual_contouring/qef_sum.h"
#include "algorithms/thesis/adaptive_dual_contouring/region_topology.h"

namespace hermesh {
namespace {

// ---- The regions of one block (Aldén 2011, §6.4).

/// Hermite data as blocks, with the criteria that decide about regions.
struct RegionInput {
  const EdgeSource& edges;
  const AdaptiveOptions& options;
  const FieldEvaluator& field;
};

/// Entry of the mask grid for a cell that gets no point although the surface passes through it.
constexpr std::uint16_t kNoPoint = 0xffff;
/// The parts of any other entry: the number of the cell's point within the block, and the level of its
/// region, 0 for a lone cell and 1 to 3 for regions of 2³, 4³ and 8³ cells.
constexpr std::uint32_t point_of(std::uint16_t entry) { return entry & 511u; }
constexpr int level_of(std::uint16_t entry) { return entry >> 9; }

/// The result of merging one block.
struct BlockResult {
  std::uint32_t points = 0;
  std::array<std::uint32_t, 3> regions{};  ///< of 2³, 4³, 8³ cells
  std::array<std::uint32_t, kEscapeRanges.size() + 1>
      escaped{};                        ///< by range; the last is beyond all of them
  float largest_escape = 0.0f;          ///< voxels
  float largest_plane_distance = 0.0f;  ///< voxels
};

using Eigen::Vector3d;

constexpr float kNoLimit = std::numeric_limits<float>::infinity();
/// The sum, after those of the 512 cells, of cells without a point.
constexpr std::uint16_t kNoSlot = 512;
constexpr int kAlone = -1;  ///< level of a cell that was not merged
/// Entry of a cell that is in no merged region.
constexpr std::uint8_t kNoRegion = 255;
constexpr float kMiddle =
    4.0f;  ///< planes and points are relative to the block's middle, since their squares are summed

/// A crossing as a plane of the QEF, relative to the block's middle, in voxels.
struct Plane {
  float point[3], normal[3];
  std::int8_t at[3], axis;  ///< first sample of the edge, 0 to 8
};

/// Returns the plane of a crossing on the edge along `axis` from sample `at` of the block.
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
  // Only the first layers of an upper neighbour.
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
      // An edge along the axis that begins in an upper neighbour on that axis is not an edge of these cells.
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

/// Numbers of the regions by level (2³, 4³ and 8³ cells) and cell: region (i, j, k) of n³ has the number n²i
/// + nj + k.
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

/// The first cell of each region; the loop overwrites the others.
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

/// The regions of one level: those with active cells, those that were merged, and their data.
struct Level {
  std::uint64_t present = 0, merged = 0;
  std::array<QefSum, 64> sums;
  std::array<Vector3d, 64> places;
  std::array<float, 64> limits;
  std::array<std::uint16_t, 64> points;
};

/// Merges one block. It is large, and lives on the thread's stack.
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
  /// Sums the QEF of each active cell: every tagged edge is added to the up to four cells around it.
  void sum_cells() {
    slots_.fill(kNoSlot);
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

  /// Sets the bound of E in each region: the least that one of its cells allows. Cells outside of the field
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

  /// Adds to a region's sum, or begins it; most sums are never used, so they are not cleared beforehand.
  void add(Level& level, int region, const QefSum& sum) {
    const std::uint64_t bit = std::uint64_t{1} << region;
    QefSum& total = level.sums[region];
    if (level.present & bit)
      total += sum;
    else
      total = sum;
    level.present |= bit;
  }

  /// Computes the sums of a level from those of the one below: eq. 6.3 is additive, so no crossing is visited
  /// again.
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

  /// Returns the region of the next level that contains a region.
  static int parent(int level, int region) { return kRegion[level + 1][kFirstCell[level][region]]; }

  /// Returns the regions whose cells are all mergeable: each child with an active cell has been merged.
  std::uint64_t mergeable(int number) const {
    std::uint64_t result = levels_[number].present;
    if (number == 0) return result;
    const Level& finer = levels_[number - 1];
    for (std::uint64_t bits = finer.present & ~finer.merged; bits != 0; bits &= bits - 1)
      result &= ~(std::uint64_t{1} << parent(number - 1, std::countr_zero(bits)));
    return result;
  }

  /// Returns true if a region passes the selected topology tests.
  bool passes(region_topology::Signs27 signs) const {
    using Tests = AdaptiveOptions::TopologyTests;
    const Tests tests = input_.options.topology_tests;
    if (tests == Tests::both) return region_topology::passes(signs);
    if (tests == Tests::table) return region_topology::kCollapsesToOneEdge[region_topology::corners(signs)];
    return tests == Tests::none || region_topology::middles_agree(signs);
  }

  /// Tries the regions of a level, topology first, which takes a few operations; the minimisers of those that
  /// pass are found together.
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

  /// Computes the points by the chosen placement, relative to the block's middle; `cells` holds the first
  /// cell of each sum's cell or region.
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

  /// Returns the level of the coarsest merged region of the cell, or kAlone.
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

  /// Returns an entry of the mask, whose parts are point_of() and level_of().
  static std::uint16_t entry(std::uint32_t point, int level) {
    return static_cast<std::uint16_t>(point | static_cast<std::uint32_t>(level) << 9);
  }

  /// Writes the point of the region of that side that begins at the cell, and counts it if it is outside
  /// (trap T7).
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

  /// Computes the largest distance of the planes of merged regions from the regions' points.
  void find_largest_distance() {
    double largest = 0.0;
    for (int i = 0; i < plane_count_; ++i) {
      const Plane& plane = planes_[i];
      std::uint8_t before = kNoRegion;
      for_each_cell_around(plane, [&](int cell) {
        const std::uint8_t region = merged_into_[cell];
        // Cells of a region are often consecutive, with the same distance.
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

/// Merges the cells of one block. Writes for each active one of the 512 cells its point and level to `mask`,
/// whose other entries are unchanged, and that many points, voxels from the block's first sample, to
/// `points`, which has room for 512. Cells are active that lie around a tagged edge, less those that the
/// field leaves out. Blocks do not depend on each other, so any thread may merge any.
BlockResult merge_block(const RegionInput& input, std::int32_t block, std::uint16_t* mask,
                        Eigen::Vector3f* points) {
  return BlockMerger(input, block).merge(mask, points);
}

// ---- All blocks.

/// The mask grid of §6.4 in its last state: the point of each active cell. Numbers within blocks take half as
/// many bytes as those of the mesh, and the first touch of memory is the grid's cost.
struct MaskGrid {
  LargeArray<std::uint16_t> numbers;  ///< by block and cell; undefined for cells that are not active
  std::vector<std::uint64_t> first;   ///< first point of each block
};

/// The points of the four cells around a tagged edge, of which each has a block (EdgeSource::blocks()).
struct PointsAround {
  Quad points;
  int step;       ///< difference of level between the coarsest and the finest of their regions
  bool complete;  ///< true if each of the cells has a point
};

PointsAround points_of(const MaskGrid& mask, const std::array<LatticePlace, 4>& cells) {
  PointsAround result;
  std::uint16_t n[4];
  for (int i = 0; i < 4; ++i) {
    n[i] = mask.numbers[512 * static_cast<std::size_t>(cells[i].block) +
                        static_cast<std::size_t>(cells[i].sample)];
    result.points[i] =
        static_cast<std::uint32_t>(mask.first[static_cast<std::size_t>(cells[i].block)]) + point_of(n[i]);
  }
  const auto [finest, coarsest] =
      std::minmax({level_of(n[0]), level_of(n[1]), level_of(n[2]), level_of(n[3])});
  result.step = coarsest - finest;
  result.complete = n[0] != kNoPoint && n[1] != kNoPoint && n[2] != kNoPoint && n[3] != kNoPoint;
  return result;
}

/// One run of adaptive_dual_contouring(), stage by stage.
class AdaptiveContourer {
 public:
  AdaptiveContourer(const EdgeSource& edges, const IndexToWorld& placement, const AdaptiveOptions& options,
                    const AdaptivityField* field, RunContext& context)
      : context_(context),
        edges_(edges),
        placement_(placement),
        options_(options),
        field_(field, placement),
        input_{edges, options_, field_},
        blocks_(edges.blocks().size()),
        groups_((blocks_ + kGroup - 1) / kGroup) {}

  PolygonMesh run() {
    PolygonMesh mesh;
    mesh.origin = placement_.origin;
    merge();
    number_points(mesh);
    connect(mesh);
    // Without a topology test a region may contain a whole component of the surface, and no polygon uses its
    // point.
    if (field_.leaves_out_outside() || options_.topology_tests != AdaptiveOptions::TopologyTests::both)
      drop_unused_points(mesh);
    report();
    return mesh;
  }

 private:
  /// Blocks of a task. Groups depend only on the data, and so does the order of points and polygons.
  static constexpr std::size_t kGroup = 64;

  /// Merges the cells of every block separately, as §6.4 does. Groups of blocks store their points until the
  /// number of points before them is known: far fewer than active cells.
  void merge() {
    Stage stage(context_, "merge cells");
    mask_.numbers.resize(512 * blocks_);
    results_.resize(blocks_);
    places_.resize(groups_);
    parallel_blocks(groups_, context_, [&](std::size_t g) {
      std::array<Eigen::Vector3f, 512> points;
      for_each_block(g, [&](std::size_t b) {
        std::uint16_t* mask = mask_.numbers.data() + 512 * b;
        if (field_.leaves_out_outside())
          std::fill_n(mask, 512, kNoPoint);  // otherwise every cell that is read is active
        results_[b] = merge_block(input_, static_cast<std::int32_t>(b), mask, points.data());
        places_[g].insert(places_[g].end(), points.begin(), points.begin() + results_[b].points);
      });
    });
  }

  /// Gives every block its range of the shared array of points (§6.4), and transforms the points from voxels
  /// to the mesh's space.
  void number_points(PolygonMesh& mesh) {
    Stage stage(context_, "number points");
    mask_.first.resize(blocks_);
    for (std::size_t b = 0; b < blocks_; ++b) mask_.first[b] = results_[b].points;
    mesh.points.resize(exclusive_scan(mask_.first, "points"));
    parallel_blocks(groups_, context_, [&](std::size_t g) {
      // A group's points are in the order of its blocks.
      const Eigen::Vector3f* place = places_[g].data();
      for_each_block(g, [&](std::size_t b) {
        Eigen::Vector3d lower;
        for (int a = 0; a < 3; ++a) lower[a] = edges_.blocks()[b].lower[a] - placement_.base[a];
        for (std::uint32_t i = 0; i < results_[b].points; ++i)
          mesh.points[mask_.first[b] + i] = placement_.local(lower + (place++)->cast<double>()).cast<float>();
      });
    });
    places_ = {};
  }

  /// Connects points to polygons. Groups of blocks store them until the number before them is known: far
  /// fewer than crossing edges.
  void connect(PolygonMesh& mesh) {
    Stage stage(context_, "connect");
    std::vector<std::vector<Quad>> quads(groups_);
    std::vector<std::vector<Triangle>> triangles(groups_);
    std::vector<std::uint64_t> first_quad(groups_), first_triangle(groups_);
    steps_.resize(groups_);
    parallel_blocks(groups_, context_, [&](std::size_t g) {
      for_each_block(g, [&](std::size_t b) {
        for_each_polygon(b, [&](const Quad& polygon, int corners, int step) {
          ++steps_[g][static_cast<std::size_t>(corners - 3)][static_cast<std::size_t>(step)];
          // Triangles lie on the border between regions of different size (fig. 6.4).
          if (corners == 4)
            quads[g].push_back(polygon);
          else
            triangles[g].push_back({polygon[0], polygon[1], polygon[2]});
        });
      });
      first_quad[g] = quads[g].size();
      first_triangle[g] = triangles[g].size();
    });
    mesh.quads.resize(exclusive_scan(first_quad, "quads"));
    mesh.triangles.resize(exclusive_scan(first_triangle, "triangles"));
    parallel_blocks(groups_, context_, [&](std::size_t g) {
      std::copy(quads[g].begin(), quads[g].end(),
                mesh.quads.begin() + static_cast<std::ptrdiff_t>(first_quad[g]));
      std::copy(triangles[g].begin(), triangles[g].end(),
                mesh.triangles.begin() + static_cast<std::ptrdiff_t>(first_triangle[g]));
    });
  }

  /// Calls f(points, 3 or 4, difference of level) for each polygon of the block's crossing edges (§6.5).
  template <class F>
  void for_each_polygon(std::size_t b, F&& f) const {
    const HermiteView::Block& block = edges_.blocks()[b];
    const bool mirrors = placement_.mirrors();
    for_each_edge_with_cells(edges_.blocks(), b,
                             [&](int, int sample, const std::array<LatticePlace, 4>& cells) {
                               auto [polygon, step, complete] = points_of(mask_, cells);
                               if (!complete) return;
                               int corners = 0;
                               // Equal points are adjacent, since cells of one region around an edge form a
                               // cube. With fewer than three different ones the edge lies within a region, or
                               // between two, and gives nothing.
                               for (int i = 0; i < 4; ++i)
                                 if (polygon[i] != polygon[(i + 1) & 3]) polygon[corners++] = polygon[i];
                               if (corners < 3) return;
                               // The sign at the edge's first sample orients the polygon; a mirroring
                               // placement reverses it.
                               if (test(block.inside, sample) == mirrors)
                                 std::swap(polygon[1], polygon[corners - 1]);
                               f(polygon, corners, step);
                             });
  }

  template <class F>
  void for_each_block(std::size_t group, F&& f) const {
    for (std::size_t b = group * kGroup; b < std::min(blocks_, (group + 1) * kGroup); ++b) f(b);
  }

  /// Reports the statistics of the run, summed in the order of the blocks.
  void report() const {
    const auto sum = [&](auto&& of) {
      return std::accumulate(results_.begin(), results_.end(), 0.0,
                             [&](double total, const BlockResult& result) { return total + of(result); });
    };
    for (std::size_t level = 0; level < 3; ++level)
      context_.figure("regions_" + std::to_string(level + 1),
                      sum([&](const BlockResult& r) { return r.regions[level]; }));
    float largest = 0.0f;
    for (const BlockResult& result : results_) largest = std::max(largest, result.largest_plane_distance);
    context_.figure("largest_plane_distance", largest);
    report_escapes();
    // Polygons by the levels around them, to verify fig. 6.4.
    for (std::size_t corners : {4, 3})
      for (std::size_t step = 0; step < 4; ++step) {
        double polygons = 0.0;
        for (const Steps& steps : steps_) polygons += steps[corners - 3][step];
        context_.figure((corners == 4 ? "quads_step_" : "triangles_step_") + std::to_string(step), polygons);
      }
  }

  /// Reports the statistics of points outside their regions (trap T7).
  void report_escapes() const {
    std::array<double, kEscapeRanges.size() + 1> escaped{};
    float largest = 0.0f;
    for (const BlockResult& result : results_) {
      for (std::size_t i = 0; i < escaped.size(); ++i) escaped[i] += result.escaped[i];
      largest = std::max(largest, result.largest_escape);
    }
    context_.figure("escaped", std::accumulate(escaped.begin(), escaped.end(), 0.0));
    context_.figure("largest_escape", largest);
    // A range is named by its upper end, the last by its lower one.
    for (std::size_t i = 0; i < kEscapeRanges.size(); ++i) {
      std::ostringstream name;
      name << "escaped_to_" << kEscapeRanges[i];
      context_.figure(name.str(), escaped[i]);
    }
    context_.figure("escaped_beyond_4", escaped.back());
  }

  RunContext& context_;
  const EdgeSource& edges_;
  const IndexToWorld& placement_;
  const AdaptiveOptions options_;
  const FieldEvaluator field_;
  const RegionInput input_;
  const std::size_t blocks_, groups_;
  /// Points of each group, those of its blocks one after another: voxels from the block's first sample.
  std::vector<std::vector<Eigen::Vector3f>> places_;
  MaskGrid mask_;
  std::vector<BlockResult> results_;
  /// Polygons by corners, less 3, and by difference of level.
  using Steps = std::array<std::array<std::uint32_t, 4>, 2>;
  std::vector<Steps> steps_;  ///< by group
};

const OptionTable<AdaptiveOptions>& adaptive_option_table() {
  using Options = AdaptiveOptions;
  using Placement = Options::Placement;
  using Nearest = Options::Nearest;
  using Tests = Options::TopologyTests;
  static const auto table =
      OptionTable<Options>()
          .number("threshold", &Options::threshold, {},
                  "square voxels: cells are merged while the sum of the squared distances to their planes is "
                  "less; "
                  "larger merges more, 0 nothing")
          .choice("placement", &Options::placement,
                  {{"optimal", Placement::optimal}, {"average", Placement::average}},
                  "where a region's point goes: 'optimal' minimises the QEF and keeps sharp features, "
                  "'average' takes "
                  "the mean of its crossings")
          .number("truncation", &Options::truncation, {.maximum = 1.0},
                  "singular values below this share of the largest are dropped; larger is smoother and keeps "
                  "fewer "
                  "features, 0 drops none that can be told from 0",
                  {"placement=optimal"})
          .choice("minimiser", &Options::nearest,
                  {{"mass-point", Nearest::mass_point}, {"corner", Nearest::corner}},
                  "where singular values are dropped, the minimiser nearest to the 'mass-point' of the "
                  "crossings, or to "
                  "the first 'corner' of the cell or region (the pseudo-inverse alone)",
                  {"placement=optimal"})
          .choice(
              "topology_tests", &Options::topology_tests,
              {{"both", Tests::both},
               {"table", Tests::table},
               {"signs", Tests::signs},
               {"none", Tests::none}},
              "what a region must pass to be merged: the look-up 'table', the 'signs' of middles, 'both' (as "
              "printed), or 'none'; without one the topology may change");
  return table;
}

}  // namespace

PolygonMesh adaptive_dual_contouring(const FloatHermite& hermite, const AdaptiveOptions& options,
                                     const AdaptivityField* field, RunContext& context) {
  const SparseEdges edges = [&] {
    Stage stage(context, "blocks");
    return SparseEdges(hermite, context);
  }();
  return AdaptiveContourer(edges, hermite.placement, options, field, context).run();
}

PolygonMesh adaptive_dual_contouring(const ThesisDense& hermite, const AdaptiveOptions& options,
                                     const AdaptivityField* field, RunContext& context) {
  const PackedEdges edges = [&] {
    Stage stage(context, "blocks");
    return PackedEdges(hermite, context);
  }();
  PolygonMesh mesh = AdaptiveContourer(edges, hermite.placement, options, field, context).run();
  // A region may have lost all edges that lead out of it, and no polygon uses its point.
  if (edges.lost() + edges.needless() > 0) drop_unused_points(mesh);
  context.figure("lost_crossings", static_cast<double>(edges.lost()));
  context.figure("needless_crossings", static_cast<double>(edges.needless()));
  if (edges.lost() > 0)
    context.note(std::to_string(edges.lost()) + " of " +
                 std::to_string(edges.lost() + edges.tagged() - edges.needless()) +
                 " edge crossings were lost by the 10 bytes of §4.2 and leave holes; -o "
                 "lost_crossings=repaired closes them, other representations lose none");
  return mesh;
}

PolygonMesh adaptive_dual_contouring(const ExtractionInput& input) {
  const AdaptiveOptions options = adaptive_option_table().read(input.options);
  // As printed, the 10 bytes themselves are meshed, with the edges that have data according to them.
  if (input.options.is("representation", "thesis") && input.options.is("lost_crossings", "kept"))
    return adaptive_dual_contouring(thesis_hermite_input(input, "adaptive-dual-contouring"), options,
                                    input.field, input.context);
  // Without merging, means of crossings need no planes.
  const bool needs_normals =
      options.placement == AdaptiveOptions::Placement::optimal || options.threshold > 0;
  const FloatHermite hermite = hermite_input(input, "adaptive-dual-contouring", needs_normals);
  return adaptive_dual_contouring(hermite, options, input.field, input.context);
}

std::vector<OptionSpec> adaptive_dual_contouring_options() {
  std::vector<OptionSpec> options = adaptive_option_table().specs();
  // The default is the print's own 10 bytes.
  std::vector<OptionSpec> of_hermite = hermite_options();
  for (OptionSpec& option : of_hermite)
    if (option.name == "representation") option.fallback = "thesis";
  options.insert(options.end(), of_hermite.begin(), of_hermite.end());
  options.push_back(
      {.name = "lost_crossings",
       .fallback = "kept",
       .help = "crossings along x and y whose normal has the code 0, which the print takes for none: 'kept' "
               "lost, so that the mesh has holes there, or 'repaired' by the middle of their edge",
       .choices = {"kept", "repaired"},
       .only_with = {"representation=thesis"}});
  return options;
}

}  // namespace hermesh
