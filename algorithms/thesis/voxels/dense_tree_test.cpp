// Tests the trees with OpenVDB's tools, and the trees' tiles.
#include "algorithms/thesis/voxels/dense_tree.h"

#include <gtest/gtest.h>
#include <openvdb/tools/Prune.h>

#include <algorithm>
#include <cmath>

#include "algorithms/hermite/test_lattice.h"
#include "algorithms/thesis/voxels/voxels.h"

namespace hermesh {
namespace dense_tree_test {

using openvdb::Coord;

template <class Voxel>
const auto& tree_of(const DenseHermite<Voxel>& dense) {
  return dense.grid->tree();
}

/// Dense data with another grid in them.
template <class Voxel>
DenseHermite<Voxel> replaced(DenseHermite<Voxel> dense, typename DenseGrid<Voxel>::Ptr grid) {
  dense.grid = grid;
  return dense;
}

template <class Voxel>
class DenseTreeOf : public testing::Test {
 protected:
  RunContext context_;
};
using AllVoxels = testing::Types<FloatVoxel, DirectedVoxel, ThesisVoxel, FixedVoxel>;
TYPED_TEST_SUITE(DenseTreeOf, AllVoxels);

// OpenVDB prunes leaves and nodes of one value and state. None of ours may be: the leaf would lose crossings.
TYPED_TEST(DenseTreeOf, PruningChangesNoValue) {
  std::mt19937 random(5);
  const FloatHermite sparse = to_sparse(sample_solid(random_blobs(random)));
  const auto dense = to_dense<TypeParam>(sparse, this->context_);
  const auto grid = dense.grid->deepCopy();
  openvdb::tools::prune(grid->tree());
  openvdb::tools::pruneLevelSet(grid->tree());
  EXPECT_EQ(grid->tree().leafCount(), dense.leaves());
  EXPECT_TRUE(same(to_sparse(replaced(dense, grid), this->context_), to_sparse(dense, this->context_)));
}

/// Data moved by `offset` samples (a multiple of 8) further along x.
FloatHermite moved(FloatHermite hermite, int offset) {
  for (SignLeaf& leaf : hermite.leaves) leaf.lower[0] += offset;
  return hermite;
}

// Two solids whose leaves are apart: OpenVDB's ways to put trees together lose no voxel of either.
TYPED_TEST(DenseTreeOf, TreesOfDisjointSolidsCombine) {
  const FloatHermite left = to_sparse(sample_solid(ball(12, 12, 12, 9.3)));
  const FloatHermite right = moved(left, 64);
  const auto a = to_dense<TypeParam>(left, this->context_), b = to_dense<TypeParam>(right, this->context_);
  const auto sum = a.grid->deepCopy();
  auto& tree = sum->tree();
  tree.topologyUnion(tree_of(b));
  EXPECT_EQ(tree.leafCount(), 2 * a.leaves());
  EXPECT_EQ(tree.activeVoxelCount(), 2 * tree_of(a).activeVoxelCount());
  auto other = b.grid->deepCopy();
  tree.combine(other->tree(), [](const TypeParam& x, const TypeParam& y, TypeParam& result) {
    result = y == TypeParam{} ? x : y;
  });
  const auto both = replaced(a, sum);
  EXPECT_EQ(both.crossings(), 2 * a.crossings());
  EXPECT_NO_THROW(check_consistent(both, this->context_));
  for (auto it = tree_of(a).cbeginValueOn(); it; ++it) ASSERT_TRUE(tree.getValue(it.getCoord()) == *it);
  for (auto it = tree_of(b).cbeginValueOn(); it; ++it) ASSERT_TRUE(tree.getValue(it.getCoord()) == *it);
}

// merge() moves nodes that only the other tree has. It takes no inactive tiles, so of two solids in one node
// the inside of the second has to be filled again; in separate nodes everything is transferred.
TYPED_TEST(DenseTreeOf, MergingMovesNodes) {
  const FloatHermite left = to_sparse(sample_solid(ball(12, 12, 12, 9.3)));
  for (const int distance : {64, 256}) {
    const auto a = to_dense<TypeParam>(left, this->context_);
    const auto b = to_dense<TypeParam>(moved(left, distance), this->context_);
    const auto merged = a.grid->deepCopy(), donor = b.grid->deepCopy();
    merged->tree().merge(donor->tree());
    const auto both = replaced(a, merged);
    EXPECT_EQ(both.leaves(), 2 * a.leaves());
    EXPECT_EQ(both.crossings(), 2 * a.crossings());
    EXPECT_EQ(merged->tree().getValue(Coord(12 + distance, 12, 12)).inside(), distance == 256);
    if (distance == 256) {
      EXPECT_NO_THROW(check_consistent(both, this->context_));
    }
  }
}

class DenseTiles : public testing::Test {
 protected:
  RunContext context_;
};

/// Number of inside samples that the leaves and the tiles of each level represent.
template <class Tree>
std::array<std::size_t, 4> inside_samples_by_depth(const Tree& tree) {
  std::array<std::size_t, 4> sum{};
  for (auto it = tree.cbeginValueAll(); it; ++it)
    if (it->inside()) sum[it.getDepth()] += it.getVoxelCount();
  return sum;
}

// A ball that leaves of the surface do not fill: its middle is tiles of 8³ samples, 128³ not being possible
// at this radius in a tree whose nodes start at multiples of 128 with the centre between four of them.
TEST_F(DenseTiles, ABigBallIsFilledWithTiles) {
  const auto lattice = sample_solid(ball(0.3, 0.2, 0.1, 100), -112, 224);
  const FixedDense dense = to_dense<FixedVoxel>(to_sparse(lattice), context_);
  const auto& tree = tree_of(dense);
  EXPECT_TRUE(tree.getValue(Coord(0)).inside());
  EXPECT_FALSE(tree.isValueOn(Coord(0)));
  EXPECT_EQ(tree.getValueDepth(Coord(0)), 2);
  EXPECT_FALSE(tree.getValue(Coord(0, 0, 101)).inside());
  const auto sum = inside_samples_by_depth(tree);
  const auto expected = static_cast<std::size_t>(std::count(lattice.signs.begin(), lattice.signs.end(), 1));
  EXPECT_EQ(sum[0] + sum[1] + sum[2] + sum[3], expected);
  // Leaves lie about the surface: those that are whole within the ball are within 100 − 8√3 of the middle.
  EXPECT_EQ(sum[0] + sum[1], 0u);
  EXPECT_GT(static_cast<double>(sum[2]), 4.0 / 3 * M_PI * std::pow(100 - 8 * std::sqrt(3.0), 3) * 0.95);
  EXPECT_EQ(sum[2] % 512, 0u);
}

/// Two walls perpendicular to z, 8 samples square, at z0 and z1, with the space between them inside: the
/// upper wall's leaf is entirely inside, so the middle has to be filled from the leaves at the ends. The
/// sides are omitted, which makes the data inconsistent but the expected tiles obvious.
FloatHermite column(int z0, int z1) {
  FloatHermite hermite;
  for (const int z : {z0, z1}) {
    SignLeaf leaf{{0, 0, z}, static_cast<std::uint32_t>(hermite.crossings.size()), {}, {}};
    if (z == z0)
      leaf.beyond[2] = ~std::uint64_t{0};
    else
      leaf.inside.fill(~std::uint64_t{0});
    std::size_t crossings = 0;
    for (const BlockMask& axis : crossing_edges(leaf)) crossings += static_cast<std::size_t>(count(axis));
    for (; crossings > 0; --crossings) hermite.crossings.push_back({0.5f, {0, 0, 1}});
    hermite.leaves.push_back(leaf);
  }
  return hermite;
}

TEST_F(DenseTiles, TilesOfEveryLevelHaveTheirColumnsSign) {
  const auto dense = to_dense<FixedVoxel>(column(-8, 5 * 4096 + 16 * 128), context_);
  const auto& tree = tree_of(dense);
  const auto depth_and_sign = [&](int z) {
    return std::pair(tree.getValueDepth(Coord(0, 0, z)), tree.getValue(Coord(0, 0, z)).inside());
  };
  EXPECT_EQ(depth_and_sign(-9), std::pair(2, false));
  EXPECT_EQ(depth_and_sign(-8), std::pair(3, false));
  // The first node of the upper half is a root tile, four more follow; then the nodes of the last leaf begin.
  for (int node = 0; node < 5; ++node)
    EXPECT_EQ(depth_and_sign(node * 4096 + 77), std::pair(0, true)) << node;
  EXPECT_EQ(depth_and_sign(5 * 4096), std::pair(1, true));
  EXPECT_EQ(depth_and_sign(5 * 4096 + 16 * 128 - 1), std::pair(1, true));
  EXPECT_EQ(depth_and_sign(5 * 4096 + 16 * 128), std::pair(3, true));
  EXPECT_EQ(depth_and_sign(5 * 4096 + 16 * 128 + 8), std::pair(2, false));
  EXPECT_EQ(depth_and_sign(5 * 4096 + 17 * 128), std::pair(1, false));
  EXPECT_EQ(depth_and_sign(6 * 4096), std::pair(-1, false));
}

}  // namespace dense_tree_test
}  // namespace hermesh
