// A volume as blocks of 8³ samples with their signs as bits: what every extractor walks over.
//
// OpenVDB's leaves are looked up once, here; afterwards a neighbour is an index, a sign is a bit, and which
// edges cross and which cells are active are a few dozen operations on 64-bit words a block.
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// One bit a sample: word x holds sample (x,y,z) at bit 8y+z, the order of OpenVDB's leaves.
using BlockMask = std::array<std::uint64_t, 8>;

constexpr int sample_index(int x, int y, int z) { return 64 * x + 8 * y + z; }
constexpr bool test(const BlockMask& mask, int sample) { return (mask[sample >> 6] >> (sample & 63)) & 1; }
constexpr int count(const BlockMask& mask) {
  int sum = 0;
  for (const std::uint64_t word : mask) sum += std::popcount(word);
  return sum;
}
/// Set bits before `sample`.
constexpr std::uint32_t rank_in(const BlockMask& mask, int sample) {
  int before = std::popcount(mask[sample >> 6] & ((std::uint64_t{1} << (sample & 63)) - 1));
  for (int word = 0; word < sample >> 6; ++word) before += std::popcount(mask[word]);
  return static_cast<std::uint32_t>(before);
}
constexpr bool any(const BlockMask& mask) {
  std::uint64_t all = 0;
  for (const std::uint64_t word : mask) all |= word;
  return all != 0;
}
/// Calls f(sample) for every set bit, in ascending order.
template <class F>
void for_each_bit(const BlockMask& mask, F&& f) {
  for (int x = 0; x < 8; ++x)
    for (std::uint64_t word = mask[x]; word != 0; word &= word - 1) f(64 * x + std::countr_zero(word));
}

/// Place of a neighbour in Block::neighbours, each offset −1, 0 or 1.
constexpr int neighbour_slot(int dx, int dy, int dz) { return 9 * (dx + 1) + 3 * (dy + 1) + (dz + 1); }

/// Instead of a block's index: there is no block, and the samples there are all outside or all inside.
inline constexpr std::int32_t kUniformOutside = -1, kUniformInside = -2;

struct Block {
  std::array<std::int32_t, 3> lower{};  ///< index coordinates of the first sample, multiples of 8
  const float* values = nullptr;        ///< 512 samples, as the grid holds them
  BlockMask inside{}, active{};
  std::array<std::int32_t, 27>
      neighbours{};  ///< by neighbour_slot(); an index of BlockGrid::blocks or kUniform…
};

/// Where samples are in the world.
struct IndexToWorld {
  Eigen::Matrix3d linear = Eigen::Matrix3d::Identity();  ///< voxel to world; any regular affine map
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();      ///< world position of `base`, less `origin`
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();      ///< of the meshes made from the grid, world units
  std::array<std::int32_t, 3> base{};                    ///< index coordinates near the grid's middle or zero

  /// Relative to `origin`, from index coordinates relative to `base`.
  Eigen::Vector3d local(const Eigen::Vector3d& index) const { return linear * index + offset; }
  /// True if the map mirrors, so that the corners of polygons must be turned about.
  bool mirrors() const { return linear.determinant() < 0; }
};

/// The grid's leaves, and blocks of one value wherever a cell with a change of sign lies in a tile or the
/// background. So every edge with a change of sign has both its ends in blocks, and so have the first corners
/// of the four cells around it. Blocks are in the order of the tree, the added ones behind in order of their
/// coordinates.
class BlockGrid {
 public:
  /// In a level set a sample is inside if it is less than the isovalue. In any other volume the background is
  /// outside: samples on the other side of the isovalue are inside, so that dense fog is. A sample exactly at
  /// the isovalue is outside. @throws Error for a value that is not finite and for a grid with perspective.
  BlockGrid(const LevelSet& level_set, double isovalue, RunContext& context);

  const std::vector<Block>& blocks() const { return blocks_; }
  const IndexToWorld& placement() const { return placement_; }

  /// Signed sample: negative inside, in units of the grid's values.
  double signed_value(const Block& block, int sample) const {
    return scale_ * (static_cast<double>(block.values[sample]) - isovalue_);
  }
  /// Block and sample for local coordinates from −8 to 15, where there is a block: at the ends of every edge with a
  /// change of sign, and at the first corners of the four cells around it. Of any other sample Block::neighbours tells
  /// whether there is a block. @throws Error that names the sample if there is none, or if a coordinate is beyond.
  struct Location {
    std::int32_t block;
    int sample;
  };
  Location locate(std::int32_t block, int x, int y, int z) const {
    constexpr auto is_beyond = [](int i) { return static_cast<unsigned>(i + 8) > 23u; };
    if (is_beyond(x) || is_beyond(y) || is_beyond(z)) throw_no_block(block, x, y, z);
    const std::int32_t there =
        blocks_[static_cast<std::size_t>(block)].neighbours[neighbour_slot(x >> 3, y >> 3, z >> 3)];
    if (there < 0) throw_no_block(block, x, y, z);
    return {there, sample_index(x & 7, y & 7, z & 7)};
  }

  /// Inside bits of the sample that is (dx,dy,dz), each 0 or 1, further on than the bit's own.
  BlockMask shifted_inside(std::int32_t block, int dx, int dy, int dz) const;
  /// For each axis the edges from a sample to its successor whose ends differ in sign, at the first sample's
  /// bit.
  std::array<BlockMask, 3> crossing_edges(std::int32_t block) const;

 private:
  void read_leaves(const LevelSet& level_set, RunContext& context);
  [[noreturn]] void throw_no_block(std::int32_t block, int x, int y, int z) const;
  std::vector<Block> blocks_;
  std::vector<std::unique_ptr<std::array<float, 512>>> uniform_values_;
  LevelSet level_set_;  // keeps the leaves alive
  IndexToWorld placement_;
  double isovalue_ = 0.0, scale_ = 1.0;
};

/// Shifts a mask by (dx,dy,dz), each 0 or 1; `upper(ax,ay,az)` gives the mask of the block at that offset.
template <class Upper>
BlockMask shifted_mask(int dx, int dy, int dz, Upper&& upper) {
  constexpr std::uint64_t kLastZ = 0x8080808080808080u;
  BlockMask result;
  for (int x = 0; x < 8; ++x) {
    const int ax = (x + dx) >> 3, word = (x + dx) & 7;
    const auto row_shifted = [&](int az) {
      const std::uint64_t own = upper(ax, 0, az)[word];
      return dy == 0 ? own : (own >> 8) | (upper(ax, 1, az)[word] << 56);
    };
    const std::uint64_t own = row_shifted(0);
    result[x] = dz == 0 ? own : ((own >> 1) & ~kLastZ) | ((row_shifted(1) << 7) & kLastZ);
  }
  return result;
}

}  // namespace hermesh
