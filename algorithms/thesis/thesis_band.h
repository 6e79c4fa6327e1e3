// The sparse grid of the thesis's voxelizer: 8³ blocks with a distance, a triangle and a few flags per voxel.
// The closest point follows from the triangle.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <unordered_map>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/lattice/block_mask.h"
#include "algorithms/lattice/block_table.h"
#include "algorithms/thesis/thesis_voxelizer.h"

namespace hermesh::thesis {

/// Stage 1 of §5.1: triangles only, points in index coordinates.
struct Triangles {
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> corners;

  GridTriangle operator[](std::uint32_t id) const {
    return {points[corners[id][0]], points[corners[id][1]], points[corners[id][2]]};
  }
};

/// Returns the point of a triangle, possibly degenerate, that is nearest to p; index coordinates.
Eigen::Vector3d closest_point(const GridTriangle& triangle, const Eigen::Vector3d& p);
/// Returns the centre of a voxel in index coordinates, which are those of its sample.
inline Eigen::Vector3d centre(const Voxel& voxel) {
  return {double(voxel[0]), double(voxel[1]), double(voxel[2])};
}

/// The 6 face and 12 edge adjacent neighbours.
// clang-format off
inline constexpr std::array<std::array<int, 3>, 18> kNeighbours = {{
    {-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1},
    {-1, -1, 0}, {-1, 1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 0, -1}, {-1, 0, 1},
    {1, 0, -1}, {1, 0, 1}, {0, -1, -1}, {0, -1, 1}, {0, 1, -1}, {0, 1, 1}}};
// clang-format on

/// Number of a missing block.
inline constexpr std::int32_t kNoBlock = -1;

/// A block of 8³ voxels. Masks are laid out as in block_mask.h.
struct BandBlock {
  explicit BandBlock(const Voxel& lowest) : lower(lowest) {
    squared_distance.fill(std::numeric_limits<float>::infinity());
    neighbours.fill(kNoBlock);
  }
  Voxel lower;                              ///< multiples of 8
  std::array<std::int32_t, 27> neighbours;  ///< by neighbour_slot(), from Band::link() on
  std::array<float, 512> squared_distance;  ///< voxels²; infinite where no distance is set
  std::array<std::uint32_t, 512> triangle;  ///< triangle that updated the voxel last
  BlockMask set{}, boundary{}, outside{};
  BlockMask layer{};                   ///< the mask grid of §5.5: the voxels added last
  BlockMask found{}, found_outside{};  ///< results of a parallel pass, before they take effect

  /// Returns the index coordinates of a sample of the block.
  Voxel voxel(int sample) const {
    return {lower[0] + (sample >> 6), lower[1] + ((sample >> 3) & 7), lower[2] + (sample & 7)};
  }
};

/// The blocks of a grid by position and by number; numbers depend only on the order of insertion.
class Band {
 public:
  std::int32_t size() const { return std::int32_t(blocks_.size()); }
  BandBlock& block(std::int32_t number) { return *blocks_[number]; }
  const BandBlock& block(std::int32_t number) const { return *blocks_[number]; }

  /// Returns the number of the block whose first voxel is `lower`, and makes it if necessary.
  std::int32_t find_or_add(const Voxel& lower);
  /// Merges another grid into this one: the smaller distance wins in every voxel, for equal ones this grid's
  /// own.
  void merge(Band other, const RunContext& context);
  /// Sets the neighbours of every block from number `first` on, and adds these to their neighbours.
  void link(std::int32_t first, const RunContext& context);
  /// Frees a block that is no longer used.
  void release(std::int32_t number) { blocks_[number].reset(); }

 private:
  std::vector<std::unique_ptr<BandBlock>> blocks_;
  std::unordered_map<Voxel, std::int32_t, BlockHash> numbers_;
};

/// A voxel's block and sample; null without a block.
struct Place {
  const BandBlock* block;
  int sample;
  /// Returns true if the voxel is in a mask of its block; false without a block.
  bool in(BlockMask BandBlock::*mask) const { return block && test(block->*mask, sample); }
  float squared_distance() const { return block->squared_distance[sample]; }
};

/// Returns the neighbour of a voxel of a block, once the blocks are linked.
inline Place neighbour(const Band& band, const BandBlock& block, int sample, const std::array<int, 3>& step) {
  const int x = (sample >> 6) + step[0], y = ((sample >> 3) & 7) + step[1], z = (sample & 7) + step[2];
  const LatticePlace there = locate(block.neighbours, x, y, z);
  return {there.block == kNoBlock ? nullptr : &band.block(there.block), there.sample};
}

/// A mask of a block and one voxel more on every side, for neighbours by shifts.
class PaddedMask {
 public:
  /// Reads the mask of the block and of its 26 neighbours.
  PaddedMask(const Band& band, const BandBlock& block, BlockMask BandBlock::*mask);
  /// Replaces the block's own part.
  void set_inner(const BlockMask& mask);
  BlockMask face_neighbours() const;           ///< voxels that share a face with one of the mask
  BlockMask face_and_edge_neighbours() const;  ///< voxels that share a face or an edge

 private:
  std::uint32_t row(int x, int y) const { return rows_[x + 1][y + 1]; }
  std::uint32_t rows_[10][10];  ///< by x + 1 and y + 1; bit z + 1
};

/// Sets a bit.
inline void add(BlockMask& mask, int sample) { mask[sample >> 6] |= std::uint64_t(1) << (sample & 63); }
template <class F>
BlockMask combined(const BlockMask& a, const BlockMask& b, F&& f) {
  BlockMask result;
  for (int x = 0; x < 8; ++x) result[x] = f(a[x], b[x]);
  return result;
}
inline BlockMask both(const BlockMask& a, const BlockMask& b) { return combined(a, b, std::bit_and<>()); }
inline BlockMask either(const BlockMask& a, const BlockMask& b) { return combined(a, b, std::bit_or<>()); }
inline BlockMask without(const BlockMask& a, const BlockMask& b) {
  return combined(a, b, [](std::uint64_t u, std::uint64_t v) { return u & ~v; });
}

// ---- The stages, in the order of §5.1. Each throws Cancelled.

/// Rasterises (§5.2, algorithms 1 and 2): boundary voxels and their neighbours, with distances and triangles.
/// The blocks are linked.
Band rasterize(const Triangles& triangles, RunContext& context);

/// Determines the signs (§5.3): fills in BandBlock::outside. `sign_angle` is in degrees.
void determine_signs(Band& band, const Triangles& triangles, double sign_angle, RunContext& context);

/// Cleans up (§5.4, algorithms 3 and 4): takes voxels out of BandBlock::set that self-intersections left
/// inside.
void remove_unwanted_voxels(Band& band, RunContext& context);

/// Expands the band (§5.5, algorithm 5) by layers of new voxels as long as one lies within its side's width.
/// The widths are in voxels.
void expand(Band& band, const Triangles& triangles, double exterior, double interior, RunContext& context);

}  // namespace hermesh::thesis
