#include "algorithms/voxelization/inside/regions.h"

#include <gtest/gtest.h>

#include "algorithms/core/run_context.h"

namespace hermesh {
namespace regions_test {

/// Blocks with crossed edges set by hand.
struct Scene {
  std::vector<BlockSet> sets = std::vector<BlockSet>(1);
  BlockTable table;
  std::vector<kernels::EdgeBits> crossed;

  explicit Scene(const std::vector<BlockAt>& blocks) {
    for (const BlockAt& block : blocks) sets[0].insert(block);
    table = BlockTable(sets);
    crossed.resize(table.size(), kernels::EdgeBits{});
  }
  /// Marks the edge up from a voxel as crossed.
  void cross(const BlockAt& voxel, int axis) {
    const std::uint32_t block = table.find(tile_of(voxel));
    ASSERT_NE(block, BlockTable::kNone);
    const unsigned place = place_in_tile(voxel);
    crossed[block].word[axis][place >> 6] |= std::uint64_t(1) << (place & 63);
  }
  std::uint32_t region(const BlockAt& voxel) const {
    const Regions regions = find_regions(table, crossed, RunContext());
    const std::uint32_t block = table.find(tile_of(voxel));
    const unsigned place = place_in_tile(voxel);
    for (std::uint32_t c = regions.first[block]; c < regions.first[block + 1]; ++c)
      if (regions.components[c].voxels[place >> 6] >> (place & 63) & 1) return regions.components[c].region;
    ADD_FAILURE() << "a voxel is in no component";
    return 0;
  }
};

TEST(Regions, EmptyBlocksAreOutside) {
  const Scene scene({{0, 0, 0}, {5, -3, 100}});
  EXPECT_EQ(scene.region({3, 3, 3}), Regions::kOutside);
  EXPECT_EQ(scene.region({40, -20, 803}), Regions::kOutside);
}

TEST(Regions, AVoxelWalledInOnSixSidesIsEnclosed) {
  // At a corner of its block, so that three of the walls are the neighbours' edges.
  Scene scene({{0, 0, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}});
  for (int axis = 0; axis < 3; ++axis) {
    scene.cross({0, 0, 0}, axis);
    BlockAt below{0, 0, 0};
    below[std::size_t(axis)] = -1;
    if (axis < 2) scene.cross(below, axis);
  }
  EXPECT_EQ(scene.region({0, 0, 0}), Regions::kOutside) << "one side is open";
  scene.cross({0, 0, -1}, 2);
  EXPECT_NE(scene.region({0, 0, 0}), Regions::kOutside);
  EXPECT_EQ(scene.region({1, 0, 0}), Regions::kOutside);
}

/// A closed wall of blocks around an empty room `size` blocks wide; the wall's edges are crossed all around.
TEST(Regions, ARoomWithoutBlocksIsOneRegion) {
  for (const std::int32_t size : {1, 9, 70}) {
    std::vector<BlockAt> blocks;
    for (std::int32_t x = -1; x <= size; ++x)
      for (std::int32_t y = -1; y <= size; ++y)
        for (std::int32_t z = -1; z <= size; ++z)
          if (x == -1 || y == -1 || z == -1 || x == size || y == size || z == size)
            blocks.push_back({x, y, z});
    Scene scene(blocks);
    // The wall is between voxels −5 and −4 and at the other end likewise.
    const std::int32_t low = -5, high = 8 * size + 3;
    for (int axis = 0; axis < 3; ++axis)
      for (std::int32_t u = low + 1; u <= high; ++u)
        for (std::int32_t v = low + 1; v <= high; ++v)
          for (const std::int32_t w : {low, high}) {
            BlockAt voxel;
            voxel[std::size_t(axis)] = w;
            voxel[std::size_t(axis + 1) % 3] = u;
            voxel[std::size_t(axis + 2) % 3] = v;
            scene.cross(voxel, axis);
          }
    const std::uint32_t room = scene.region({-1, -1, -1});
    EXPECT_NE(room, Regions::kOutside) << size;
    EXPECT_EQ(scene.region({8 * size, 3, 8 * size}), room) << size;
    EXPECT_EQ(scene.region({-6, 0, 0}), Regions::kOutside) << size;
    // A single missing edge lets the outside in.
    for (kernels::EdgeBits& bits : scene.crossed)
      if (&bits == &scene.crossed[scene.table.find({-1, 0, 0})]) bits.word[0][3] &= ~(std::uint64_t(1) << 9);
    EXPECT_EQ(scene.region({8 * size, 3, 8 * size}), Regions::kOutside) << size;
  }
}

}  // namespace regions_test
}  // namespace hermesh
