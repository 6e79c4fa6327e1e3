// Cubes of cells that share one point: 2³, 4³ or 8³ cells of a block, as the thesis's mask grid has them (Aldén 2011, §6.2).
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/core/parallel.h"
#include "algorithms/extraction/manifold_dual_contouring/cell_blocks.h"
#include "algorithms/extraction/manifold_dual_contouring/file_points.h"

namespace hermesh {

/// A cube of cells, or a cell that is alone.
struct Region {
  std::int32_t block;
  std::uint16_t cell;   ///< the cube's first cell, whether the surface passes through it or not
  std::uint16_t level;  ///< 2^level cells a side
  bool merged() const { return level > 0; }
  int side() const { return 1 << level; }
  bool operator==(const Region& other) const = default;
};

/// Which cells share a point. Begins with all cubes that look flat enough, and gets finer by split().
class Regions {
 public:
  static constexpr int kLevels = 3;

  /// A cube is proposed where the surface within it is one disc (by its Euler characteristic, and because those of its
  /// octants are discs that hang together) whose border crosses the cube's edges, none of its cells is fixed, and one place within it is near the planes of all
  /// its crossings for the tolerance.
  /// @param tolerance by point, those on fanned edges included; voxels; where it is 0 or less a cell stays alone
  Regions(const CellBlocks& cells, const std::vector<Eigen::Vector3d>& points, std::span<const float> tolerance,
          const FilePoints& file, RunContext& context);

  /// Of an active cell.
  Region at(std::int32_t block, int cell) const {
    const BlockRegions& own = blocks_[static_cast<std::size_t>(block)];
    for (int level = kLevels; level > 0; --level) {
      const int cube = cube_of(cell, level);
      if ((own.alive[level - 1] >> cube) & 1) return region_of(block, cube, level);
    }
    return {block, static_cast<std::uint16_t>(cell), 0};
  }
  /// Its point. A cell that is alone must have one sheet.
  const Eigen::Vector3d& point(const Region& region) const {
    return region.merged() ? cubes_[number(region)].place
                           : points_[cells_.point(region.block, region.cell, 0)];
  }
  /// Mean of the normals of its crossings; zero where there are none.
  Eigen::Vector3d normal(const Region& region) const;
  /// The least of its cells.
  float tolerance(const Region& region) const {
    return region.merged() ? cubes_[number(region)].tolerance
                           : tolerance_[cells_.point(region.block, region.cell, 0)];
  }
  bool is_alone(std::int32_t block, int cell) const { return !at(block, cell).merged(); }
  std::size_t cube_count() const { return cubes_.size(); }
  /// Of a cube, from 0.
  std::uint32_t number(const Region& cube) const {
    const BlockRegions& own = blocks_[static_cast<std::size_t>(cube.block)];
    const std::uint64_t before = (std::uint64_t{1} << cube_of(cube.cell, cube.level)) - 1;
    return own.first_cube[cube.level - 1u] +
           static_cast<std::uint32_t>(bits_in(own.proposed[cube.level - 1u] & before));
  }
  /// Gives way to the cubes that were proposed within it, or to single cells.
  void split(const Region& region) {
    blocks_[static_cast<std::size_t>(region.block)].alive[region.level - 1] &=
        ~(std::uint64_t{1} << cube_of(region.cell, region.level));
  }

  void split_all() {
    for (BlockRegions& block : blocks_) block.alive = {};
  }

  /// By axis the crossing edges of a block, but for those that have one and the same cube all around them.
  std::array<BlockMask, 3> outer_edges(std::int32_t block) const;
  /// Calls f(CellBlocks::Edge) for them.
  template <class F>
  void for_each_outer_edge(std::int32_t block, F&& f) const {
    const std::array<BlockMask, 3> edges = outer_edges(block);
    for (int axis = 0; axis < 3; ++axis)
      for_each_bit(edges[static_cast<std::size_t>(axis)], [&](int sample) { f(CellBlocks::Edge{block, sample, axis}); });
  }

  /// Calls f(Region) for the cubes of a block, and g(cell) for its active cells that are alone, each in ascending order.
  template <class F, class G>
  void for_each(std::int32_t block, F&& f, G&& g) const {
    const BlockRegions& own = blocks_[static_cast<std::size_t>(block)];
    for (int level = kLevels; level > 0; --level)
      for (std::uint64_t alive = own.alive[level - 1]; alive != 0; alive &= alive - 1) {
        const Region region = region_of(block, std::countr_zero(alive), level);
        if (level == kLevels || at(block, region.cell) == region) f(region);
      }
    for_each_bit(cells_[block].active, [&](int cell) {
      if (is_alone(block, cell)) g(cell);
    });
  }

  const CellBlocks& cells() const { return cells_; }
  const FilePoints& file() const { return file_; }

 private:
  struct BlockRegions {
    std::array<std::uint64_t, kLevels> proposed{}, alive{};  ///< by level, less 1: a bit a cube
    std::array<std::uint32_t, kLevels> first_cube{};
  };
  class Proposals;

  static int cube_of(int cell, int level) {
    const int bits = 3 - level;
    return ((((cell >> 6) >> level) << bits | ((cell >> 3) & 7) >> level) << bits) | (cell & 7) >> level;
  }
  static int first_cell(int cube, int level) {
    const int bits = 3 - level, mask = (1 << bits) - 1;
    return sample_index((cube >> (2 * bits)) << level, ((cube >> bits) & mask) << level, (cube & mask) << level);
  }
  static Region region_of(std::int32_t block, int cube, int level) {
    return {block, static_cast<std::uint16_t>(first_cell(cube, level)), static_cast<std::uint16_t>(level)};
  }
  struct Cube {
    Eigen::Vector3d place;  ///< rounded for the file
    Eigen::Vector3f normal;
    float tolerance;
  };

  const CellBlocks& cells_;
  const std::vector<Eigen::Vector3d>& points_;
  const std::span<const float> tolerance_;
  const FilePoints& file_;
  std::vector<BlockRegions> blocks_;
  std::vector<Cube> cubes_;
};

}  // namespace hermesh
