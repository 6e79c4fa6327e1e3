#include "algorithms/lattice/leaf_table.h"

#include <gtest/gtest.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/lattice/simd/simd_level.h"

namespace hermesh {
namespace leaf_table_test {

using openvdb::Coord;

class LeafTableTest : public testing::Test {
 protected:
  void SetUp() override { initialize_openvdb(); }
  LeafTable table(const openvdb::FloatGrid::Ptr& grid, double isovalue = 0.0) {
    return LeafTable(make_level_set(grid), isovalue, context_);
  }

  /// Every edge with a change of sign must start in a leaf: the last samples of a leaf and of each of its
  /// neighbours are compared with the values in the tree itself.
  static void expect_complete(const LeafTable& table, const openvdb::CoordBBox& box) {
    const auto inside = [&](const Coord& at) { return table.rule()(table.tree().getValue(at)); };
    for (auto it = box.begin(); it; ++it)
      for (int axis = 0; axis < 3; ++axis) {
        Coord next = *it;
        ++next[axis];
        if (inside(*it) == inside(next)) continue;
        EXPECT_NE(table.tree().probeConstLeaf(*it), nullptr) << *it;
      }
  }

  RunContext context_;
};

TEST_F(LeafTableTest, NeighboursAndSignsAreTheTrees) {
  const auto sphere = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
      90.0f, openvdb::Vec3f(3.0f, -70.0f, 5.0f), 1.0f);
  const LeafTable leaves = table(sphere);
  ASSERT_EQ(leaves.size(), sphere->tree().leafCount());
  std::size_t across_nodes = 0;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    const Coord lower(leaves.lower(i).data());
    for (int sample = 0; sample < 512; sample += 37) {
      const Coord at = lower.offsetBy(sample >> 6, (sample >> 3) & 7, sample & 7);
      ASSERT_EQ(test(leaves.inside(i), sample), sphere->tree().getValue(at) < 0.0f);
      ASSERT_EQ(test(leaves.active(i), sample), sphere->tree().isValueOn(at));
    }
    for (int slot = 0; slot < 27; ++slot) {
      const int dx = slot / 9 - 1, dy = slot / 3 % 3 - 1, dz = slot % 3 - 1;
      const Coord there = lower.offsetBy(8 * dx, 8 * dy, 8 * dz);
      const std::int32_t found = leaves.neighbour(i, dx, dy, dz);
      if (const auto* leaf = sphere->tree().probeConstLeaf(there)) {
        ASSERT_GE(found, 0);
        ASSERT_EQ(leaves.values(static_cast<std::size_t>(found)), leaf->buffer().data());
        across_nodes += (lower.x() >> 7) != (there.x() >> 7);
      } else {
        ASSERT_EQ(found, sphere->tree().getValue(there) < 0.0f ? kUniformInside : kUniformOutside);
      }
    }
  }
  EXPECT_GT(across_nodes, 100u);
}

TEST_F(LeafTableTest, SurroundingsAreAllNeighboursAndTheOrderOfPlaceIsLexicographic) {
  // Scattered over 4³ nodes, so that all their sides are met.
  const auto grid = openvdb::FloatGrid::create(3.0f);
  std::mt19937 random(3);
  for (int i = 0; i < 4000; ++i) {
    const auto at = [&] { return static_cast<int>(random() % 300) - 150; };
    grid->tree().setValue(Coord(at(), at(), at()), random() % 2 ? 1.0f : -1.0f);
  }
  grid->tree().addTile(1, Coord(8, 8, 8), -3.0f, false);
  const LeafTable leaves = table(grid);
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    const std::array<std::int32_t, 27> around = leaves.surroundings(i);
    ASSERT_EQ(around[13], static_cast<std::int32_t>(i));
    for (int slot = 0; slot < 27; ++slot)
      ASSERT_EQ(around[slot], leaves.neighbour(i, slot / 9 - 1, slot / 3 % 3 - 1, slot % 3 - 1)) << slot;
  }
  std::vector<std::uint32_t> order;
  for (const LeafPlaces::Slab& slab : leaves.slabs()) {
    const std::size_t before = order.size();
    leaves.for_each_leaf(slab, [&](std::uint32_t leaf) { order.push_back(leaf); });
    for (std::size_t i = before; i < order.size(); ++i)
      ASSERT_EQ(leaves.lower(order[i])[0], leaves.lower(order[before])[0]);
    std::vector<std::uint32_t> in_order(order.begin() + static_cast<std::ptrdiff_t>(before), order.end()),
        in_ranges;
    leaves.for_each_range(slab, [&](std::uint32_t first, std::uint32_t end) {
      for (std::uint32_t leaf = first; leaf < end; ++leaf) in_ranges.push_back(leaf);
    });
    std::ranges::sort(in_order), std::ranges::sort(in_ranges);
    ASSERT_EQ(in_ranges, in_order);
  }
  ASSERT_EQ(order.size(), leaves.size());
  for (std::size_t i = 1; i < order.size(); ++i)
    ASSERT_LT(leaves.lower(order[i - 1]), leaves.lower(order[i]));
  const auto empty = openvdb::FloatGrid::create(3.0f);
  EXPECT_TRUE(table(empty).slabs().empty());
}

TEST_F(LeafTableTest, TilesOfBothSignsSideBySideBecomeLeaves) {
  // A tile of 8³, then one of 128³ as well, inside, in a background that is outside.
  const auto grid = openvdb::FloatGrid::create(3.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->tree().addTile(1, Coord(0, 0, 0), -3.0f, false);
  const LeafTable small = table(grid);
  EXPECT_EQ(small.size(), 7u);  // the tile and its neighbours, three of which own edges that lead into it
  expect_complete(small, openvdb::CoordBBox(Coord(-10), Coord(18)));

  grid->tree().addTile(2, Coord(256, 0, 0), -3.0f, false);
  const LeafTable both = table(grid);
  expect_complete(both, openvdb::CoordBBox(Coord(250, -4, -4), Coord(262, 8, 8)));
  expect_complete(both, openvdb::CoordBBox(Coord(378, 120, 120), Coord(390, 132, 132)));
}

TEST_F(LeafTableTest, ALeafBesideATileOfTheOtherSignBringsTheTileIn) {
  // One sample inside at the leaf's first corner: the edges that lead to it start in three neighbours without
  // leaves.
  const auto grid = openvdb::FloatGrid::create(3.0f);
  grid->setGridClass(openvdb::GRID_LEVEL_SET);
  grid->tree().setValue(Coord(0, 0, 0), -1.0f);
  EXPECT_EQ(grid->tree().leafCount(), 1u);
  const LeafTable leaves = table(grid);
  EXPECT_EQ(leaves.size(), 4u);
  EXPECT_EQ(grid->tree().leafCount(), 1u);  // the input is as it was
  expect_complete(leaves, openvdb::CoordBBox(Coord(-9), Coord(9)));
}

TEST_F(LeafTableTest, AComparisonWithARoundedIsovalueDecidesAsWithTheExactOne) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> isovalues(-2.0, 2.0);
  for (const bool level_set : {true, false})
    for (int i = 0; i < 1000; ++i) {
      const auto grid = openvdb::FloatGrid::create(level_set ? 5.0f : -5.0f);
      if (level_set) grid->setGridClass(openvdb::GRID_LEVEL_SET);
      const double isovalue = isovalues(random);
      const InsideRule rule = inside_rule(*grid, isovalue);
      const float near = static_cast<float>(isovalue);
      for (const float value : {near, std::nextafter(near, 9.0f), std::nextafter(near, -9.0f)}) {
        const bool expected = level_set ? double(value) < isovalue : double(value) > isovalue;
        ASSERT_EQ(rule(value), expected) << value << " against " << isovalue;
        ASSERT_EQ(rule.signed_value(value) < 0.0f, expected);
      }
    }
}

/// Every sample of a leaf, including values at and near the isovalue, and a bad value at every position.
TEST_F(LeafTableTest, SignsAreTheSameAtAnyLevelOfVectorCode) {
  std::mt19937 random(31);
  for (const SimdLevel level : available_simd_levels()) {
    setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
    for (const bool level_set : {true, false}) {
      const float isovalue = level_set ? 0.0f : 0.25f;
      const auto grid = openvdb::FloatGrid::create(level_set ? 3.0f : 0.0f);
      if (level_set) grid->setGridClass(openvdb::GRID_LEVEL_SET);
      auto* leaf = grid->tree().touchLeaf(Coord(0));
      for (openvdb::Index i = 0; i < 512; ++i)
        leaf->setValueOn(
            i, std::nextafter(isovalue, float(int(random() % 3) - 1)) + float(int(random() % 3) - 1));
      const LeafTable leaves = table(grid, isovalue);
      std::size_t number = 0;  // neighbouring tiles may have become leaves
      while (leaves.lower(number) != std::array<std::int32_t, 3>{}) ++number;
      for (int i = 0; i < 512; ++i) {
        const float value = leaf->getValue(static_cast<openvdb::Index>(i));
        ASSERT_EQ(test(leaves.inside(number), i), level_set ? value < isovalue : value > isovalue)
            << i << " at " << name(level);
      }
    }
    for (openvdb::Index i = 0; i < 512; ++i) {
      const auto grid = openvdb::FloatGrid::create(3.0f);
      const float infinite = std::numeric_limits<float>::infinity();
      grid->tree().touchLeaf(Coord(0))->setValueOn(i, i % 3 == 0   ? infinite
                                                      : i % 3 == 1 ? -infinite
                                                                   : infinite - infinite);
      EXPECT_THROW(table(grid), Error) << i << " at " << name(level);
    }
  }
  unsetenv("HERMESH_SIMD");
}

TEST_F(LeafTableTest, LookingUpWhereThereIsNoLeafIsRefusedInASentence) {
  auto grid = openvdb::FloatGrid::create(1.0f);
  grid->tree().setValue(Coord(3, 3, 3), -1.0f);
  const LeafTable leaves = table(grid);
  ASSERT_EQ(leaves.size(), 1u);
  EXPECT_EQ(leaves.locate(0, 3, 4, 5).block, 0);
  EXPECT_EQ(leaves.locate(0, 3, 4, 5).sample, sample_index(3, 4, 5));
  const auto sentence = [&](int x, int y, int z) -> std::string {
    try {
      leaves.locate(0, x, y, z);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  // A neighbour that is outside throughout, and a position beyond all neighbours.
  EXPECT_NE(sentence(8, 0, 0).find("sample (8, 0, 0) of the leaf at (0, 0, 0)"), std::string::npos);
  EXPECT_NE(sentence(0, -1, 7).find("no leaf"), std::string::npos);
  EXPECT_NE(sentence(16, 0, 0).find("no leaf"), std::string::npos);
  EXPECT_NE(sentence(0, 0, -9).find("no leaf"), std::string::npos);
}

TEST(SignReader, RowsAreThoseOfTheRuleAtAnyLevelOfVectorCode) {
  std::mt19937 random(7);
  std::array<float, 512> values;
  for (float& value : values) value = float(int(random() % 5) - 2);  // the isovalue among them
  for (const SimdLevel level : available_simd_levels()) {
    setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
    const SignReader& reader = chosen_kernels<SignReader>();
    for (const InsideRule rule : {InsideRule{1.0f, 1.0f}, InsideRule{-1.0f, -1.0f}})
      for (const std::size_t stride : {8, 64}) {
        const std::uint64_t rows = reader.rows(values.data(), stride, rule);
        for (std::size_t i = 0; i < 64; ++i)
          ASSERT_EQ((rows >> i & 1) != 0, rule(values[stride * (i / 8) + i % 8])) << name(level) << ' ' << i;
      }
  }
  unsetenv("HERMESH_SIMD");
}

TEST_F(LeafTableTest, ValuesThatAreNotFiniteAreRefused) {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()}) {
    const auto grid = openvdb::FloatGrid::create(3.0f);
    grid->tree().setValue(Coord(3, 4, 5), bad);
    EXPECT_THROW(table(grid), Error);
  }
  EXPECT_THROW(table(openvdb::FloatGrid::create(1.0f), std::nan("")), Error);
}

}  // namespace leaf_table_test
}  // namespace hermesh
