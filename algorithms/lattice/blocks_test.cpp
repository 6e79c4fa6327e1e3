#include "algorithms/lattice/blocks.h"

#include <gtest/gtest.h>

#include "algorithms/core/level_set_grid.h"

namespace hermesh {
namespace {

using openvdb::Coord;

std::size_t crossing_edges(const BlockGrid& grid) {
  std::size_t edges = 0;
  for (std::size_t b = 0; b < grid.blocks().size(); ++b)
    for (const BlockMask& axis : grid.crossing_edges(static_cast<std::int32_t>(b)))
      edges += static_cast<std::size_t>(count(axis));
  return edges;
}

openvdb::FloatGrid::Ptr outside_grid() {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  return grid;
}

TEST(Blocks, OneInsideVoxelHasSixCrossingEdgesWhereverItLies) {
  for (const Coord at :
       {Coord(3, 3, 3), Coord(0, 0, 0), Coord(7, 7, 7), Coord(-1, 8, -8), Coord(4095, 0, -4096)}) {
    auto grid = outside_grid();
    grid->tree().setValue(at, -1.0f);
    RunContext context;
    const BlockGrid blocks(make_level_set(grid), 0.0, context);
    EXPECT_EQ(crossing_edges(blocks), 6u) << at;
  }
}

TEST(Blocks, LookingUpWhereThereIsNoBlockIsRefusedInASentence) {
  auto grid = outside_grid();
  grid->tree().setValue(Coord(3, 3, 3), -1.0f);
  RunContext context;
  const BlockGrid blocks(make_level_set(grid), 0.0, context);
  ASSERT_EQ(blocks.blocks().size(), 1u);
  EXPECT_EQ(blocks.locate(0, 3, 4, 5).block, 0);
  EXPECT_EQ(blocks.locate(0, 3, 4, 5).sample, sample_index(3, 4, 5));
  const auto sentence = [&](int x, int y, int z) -> std::string {
    try {
      blocks.locate(0, x, y, z);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  // A neighbour that is outside throughout, and what is beyond all neighbours.
  EXPECT_NE(sentence(8, 0, 0).find("sample (8, 0, 0) of the block at (0, 0, 0)"), std::string::npos);
  EXPECT_NE(sentence(0, -1, 7).find("no block"), std::string::npos);
  EXPECT_NE(sentence(16, 0, 0).find("no block"), std::string::npos);
  EXPECT_NE(sentence(0, 0, -9).find("no block"), std::string::npos);
}

TEST(Blocks, ATileOfTheOtherSignIsWalledIn) {
  // An inside tile of 8³ alone in the background, where the tree has no leaf at all: 6 faces of 64 edges
  // each.
  auto grid = outside_grid();
  grid->tree().addTile(1, Coord(16, 16, 16), -1.0f, true);
  RunContext context;
  EXPECT_EQ(crossing_edges(BlockGrid(make_level_set(grid), 0.0, context)), 6u * 64u);
  // And one of 128³.
  auto large = outside_grid();
  large->tree().addTile(2, Coord(0, 0, 0), -1.0f, true);
  EXPECT_EQ(crossing_edges(BlockGrid(make_level_set(large), 0.0, context)), 6u * 128u * 128u);
}

TEST(Blocks, AnActiveVoxelBesideATileOfTheOtherSign) {
  auto grid = outside_grid();
  grid->tree().addTile(1, Coord(0, 0, 0), -1.0f, true);
  grid->tree().setValue(Coord(8, 3, 3), 0.5f);  // its leaf replaces nothing: the tile keeps its place
  RunContext context;
  EXPECT_EQ(crossing_edges(BlockGrid(make_level_set(grid), 0.0, context)), 6u * 64u);
}

TEST(Blocks, AnIsovalueBeyondTheBackgroundHasNoSurfaceAndIsQuick) {
  auto grid = outside_grid();
  for (int i = 0; i < 100; ++i) grid->tree().setValue(Coord(1000 * i, -1000 * i, 0), -0.5f);
  RunContext context;
  EXPECT_EQ(crossing_edges(BlockGrid(make_level_set(grid), 1.5, context)), 0u);
  EXPECT_EQ(crossing_edges(BlockGrid(make_level_set(grid), -1.5, context)), 0u);
}

TEST(Blocks, AnOutsideTileInAnInsideBackgroundIsWalledIn) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(-1.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->tree().addTile(2, Coord(0, 0, 0), 1.0f, true);
  RunContext context;
  EXPECT_EQ(crossing_edges(BlockGrid(make_level_set(grid), 0.0, context)), 6u * 128u * 128u);
}

TEST(Blocks, ASampleAtTheIsovalueIsOutside) {
  auto grid = outside_grid();
  grid->tree().setValue(Coord(3, 3, 3), 0.0f);
  RunContext context;
  EXPECT_EQ(crossing_edges(BlockGrid(make_level_set(grid), 0.0, context)), 0u);
  EXPECT_EQ(crossing_edges(BlockGrid(make_level_set(grid), 0.5, context)), 6u);
}

TEST(Blocks, DenseFogIsInside) {
  initialize_openvdb();
  auto grid = openvdb::FloatGrid::create(0.0f);
  grid->setGridClass(openvdb::GRID_FOG_VOLUME);
  grid->tree().setValue(Coord(3, 3, 3), 1.0f);
  RunContext context;
  const BlockGrid blocks(make_level_set(grid), 0.5, context);
  EXPECT_EQ(crossing_edges(blocks), 6u);
  EXPECT_TRUE(test(blocks.blocks()[0].inside, sample_index(3, 3, 3)));
}

TEST(Blocks, PlacementOfAShearedMirroredGridIsTheGridsOwn) {
  auto grid = outside_grid();
  openvdb::Mat4R matrix = openvdb::Mat4R::identity();
  matrix(0, 0) = -0.5;
  matrix(0, 1) = 0.1;
  matrix(2, 2) = 3.0;
  matrix.setTranslation(openvdb::Vec3R(1e5, 2, 3));
  grid->setTransform(openvdb::math::Transform::createLinearTransform(matrix));
  grid->tree().setValue(Coord(5, -6, 7), -1.0f);
  RunContext context;
  const BlockGrid blocks(make_level_set(grid), 0.0, context);
  const IndexToWorld& placement = blocks.placement();
  const openvdb::Vec3d expected = grid->indexToWorld(Coord(5, -6, 7));
  const Eigen::Vector3d found =
      placement.origin +
      placement.local(Eigen::Vector3d(5 - placement.base[0], -6 - placement.base[1], 7 - placement.base[2]));
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(found[axis], expected[axis], 1e-9);
  EXPECT_TRUE(placement.mirrors());
}

}  // namespace
}  // namespace hermesh
