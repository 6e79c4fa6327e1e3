#include <sys/mman.h>
#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/extraction/dual_contouring/kernels/leaf_kernels.h"
#include "algorithms/extraction/dual_contouring/qef.h"
#include "algorithms/hermite/leaf_stencils.h"
#include "algorithms/lattice/grid_placement.h"
#include "algorithms/lattice/leaf_table.h"

namespace hermesh {
namespace {

using leaf_kernels::LeafCells;
using leaf_kernels::UpperSigns;
using Position = std::array<std::int32_t, 3>;  // index coordinates

/// Reserves `n` elements in huge pages if possible: the first touch of a small page costs more than filling
/// it.
template <class T>
void reserve_huge(std::vector<T>& array, std::size_t n) {
  constexpr std::size_t kPage = std::size_t{2} << 20;
  array.reserve(n);
#if defined(MADV_HUGEPAGE)
  const auto first = (reinterpret_cast<std::uintptr_t>(array.data()) + kPage - 1) / kPage * kPage;
  const auto end = reinterpret_cast<std::uintptr_t>(array.data() + n) / kPage * kPage;
  if (first < end) madvise(reinterpret_cast<void*>(first), end - first, MADV_HUGEPAGE);  // advice
#endif
}

/// Computes the vertices that the vector code cannot, in the same way as dual_contouring().
class Plain final : public leaf_kernels::PlainCode {
 public:
  explicit Plain(const DualContouringOptions& options) : options_(options) {}

  void place(const leaf_kernels::Plane* planes, int count, float* place) const override {
    Qef qef(Eigen::Vector3d::Zero());
    for (int i = 0; i < count; ++i)
      qef.add_plane(Eigen::Vector3f(planes[i].point).cast<double>(),
                    Eigen::Vector3f(planes[i].normal).cast<double>());
    // Planes are relative to the cell's centre, so its first corner is at −½.
    const Eigen::Vector3d found = place_by_planes(qef, Eigen::Vector3d::Constant(-0.5), options_);
    for (int k = 0; k < 3; ++k) place[k] = static_cast<float>(found[k]);
  }

 private:
  const DualContouringOptions& options_;
};

/// Count, scan, fill. Limits of each pass, by profiles of the bunny and the Nefertiti at 800 voxels with
/// AVX-512: reading the signs, memory bandwidth; counting, the latency of the leaves' neighbours; average
/// placement, a third of the time waiting for the samples' cache lines in spite of the prefetches, then the
/// gathers of corners; optimal placement, arithmetic more than twice as long as all that; the quads,
/// instructions: lists of bits, shuffles. If pages are cleared slowly, a fifth of the time goes into the
/// first touches of the results, so values that can be recomputed are not stored.
class LevelSetContourer {
 public:
  LevelSetContourer(const LeafTable& table, const SampledVolume& volume, const IndexToWorld& placement,
                    const DualContouringOptions& options, RunContext& context)
      : table_(table),
        volume_(volume),
        placement_(placement),
        options_(options),
        context_(context),
        cells_(table_.size()),
        upper_(table_.size()) {}

  /// Finds the active cells and the first vertex and quad of every leaf. Returns the lower corners of missing
  /// leaves that contain active cells.
  std::vector<Position> count() {
    const Stage stage(context_, "count");
    std::vector<std::uint64_t> points(table_.size()), quads(table_.size());
    std::vector<Position> missing;
    std::mutex lock;
    parallel_blocks(table_.size(), context_, [&](std::size_t leaf) {
      upper_[leaf] = table_.neighbours(leaf, 1);
      const leaf_kernels::LowerNeeds needs = kernels_.count(upper_signs(upper_[leaf]), cells_[leaf]);
      points[leaf] = cells_[leaf].points;
      quads[leaf] = cells_[leaf].quads;
      // Slot 7 is a step down along all axes; a cell around an edge lies down along two at most.
      for (int slot = 1; slot < 7; ++slot) {
        const int dx = slot & 1, dy = slot >> 1 & 1, dz = slot >> 2;
        if (!(needs >> slot & 1) || table_.neighbour(leaf, -dx, -dy, -dz) >= 0) continue;
        // The order of this list depends on the threads, but the tree with its leaves does not.
        const std::scoped_lock hold(lock);
        const auto [x, y, z] = table_.lower(leaf);
        missing.push_back({x - 8 * dx, y - 8 * dy, z - 8 * dz});
      }
    });
    points_ = exclusive_scan(points, "points");
    quads_ = exclusive_scan(quads, "quads");
    for (std::size_t leaf = 0; leaf < table_.size(); ++leaf) {
      // Later passes visit only leaves with work.
      if (cells_[leaf].points == 0 && cells_[leaf].quads == 0) continue;
      cells_[leaf].first_point = static_cast<std::uint32_t>(points[leaf]);
      cells_[leaf].first_quad = static_cast<std::uint32_t>(quads[leaf]);
      live_.push_back(static_cast<std::uint32_t>(leaf));
    }
    return missing;
  }

  PolygonMesh extract() {
    PolygonMesh mesh;
    mesh.origin = placement_.origin;
    reserve_huge(mesh.points, points_ + 1);  // connecting reads a number beyond the last
    mesh.points.resize(points_);
    mesh.quads.resize(quads_);
    LargeArray<float> offsets(quads_ + leaf_kernels::kLargestVector);
    {
      const Stage stage(context_, "place points");
      place_all({mesh.points.data()->data(), offsets.data()});
    }
    const Stage stage(context_, "connect");
    // A leaf reads the vertices of its lower neighbours' cells and writes its own quads.
    const bool mirrors = placement_.mirrors();
    const Eigen::Matrix3d to_voxels = placement_.linear.inverse();
    parallel_blocks(live_.size(), context_, [&](std::size_t i) {
      const LeafCells& cells = cells_[live_[i]];
      if (cells.quads == 0) return;
      leaf_kernels::ConnectInput input{};
      input.signs = upper_signs(upper_[live_[i]]);
      input.points = mesh.points.data()->data();
      input.offsets = offsets.data() + cells.first_quad;
      input.mirrors = mirrors;
      const Eigen::Vector3d corner = corner_of(live_[i]);
      for (int axis = 0; axis < 3; ++axis) {
        input.corner[axis] = static_cast<float>(corner[axis]);
        for (int k = 0; k < 3; ++k) input.to_voxels[axis][k] = static_cast<float>(to_voxels(k, axis));
      }
      const Neighbours lower = table_.neighbours(live_[i], -1);
      for (int slot = 0; slot < 8; ++slot)
        // A tile below has no cells that are needed: contour_level_set() has replaced the others by leaves.
        input.cells[slot] = lower[slot] >= 0 ? &cells_[static_cast<std::size_t>(lower[slot])] : nullptr;
      kernels_.connect(input, mesh.quads[cells.first_quad].data());
    });
    return mesh;
  }

 private:
  using Neighbours = std::array<std::int32_t, 8>;  ///< as LeafTable::neighbours()

  UpperSigns upper_signs(const Neighbours& upper) const {
    UpperSigns signs;
    for (int slot = 0; slot < 8; ++slot) signs.inside[slot] = table_.signs(upper[slot]).data();
    return signs;
  }

  /// Returns the leaf's first sample in the mesh's coordinates.
  Eigen::Vector3d corner_of(std::size_t leaf) const {
    const auto [x, y, z] = table_.lower(leaf);
    return placement_.local(
        Eigen::Vector3d(x - placement_.base[0], y - placement_.base[1], z - placement_.base[2]));
  }

  /// Prefetches the samples of a later leaf, whose addresses are unpredictable: waiting for them costs more
  /// than the arithmetic. Those of the leaf below along z were read just before.
  void prefetch_samples(std::size_t leaf) const {
    const auto lines = [&](std::int32_t there, int first, int stride, int count) {
      if (there < 0) return;
      const float* values = table_.values(there) + first;
      for (int i = 0; i < count; ++i) __builtin_prefetch(values + stride * i);
    };
    constexpr int kLine = 16;  // samples
    const bool stencils = options_.placement != DualContouringOptions::Placement::average;
    lines(static_cast<std::int32_t>(leaf), 0, kLine, 32);
    lines(upper_[leaf][1], 0, kLine, stencils ? 8 : 4);  // the first layers along x
    lines(upper_[leaf][2], 0, 64, 8);                    // the first rows along y
    lines(upper_[leaf][4], 0, kLine, 32);
    if (!stencils) return;
    lines(table_.neighbour(leaf, -1, 0, 0), 7 * 64, kLine, 4);
    lines(table_.neighbour(leaf, 0, -1, 0), 7 * 8, 64, 8);
  }

  /// Finds the samples for average placement, which reads the upper neighbours that the leaf's last cells
  /// touch.
  void find_corner_samples(std::size_t leaf, leaf_kernels::PlaceInput& input) const {
    static thread_local std::array<std::array<float, 512>, 8> tiles;
    std::uint64_t any = 0;
    for (const std::uint64_t word : input.cells->active) any |= word;
    const unsigned touched =
        (input.cells->active[7] ? 1 : 0) | (any & kLastY ? 2 : 0) | (any & kLastZ ? 4 : 0);
    for (unsigned slot = 0; slot < 8; ++slot) {
      if (slot & ~touched) continue;
      const int dx = slot & 1, dy = slot >> 1 & 1, dz = static_cast<int>(slot >> 2);
      const std::int32_t there = upper_[leaf][slot];
      // A tile becomes the samples of a leaf, so the kernels need not distinguish the two.
      if (there < 0) tiles[slot].fill(table_.value_at(leaf, 8 * dx, 8 * dy, 8 * dz));
      input.values[neighbour_slot(dx, dy, dz)] = there >= 0 ? table_.values(there) : tiles[slot].data();
    }
  }

  /// Computes the vertices of all leaves; `output` is the range of the first leaf.
  void place_all(const leaf_kernels::PlaceOutput& output) {
    const Plain plain(options_);
    leaf_kernels::PlaceRules rules{};
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column) rules.linear[row][column] = placement_.linear(row, column);
    rules.truncation = static_cast<float>(options_.truncation);
    rules.reach = static_cast<float>(options_.reach);
    rules.smooth_share = static_cast<float>(options_.smooth_share());
    rules.plain = &plain;
    // Which cells share a vector depends on the threads. That changes no byte, because lanes are independent.
    tbb::enumerable_thread_specific<std::unique_ptr<leaf_kernels::LaterCells>> later_cells(
        [] { return std::make_unique_for_overwrite<leaf_kernels::LaterCells>(); });
    parallel_blocks(live_.size(), context_, [&](std::size_t i) {
      // The leaf after the next is mostly this thread's, because threads take leaves in runs.
      if (i + 2 < live_.size()) prefetch_samples(live_[i + 2]);
      leaf_kernels::LaterCells& later = *later_cells.local();
      place(live_[i], rules, output, later);
      if (later.count >= leaf_kernels::LaterCells::kEnough) kernels_.place_later(rules, later);
    });
    for (const auto& later : later_cells) kernels_.place_later(rules, *later);
  }

  void place(std::size_t leaf, const leaf_kernels::PlaceRules& rules, leaf_kernels::PlaceOutput output,
             leaf_kernels::LaterCells& later) {
    const LeafCells& cells = cells_[leaf];
    const bool optimal = options_.placement != DualContouringOptions::Placement::average;
    leaf_kernels::PlaceInput input{};
    input.rules = &rules;
    input.signs = upper_signs(upper_[leaf]);
    input.cells = &cells;
    std::optional<LeafStencils> stencils;
    if (optimal)
      stencils.emplace(volume_, leaf).fill(input);
    else
      find_corner_samples(leaf, input);
    input.isovalue = table_.rule().isovalue;
    input.scale = table_.rule().scale;
    const Eigen::Vector3d corner = corner_of(leaf);
    for (int axis = 0; axis < 3; ++axis) input.corner[axis] = corner[axis];
    // The ranges of this leaf.
    output.points += 3 * std::size_t{cells.first_point};
    output.offsets += cells.first_quad;
    if (optimal)
      kernels_.place_optimal(input, output, later);
    else
      kernels_.place_average(input, output);
  }

  const LeafTable& table_;
  const SampledVolume& volume_;
  const IndexToWorld& placement_;
  const DualContouringOptions& options_;
  RunContext& context_;
  const leaf_kernels::Kernels& kernels_ = chosen_kernels<leaf_kernels::Kernels>();
  LargeArray<LeafCells> cells_;      ///< active cells of each leaf, and their numbers
  LargeArray<Neighbours> upper_;     ///< upper neighbours of each leaf, used by every pass
  std::vector<std::uint32_t> live_;  ///< leaves with points or quads
  std::uint64_t points_ = 0, quads_ = 0;
};

}  // namespace

bool can_contour_level_set(const DualContouringOptions& options) {
  return options.placement == DualContouringOptions::Placement::average ||
         options.truncation >= leaf_kernels::kLeastTruncation;
}

PolygonMesh contour_level_set(const LevelSet& level_set, double isovalue,
                              const DualContouringOptions& options, RunContext& context) {
  const IndexToWorld placement = placement_of(level_set);
  LevelSet volume = level_set;
  while (true) {
    const LeafTable table = [&] {
      const Stage stage(context, "read signs");
      return LeafTable(volume, isovalue, context);
    }();
    const SampledVolume sampled = sampled_volume(table, volume);
    LevelSetContourer contourer(table, sampled, placement, options, context);
    const std::vector<Position> missing = contourer.count();
    if (missing.empty()) return contourer.extract();
    // Rare: the band is so thin, or clipped so, that a cell of the surface begins in a tile. Such a leaf adds
    // no crossing edge, so one repetition is enough; the loop does not rely on it.
    volume = with_leaves(volume, missing);
  }
}

}  // namespace hermesh
