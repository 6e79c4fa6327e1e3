// Cubes of cells that share one point: 2³, 4³ or 8³ cells of a block, as the thesis's mask grid has them
// (Aldén 2011, §6.2).
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/certified_octree/region_cubes.h"
#include "algorithms/extraction/certified_octree/region_proposals.h"
#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// A cube of cells that share one point, or a cell that is alone.
struct Region {
  std::int32_t block;
  std::uint16_t cell;   ///< the cube's first cell, whether the surface passes through it or not
  std::uint16_t level;  ///< 2^level cells a side
  bool merged() const { return level > 0; }
  int side() const { return 1 << level; }
  bool operator==(const Region& other) const = default;
};

/// Which cells share a point. At first these are all cubes that are proposed (region_proposals.h); split()
/// makes them finer.
class CellRegions {
 public:
  static constexpr int kLevels = kCubeLevels;

  /// Proposes cubes. All arguments by reference but `context` must outlive this.
  /// @param cells the lattice's cells
  /// @param points of the uniform mesh; only those of cells that are alone are ever looked at
  /// @param options tolerance and sizes of cubes
  /// @param file rounds places to the file's precision
  /// @param context told of progress, and asked whether to stop
  /// @throws Error if there are more cubes than 32 bits can number; Cancelled
  CellRegions(const CellBlocks& cells, const UniformPoints& points, const RegionOptions& options,
              const FilePoints& file, RunContext& context);

  /// The region of an active cell.
  Region at(std::int32_t block, int cell) const {
    const BlockRegions& own = blocks_[static_cast<std::size_t>(block)];
    for (int level = kLevels; level > 0; --level) {
      const int cube = cube_of(cell, level);
      if ((own.alive[level - 1] >> cube) & 1) return region_of(block, cube, level);
    }
    return {block, static_cast<std::uint16_t>(cell), 0};
  }
  /// The point of a region. A cell that is alone must have one sheet.
  const Eigen::Vector3d& point(const Region& region) const {
    return region.merged() ? cubes_[number(region)].place
                           : points_[cells_.point(region.block, region.cell, 0)];
  }
  /// The mean of the normals of a region's crossings, of unit length; zero where there are none.
  Eigen::Vector3d normal(const Region& region) const;
  /// The least tolerance of the region's cells, voxels.
  float tolerance(const Region& region) const {
    return options_.tolerance.least(cells_, region.block, region.cell, region.side());
  }
  std::size_t cube_count() const { return cubes_.size(); }
  /// The point, and the normal, of the cube with that number.
  const Eigen::Vector3d& place(std::uint32_t cube) const { return cubes_[cube].place; }
  const Eigen::Vector3f& normal(std::uint32_t cube) const { return cubes_[cube].normal; }
  /// The number of a cube, from 0; it never changes.
  std::uint32_t number(const Region& cube) const {
    const BlockRegions& own = blocks_[static_cast<std::size_t>(cube.block)];
    const int number = cube_of(cube.cell, cube.level);
    std::uint64_t before = own.proposed[cube.level - 1u] & ((std::uint64_t{1} << number) - 1);
    if (cube.level > 1)
      return own.first_cube[cube.level - 2u] + static_cast<std::uint32_t>(std::popcount(before));
    const int larger = cube_of(cube.cell, 2);
    before &= parts_of(larger, 2);
    return own.first_part[static_cast<std::size_t>(larger)] +
           static_cast<std::uint32_t>(std::popcount(before));
  }
  /// Splits a cube; its cells are alone until propose_parts() is called. Safe to call for several blocks at
  /// once.
  void split(const Region& region);
  /// Proposes cubes within those that were split. @throws Error if there are more cubes than 32 bits can
  /// number; Cancelled
  void propose_parts(RunContext& context);

  /// Cells of a block that belong to cubes, whether the surface passes through them or not.
  const BlockMask& merged(std::int32_t block) const {
    return blocks_[static_cast<std::size_t>(block)].merged;
  }
  /// The crossing edges of a block, by axis, that have three regions or more around them, one of them a cube.
  std::array<BlockMask, 3> merged_edges(std::int32_t block) const {
    return merged_edges(block, lone_edges(block));
  }
  /// What merged_edges() of the block alone returns, where lone_edges() is at hand as `lone`.
  std::array<BlockMask, 3> merged_edges(std::int32_t block, const std::array<BlockMask, 3>& lone) const;
  /// The crossing edges of a block, by axis, that have no cube around them.
  std::array<BlockMask, 3> lone_edges(std::int32_t block) const;

  /// Calls f(Region) for the cubes of a block, in ascending order by level.
  template <class F>
  void for_each_cube(std::int32_t block, F&& f) const {
    const BlockRegions& own = blocks_[static_cast<std::size_t>(block)];
    for (int level = kLevels; level > 0; --level)
      for (std::uint64_t alive = own.alive[level - 1u]; alive != 0; alive &= alive - 1)
        f(region_of(block, std::countr_zero(alive), level));
  }
  /// The active cells of a block that are alone.
  BlockMask alone(std::int32_t block) const {
    BlockMask result = cells_[block].active_mask();
    for (std::size_t word = 0; word < 8; ++word) result[word] &= ~merged(block)[word];
    return result;
  }

  const CellBlocks& cells() const { return cells_; }
  const RegionOptions& options() const { return options_; }

 private:
  /// The cubes of one block. (Without initializers, so that many can be made without writing them twice.)
  struct BlockRegions {
    std::array<std::uint64_t, kLevels> proposed, alive;  ///< at level − 1: a bit a cube
    std::array<std::uint32_t, kLevels - 1> first_cube;   ///< at level − 2: first number of a cube
    std::array<std::uint32_t, 8> first_part;             ///< first number of a 2³ in each 4³
    BlockMask merged;
    std::array<std::uint64_t, kLevels> asked;  ///< like `alive`: where cubes are to be proposed
  };
  /// Proposes those cubes of a block that are asked for, and finer ones where they do not pass.
  static void propose(RegionProposals& proposals, std::int32_t number, BlockRegions& block,
                      std::vector<ProposedCube>& found);
  static void find_merged(BlockRegions& block);
  std::array<BlockMask, 3> inner_faces(std::int32_t block) const;
  static Region region_of(std::int32_t block, int cube, int level) {
    return {block, static_cast<std::uint16_t>(first_cell(cube, level)), static_cast<std::uint16_t>(level)};
  }
  const CellBlocks& cells_;
  const UniformPoints& points_;
  const RegionOptions& options_;
  const FilePoints& file_;
  LargeArray<BlockRegions> blocks_;
  LargeArray<ProposedCube> cubes_;  ///< all that were ever proposed, by number
};

}  // namespace hermesh
