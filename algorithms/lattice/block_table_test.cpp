#include "algorithms/lattice/block_table.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

namespace hermesh {
namespace block_table_test {

TEST(BlockTable, NumbersTheUnionHoweverItIsSpread) {
  std::mt19937 random(3);
  std::set<BlockAt> truth;
  std::vector<BlockSet> two(2), five(5);
  for (int i = 0; i < 5000; ++i) {
    BlockAt block;
    for (std::int32_t& c : block) c = std::int32_t(random() % 60) - 30;
    truth.insert(block);
    two[random() % 2].insert(block);
    five[random() % 5].insert(block);
  }
  const BlockTable a(two), b(five);
  ASSERT_EQ(a.size(), truth.size());
  EXPECT_EQ(a.blocks(), b.blocks());
  const std::vector<BlockAt> blocks = a.blocks();
  EXPECT_EQ(std::set<BlockAt>(blocks.begin(), blocks.end()), truth);
  BlockFinder finder(a);
  for (std::uint32_t i = 0; i < blocks.size(); ++i) {
    ASSERT_EQ(a.find(blocks[i]), i);
    ASSERT_EQ(finder.find(blocks[i]), i);
  }
  EXPECT_EQ(a.find({31, 0, 0}), BlockTable::kNone);
}

TEST(BlockTable, CodesStandForTheirBlocks) {
  std::vector<BlockSet> parts(1);
  const std::uint32_t far = parts[0].insert({1 << 26, -(1 << 26), 5}), near = parts[0].insert({-1, -1, -1});
  const BlockTable table(parts);
  const std::vector<std::uint32_t> translation = table.translation(parts[0]);
  EXPECT_EQ(table.number(translation, far), table.find({1 << 26, -(1 << 26), 5}));
  EXPECT_EQ(table.number(translation, near), table.find({-1, -1, -1}));
  EXPECT_EQ(table.tiles().size(), 2u) << "memory is for what is there";
}

}  // namespace block_table_test
}  // namespace hermesh
