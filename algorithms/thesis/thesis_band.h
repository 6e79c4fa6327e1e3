// The sparse grid of the thesis's voxelizer: 8³ blocks with a distance, a triangle and a few flags a voxel.
// The closest point is not stored, for the triangle gives it again.
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
#include "algorithms/thesis/thesis_voxelizer.h"

namespace hermesh::thesis {

/// Stage 1 of §5.1: triangles only, points in index coordinates.
struct Triangles {
  std::vector<Eigen::Vector3d> points;
  std::vector<Triangle> corners;

  /// The corners of a triangle, by number.
  GridTriangle operator[](std::uint32_t id) const {
    return {points[corners[id][0]], points[corners[id][1]], points[corners[id][2]]};
  }
};

/// The point of a triangle, which may be degenerate, that is nearest to p; index coordinates.
Eigen::Vector3d closest_point(const GridTriangle& triangle, const Eigen::Vector3d& p);
/// The centre of a voxel in index coordinates, which are those of its sample.
inline Eigen::Vector3d centre(const Voxel& voxel) {
  return {double(voxel[0]), double(voxel[1]), double(voxel[2])};
}

/// The 6 face and 12 edge adjacent neighbours.
inline constexpr std::array<std::array<int, 3>, 18> kNeighbours = {{{-1, 0, 0},
                                                                    {1, 0, 0},
                                                                    {0, -1, 0},
                                                                    {0, 1, 0},
                                                                    {0, 0, -1},
                                                                    {0, 0, 1},
                                                                    {-1, -1, 0},
                                                                    {-1, 1, 0},
                                                                    {1, -1, 0},
                                                                    {1, 1, 0},
                                                                    {-1, 0, -1},
                                                                    {-1, 0, 1},
                                                                    {1, 0, -1},
                                                                    {1, 0, 1},
                                                                    {0, -1, -1},
                                                                    {0, -1, 1},
                                                                    {0, 1, -1},
                                                                    {0, 1, 1}}};

/// Instead of a block's number: there is none.
inline constexpr std::int32_t kNoBlock = -1;

/// A block of 8³ voxels. Masks are laid out as in blocks.h.
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
  BlockMask layer{};                   ///< the mask grid of §5.5: the voxels that came last
  BlockMask found{}, found_outside{};  ///< results of a parallel pass, before they take effect

  /// Index coordinates of a sample of the block.
  Voxel voxel(int sample) const {
    return {lower[0] + (sample >> 6), lower[1] + ((sample >> 3) & 7), lower[2] + (sample & 7)};
  }
};

/// Hash of a block's place; nothing goes through the map, so that its order has no effect.
struct VoxelHash {
  std::size_t operator()(const Voxel& v) const {
    const auto mix = [](std::uint64_t h) { return (h ^ (h >> 31)) * 0x9e3779b97f4a7c15u; };
    return mix(mix(mix(std::uint32_t(v[0])) + std::uint32_t(v[1])) + std::uint32_t(v[2]));
  }
};

/// The blocks of a grid by place and by number; numbers depend on the order of insertion only.
class Band {
 public:
  std::int32_t size() const { return std::int32_t(blocks_.size()); }
  BandBlock& block(std::int32_t number) { return *blocks_[number]; }
  const BandBlock& block(std::int32_t number) const { return *blocks_[number]; }

  /// The number of the block whose first voxel is `lower`, made if there is none.
  std::int32_t find_or_add(const Voxel& lower);
  /// Merges another grid into this one: the smaller distance wins in every voxel, of equal ones this grid's
  /// own.
  void merge(Band other, const RunContext& context);
  /// Fills in the neighbours of every block from number `first` on, and makes these known to their
  /// neighbours.
  void link(std::int32_t first, const RunContext& context);
  /// Frees a block that nobody will ask for any more.
  void release(std::int32_t number) { blocks_[number].reset(); }

 private:
  std::vector<std::unique_ptr<BandBlock>> blocks_;
  std::unordered_map<Voxel, std::int32_t, VoxelHash> numbers_;
};

/// Where a voxel is kept; no block where the grid has none.
struct Place {
  const BandBlock* block;
  int sample;
  /// Whether the voxel is in a mask of its block; false where there is no block.
  bool in(BlockMask BandBlock::*mask) const { return block && test(block->*mask, sample); }
  float squared_distance() const { return block->squared_distance[sample]; }
};

/// The neighbour of a voxel of a block, once the blocks are linked.
inline Place neighbour(const Band& band, const BandBlock& block, int sample, const std::array<int, 3>& step) {
  const int x = (sample >> 6) + step[0], y = ((sample >> 3) & 7) + step[1], z = (sample & 7) + step[2];
  const LatticePlace there = locate(block.neighbours, x, y, z);
  return {there.block == kNoBlock ? nullptr : &band.block(there.block), there.sample};
}

/// A mask of a block and of one voxel more to every side, on which neighbours are found by shifts.
class PaddedMask {
 public:
  /// Reads the mask of the block and of its 26 neighbours.
  PaddedMask(const Band& band, const BandBlock& block, BlockMask BandBlock::*mask);
  /// Replaces the block's own part.
  void set_inner(const BlockMask& mask);
  BlockMask face_neighbours() const;           ///< voxels next to one of the mask, face to face
  BlockMask face_and_edge_neighbours() const;  ///< likewise, edge to edge as well

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

}  // namespace hermesh::thesis
