#include "algorithms/extraction/embedded_mesh/uniform_points.h"

#include <gtest/gtest.h>

#include <set>

#include "algorithms/extraction/embedded_mesh/cell_blocks.h"

namespace hermesh {
namespace uniform_points_test {

using Eigen::Vector3d;

TEST(UniformPoints, OfFewHasRoomForThoseOnly) {
  constexpr std::uint32_t kCells = 1003, kAll = 1010;
  UniformPoints points = UniformPoints::of_few(kCells);
  EXPECT_EQ(points.slots(), 0u);
  std::set<std::uint32_t> wanted;
  for (std::uint32_t p = 5; p < 480; p += 97) {
    for (const std::uint32_t asked : {p + 512, p, p}) points.ask(asked);
    points.make_room();
    for (const std::uint32_t asked : {p, p + 512}) {
      points[asked] = Vector3d::Constant(asked);
      wanted.insert(asked);
    }
  }
  EXPECT_LE(points.slots(), 8 * wanted.size());
  points.extend(kCells, kAll);  // begins within the last cells' run
  for (std::uint32_t p = kCells; p < kAll; ++p) {
    points[p] = Vector3d::Constant(p);
    wanted.insert(p);
  }
  points.extend(kCells, kCells + 2);
  std::set<std::size_t> slots;
  for (const std::uint32_t p : wanted) {
    if (p >= kCells + 2) continue;
    EXPECT_EQ(points[p], Vector3d::Constant(p)) << p;
    slots.insert(points.slot(p));
  }
  EXPECT_EQ(slots.size(), wanted.size() - (kAll - kCells - 2));
  EXPECT_LT(*slots.rbegin(), points.slots());
}

TEST(UniformPoints, OfAllIsOnePiece) {
  UniformPoints points = UniformPoints::of_all(100);
  for (std::uint32_t p = 0; p < 100; ++p) points[p] = Vector3d::Constant(p);
  points.extend(100, 103);
  points[102] = Vector3d::Constant(102);
  const std::vector<Vector3d> taken = points.take();
  ASSERT_EQ(taken.size(), 103u);
  EXPECT_EQ(taken[99], Vector3d::Constant(99));
  EXPECT_EQ(taken[102], Vector3d::Constant(102));
}

TEST(ByBlock, ReadsAnEmptyOneWhereThereIsNone) {
  ByBlock<std::vector<int>> lists(3);
  lists.at(1).push_back(7);
  EXPECT_TRUE(lists[0].empty());
  EXPECT_FALSE(lists.has(0));
  EXPECT_EQ(lists[1], std::vector<int>{7});
  lists.clear(1);
  EXPECT_FALSE(lists.has(1));
  EXPECT_TRUE(lists[1].empty());
}

}  // namespace uniform_points_test
}  // namespace hermesh
