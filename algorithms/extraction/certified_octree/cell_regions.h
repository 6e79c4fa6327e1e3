// Cubes of 2³, 4³ or 8³ cells of a block that share one vertex, as in the thesis's mask grid (Aldén 2011,
// §6.2).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "algorithms/core/large_array.h"
#include "algorithms/core/parallel.h"
#include "algorithms/extraction/embedded_mesh/cell_blocks.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"
#include "algorithms/lattice/block_mask.h"

namespace hermesh {

inline constexpr int kCubeLevels = 3;  ///< a cube of a level is 2^level cells wide

/// Returns the index of the cube of a level ≥ 1 that contains a cell. Cubes are numbered along z, then y,
/// then x.
constexpr int cube_of(int cell, int level) {
  const int bits = kCubeLevels - level;
  return ((((cell >> 6) >> level) << bits | ((cell >> 3) & 7) >> level) << bits) | (cell & 7) >> level;
}
/// Returns the first cell of a cube, i.e. the one with the least coordinates.
constexpr int first_cell(int cube, int level) {
  const int bits = kCubeLevels - level, mask = (1 << bits) - 1;
  return sample_index((cube >> (2 * bits)) << level, ((cube >> bits) & mask) << level,
                      (cube & mask) << level);
}
/// Returns the eight cubes of the next finer level in a cube of 4³ or 8³ cells, one bit each.
constexpr std::uint64_t parts_of(int cube, int level) {
  const int first = first_cell(cube, level), step = 1 << (level - 1);
  std::uint64_t parts = 0;
  for (int i = 0; i < 8; ++i)
    parts |= std::uint64_t{1} << cube_of(
                 first + sample_index((i >> 2) * step, ((i >> 1) & 1) * step, (i & 1) * step), level - 1);
  return parts;
}
/// Returns the bits of a cube in each word of a mask that it covers, without the first `skip_y` rows along y
/// and `skip_z` columns along z.
constexpr std::uint64_t rows_of(int first, int side, int skip_y, int skip_z) {
  const std::uint64_t row = (((std::uint64_t{1} << side) - 1) >> skip_z << skip_z) << (first & 7);
  std::uint64_t rows = 0;
  for (int y = skip_y; y < side; ++y) rows |= row << (8 * (((first >> 3) & 7) + y));
  return rows;
}

/// Returns the cells of a block that are at most kSteps (up to 8) along each axis from a cell of a mask.
/// `mask_at(ax, ay, az)`, each −1 to 1, returns a pointer to the mask of the block there, or null.
template <int kSteps, class MaskAt>
BlockMask widened(MaskAt&& mask_at) {
  constexpr int kSide = 8 + 2 * kSteps;
  std::array<std::array<std::uint32_t, kSide>, kSide> rows;  // by x and y: bits along z, from −kSteps on
  for (int x = 0; x < kSide; ++x)
    for (int y = 0; y < kSide; ++y) {
      const int at_x = x - kSteps, at_y = y - kSteps;
      std::uint32_t row = 0;
      for (int az = -1; az <= 1; ++az) {
        const BlockMask* mask = mask_at(at_x >> 3, at_y >> 3, az);
        if (!mask) continue;
        const auto bits = static_cast<std::uint32_t>(((*mask)[at_x & 7] >> (8 * (at_y & 7))) & 0xff);
        row |= az < 0 ? bits >> (8 - kSteps) : bits << (kSteps + 8 * az);
      }
      rows[x][y] = row;
    }
  BlockMask result{};
  for (int x = 0; x < 8; ++x)
    for (int y = 0; y < 8; ++y) {
      std::uint32_t row = 0, wide = 0;
      for (int i = 0; i <= 2 * kSteps; ++i)
        for (int j = 0; j <= 2 * kSteps; ++j) row |= rows[x + i][y + j];
      for (int k = 0; k <= 2 * kSteps; ++k) wide |= row >> k;
      result[x] |= std::uint64_t{wide & 0xff} << (8 * y);
    }
  return result;
}

/// Tolerances in voxels: one per cell, by CellBlocks::cell_number(), or the same for all.
class CellTolerances {
 public:
  explicit CellTolerances(float all) : all_(all) {}
  explicit CellTolerances(std::vector<float> by_cell) : by_cell_(std::move(by_cell)) {}
  /// Returns the least tolerance of all cells.
  float least() const { return by_cell_.empty() ? all_ : *std::ranges::min_element(by_cell_); }
  /// Returns the least tolerance of the active cells of a cube, given by its first cell and its side in
  /// cells.
  float least(const CellBlocks& cells, std::int32_t block, int first, int side) const;

 private:
  float all_ = 0;
  std::vector<float> by_cell_;
};

struct RegionOptions {
  CellTolerances tolerance;  ///< cells with a tolerance of 0 or less do not merge
  double flatness = 0;  ///< largest root mean square distance in voxels of a cube's vertex from the planes of
                        ///< its crossings; 0: derived from the tolerance
  int largest_cube = 8;  ///< cells per side: 2, 4 or 8
};

/// The data that the cells of a cube share.
struct ProposedCube {
  Eigen::Vector3d place;   ///< position of its vertex, rounded for the file
  Eigen::Vector3f normal;  ///< mean normal of its crossings, unit length
};

/// A cube of cells that share one vertex, or a single cell.
struct Region {
  std::int32_t block;
  std::uint16_t cell;   ///< the cube's first cell, active or not
  std::uint16_t level;  ///< 2^level cells per side
  bool merged() const { return level > 0; }
  int side() const { return 1 << level; }
  bool operator==(const Region& other) const = default;
};

class RegionProposals;

/// The partition of the active cells into regions: at first all proposed cubes, which split() refines.
///
/// A cube is proposed if the surface within it is a disc with a simple border, none of its cells is near a
/// special one (CellBlocks::Block::special), and some position within it is near the planes of all its
/// crossings, as the tolerance requires. The border is simple if each edge of the cube is crossed at most
/// once, and the border passes each of its faces at most once, from edge to edge. (The thesis, §6.3 and §6.4,
/// tests the signs of corners and midpoints, and merges small cubes into large ones.)
class CellRegions {
 public:
  static constexpr int kLevels = kCubeLevels;

  /// Proposes cubes. All arguments by reference except `context` must outlive this.
  /// @param cells the lattice's cells
  /// @param points vertices of the uniform mesh; only those of single cells are read
  /// @param options tolerance and sizes of cubes
  /// @param file rounds positions to the file's precision
  /// @param context receives the progress and the request to cancel
  /// @throws Error for more than 2³² cubes; Cancelled
  CellRegions(const CellBlocks& cells, const UniformPoints& points, const RegionOptions& options,
              const FilePoints& file, RunContext& context);

  /// Returns the region of an active cell.
  Region at(std::int32_t block, int cell) const {
    for (int level = kLevels; level > 0; --level) {
      const int cube = cube_of(cell, level);
      if ((blocks_[block].alive[level - 1] >> cube) & 1) return region_of(block, cube, level);
    }
    return {block, static_cast<std::uint16_t>(cell), 0};
  }
  /// Returns the vertex of a region. A single cell must have one sheet.
  const Eigen::Vector3d& point(const Region& region) const {
    return region.merged() ? cubes_[number(region)].place
                           : points_[cells_.point(region.block, region.cell, 0)];
  }
  /// Returns the mean normal of a region's crossings, of unit length; zero if there are no normals.
  Eigen::Vector3d normal(const Region& region) const;
  /// Returns the least tolerance of the region's cells, voxels.
  float tolerance(const Region& region) const {
    return options_.tolerance.least(cells_, region.block, region.cell, region.side());
  }
  std::size_t cube_count() const { return cubes_.size(); }
  /// Returns the vertex and the normal of the cube with this number.
  const ProposedCube& cube(std::uint32_t number) const { return cubes_[number]; }
  /// Returns the number of a cube, from 0; it never changes.
  std::uint32_t number(const Region& cube) const {
    const BlockRegions& own = blocks_[cube.block];
    const int number = cube_of(cube.cell, cube.level);
    std::uint64_t before = own.proposed[cube.level - 1u] & ((std::uint64_t{1} << number) - 1);
    if (cube.level > 1) return own.first_cube[cube.level - 2u] + std::popcount(before);
    const int larger = cube_of(cube.cell, 2);
    return own.first_part[larger] + std::popcount(before & parts_of(larger, 2));
  }
  /// Splits a cube into single cells until the next propose_parts(). Safe to call for several blocks
  /// concurrently.
  void split(const Region& region);
  /// Proposes smaller cubes within those that were split. @throws Error for more than 2³² cubes; Cancelled
  void propose_parts(RunContext& context);

  /// Returns the cells of a block that belong to cubes, active or not.
  const BlockMask& merged(std::int32_t block) const { return blocks_[block].merged; }
  /// Returns the crossed edges of a block, by axis, with at least three regions around them, one of them a
  /// cube.
  std::array<BlockMask, 3> merged_edges(std::int32_t block) const {
    return merged_edges(block, lone_edges(block));
  }
  /// Returns the same, given lone_edges() of the block.
  std::array<BlockMask, 3> merged_edges(std::int32_t block, const std::array<BlockMask, 3>& lone) const;
  /// Returns the crossed edges of a block, by axis, with no cube around them.
  std::array<BlockMask, 3> lone_edges(std::int32_t block) const;

  /// Calls f(Region) for the cubes of a block, by descending level and ascending position.
  template <class F>
  void for_each_cube(std::int32_t block, F&& f) const {
    for (int level = kLevels; level > 0; --level)
      for (std::uint64_t alive = blocks_[block].alive[level - 1]; alive != 0; alive &= alive - 1)
        f(region_of(block, std::countr_zero(alive), level));
  }
  /// Returns the active cells of a block that are not part of a cube.
  BlockMask alone(std::int32_t block) const {
    BlockMask result = cells_[block].active_mask();
    for (int word = 0; word < 8; ++word) result[word] &= ~merged(block)[word];
    return result;
  }

  const CellBlocks& cells() const { return cells_; }

 private:
  /// The cubes of one block. (Without initializers, so that resizing an array of them writes nothing.)
  struct BlockRegions {
    std::array<std::uint64_t, kLevels> proposed, alive;  ///< at level − 1: one bit per cube
    std::array<std::uint32_t, kLevels - 1> first_cube;   ///< at level − 2: number of the first cube
    std::array<std::uint32_t, 8> first_part;             ///< number of the first 2³ cube in each 4³ cube
    BlockMask merged;
    std::array<std::uint64_t, kLevels> asked;  ///< like `alive`: where cubes are to be proposed
  };
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
  LargeArray<ProposedCube> cubes_;  ///< all cubes ever proposed, by number
};

}  // namespace hermesh
