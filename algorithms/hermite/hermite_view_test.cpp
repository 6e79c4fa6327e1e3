// Blocks, cells and edges of a view against a plain array of signs.
#include "algorithms/hermite/hermite_view.h"

#include <gtest/gtest.h>

#include <random>
#include <set>

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/test_lattice.h"
#include "algorithms/lattice/active_cells.h"

namespace hermesh {
namespace hermite_view_test {

using Index = std::array<int, 3>;

/// Sparse noise: many blocks own no crossing edge, though cells that begin in them have one.
TestLattice<EdgeCrossing> sparse_noise(unsigned seed, bool outermost) {
  TestLattice<EdgeCrossing> lattice{.outermost = outermost};
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> at(lattice.lower + 1, lattice.lower + lattice.size - 2);
  for (int i = 0; i < 40; ++i) lattice.sign(at(random), at(random), at(random)) = !outermost;
  // Samples at the first corner of a block are those whose cells begin in other blocks.
  lattice.sign(0, 0, 0) = lattice.sign(8, 16, 8) = !outermost;
  lattice.for_each_crossed_edge([&](int axis, int x, int y, int z) {
    lattice.crossings[{axis, x, y, z}] = {0.5f, {1, 0, 0}};
  });
  return lattice;
}

Index index_of(const HermiteView::Block& block, int sample) {
  return {block.lower[0] + (sample >> 6), block.lower[1] + (sample >> 3 & 7), block.lower[2] + (sample & 7)};
}

class HermiteViewTest : public testing::TestWithParam<std::tuple<unsigned, bool>> {
 protected:
  TestLattice<EdgeCrossing> lattice = sparse_noise(std::get<0>(GetParam()), std::get<1>(GetParam()));
  SparseHermite<EdgeCrossing> hermite = to_sparse(lattice);
  RunContext context;
  decltype(view_of(hermite, context)) view = view_of(hermite, context);
  const HermiteView::Blocks& blocks = view.blocks();

  bool crossed(int axis, const Index& p) {
    return lattice.inside(p[0], p[1], p[2]) != lattice.successor(axis, p[0], p[1], p[2]);
  }
};

TEST_P(HermiteViewTest, EveryBlockHasTheSignsOfItsSamples) {
  int without_leaf = 0;
  for (const HermiteView::Block& block : blocks) {
    without_leaf += block.leaf < 0;
    for (int sample = 0; sample < 512; ++sample) {
      const Index p = index_of(block, sample);
      ASSERT_EQ(test(block.inside, sample), lattice.inside(p[0], p[1], p[2]))
          << p[0] << ' ' << p[1] << ' ' << p[2];
    }
  }
  EXPECT_GT(without_leaf, 0);
}

TEST_P(HermiteViewTest, ActiveCellsAreThoseWithAnEdgeThatIsCrossed) {
  std::set<Index> active;
  lattice.for_each_crossed_edge([&](int axis, int x, int y, int z) {
    for (const auto& [u, v] : {std::pair(0, 0), std::pair(-1, 0), std::pair(0, -1), std::pair(-1, -1)}) {
      Index cell = {x, y, z};
      cell[static_cast<std::size_t>((axis + 1) % 3)] += u;
      cell[static_cast<std::size_t>((axis + 2) % 3)] += v;
      active.insert(cell);
    }
  });
  std::set<Index> found;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const BlockMask cells = cells_with_crossings(blocks, b);
    ActiveCells numbered{};
    std::ranges::copy(cells, numbered.active);
    EXPECT_EQ(count_before(numbered), static_cast<std::uint32_t>(count(cells)));
    std::uint32_t number = 0;
    for_each_bit(numbered.active, [&](int cell) {
      EXPECT_EQ(rank_of(numbered, cell), number++);
      found.insert(index_of(blocks[b], cell));
    });
  }
  EXPECT_EQ(found, active);
}

TEST_P(HermiteViewTest, CellsAroundAnEdgeGoRoundItCounterClockwise) {
  std::size_t edges = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    std::uint32_t rank = 0;
    for_each_edge_with_cells(blocks, b, [&](int axis, int sample, const std::array<LatticePlace, 4>& cells) {
      ++edges;
      EXPECT_EQ(blocks[b].rank(axis, sample), rank++);
      const Index edge = index_of(blocks[b], sample);
      ASSERT_TRUE(crossed(axis, edge));
      // Below in both, then one step along u, one along v, and one back: counter-clockwise about the axis.
      const int steps[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
      for (std::size_t i = 0; i < 4; ++i) {
        Index wanted = edge;
        wanted[static_cast<std::size_t>((axis + 1) % 3)] += steps[i][0];
        wanted[static_cast<std::size_t>((axis + 2) % 3)] += steps[i][1];
        ASSERT_GE(cells[i].block, 0);
        EXPECT_EQ(index_of(blocks[static_cast<std::size_t>(cells[i].block)], cells[i].sample), wanted);
        // locate() must find the same position.
        const LatticePlace same = locate(blocks[b].neighbours, wanted[0] - blocks[b].lower[0],
                                         wanted[1] - blocks[b].lower[1], wanted[2] - blocks[b].lower[2]);
        EXPECT_EQ(same.block, cells[i].block);
        EXPECT_EQ(same.sample, cells[i].sample);
      }
    });
  }
  EXPECT_EQ(edges, hermite.crossings.size());
}

INSTANTIATE_TEST_SUITE_P(Noise, HermiteViewTest,
                         testing::Combine(testing::Values(1u, 2u, 3u), testing::Bool()));

}  // namespace hermite_view_test
}  // namespace hermesh
