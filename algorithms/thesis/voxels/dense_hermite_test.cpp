#include "algorithms/thesis/voxels/dense_hermite.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/normal_codes.h"
#include "algorithms/hermite/test_lattice.h"
#include "algorithms/thesis/voxels/dense_tree.h"
#include "algorithms/thesis/voxels/voxels.h"

namespace hermesh {
namespace dense_hermite_test {

using openvdb::Coord;

template <class Voxel>
const auto& tree_of(const DenseHermite<Voxel>& dense) {
  return dense.grid->tree();
}

/// A box turned by `degrees` about y: its upper and lower faces are nearly flat in z, about z = 22 and 2.
Solid turned_box(double degrees, double radius) {
  const double angle = degrees * M_PI / 180, c = std::cos(angle), s = std::sin(angle);
  const Solid upright = box(0, 0, 0, radius, radius, radius);
  return [=](double x, double y, double z) {
    x -= 12.1, y -= 12.2, z -= 12;
    return upright(c * x - s * z, y, s * x + c * z);
  };
}

/// Returns true if two trees have equal leaf values and states, tiles and background.
template <class Tree>
testing::AssertionResult same_tree(const Tree& a, const Tree& b) {
  if (!a.hasSameTopology(b)) return testing::AssertionFailure() << "topology differs";
  if (!(a.background() == b.background())) return testing::AssertionFailure() << "background differs";
  auto at = a.cbeginValueAll(), bt = b.cbeginValueAll();
  for (; at && bt; ++at, ++bt)
    if (at.getCoord() != bt.getCoord() || !(*at == *bt) || at.isValueOn() != bt.isValueOn())
      return testing::AssertionFailure() << "values differ at " << at.getCoord();
  return at || bt ? testing::AssertionFailure() << "one has more values" : testing::AssertionSuccess();
}

template <class Voxel>
class Dense : public testing::Test {
 protected:
  RunContext context_;
};
using AllVoxels = testing::Types<FloatVoxel, DirectedVoxel, ThesisVoxel, FixedVoxel>;
TYPED_TEST_SUITE(Dense, AllVoxels);

TYPED_TEST(Dense, EverySampleHasItsSignAndEveryEdgeItsCrossing) {
  std::mt19937 random(2);
  for (int run = 0; run < 10; ++run) {
    auto lattice = sample_solid(random_blobs(random));
    if (run % 2) {  // the complement: inside at infinity
      for (char& sign : lattice.signs) sign = !sign;
      lattice.outermost = true;
    }
    const auto dense = to_dense<TypeParam>(to_sparse(lattice), this->context_);
    EXPECT_EQ(tree_of(dense).background().inside(), lattice.outermost);
    lattice.for_each_sample([&](int x, int y, int z) {
      const TypeParam voxel = tree_of(dense).getValue(Coord(x, y, z));
      ASSERT_EQ(voxel.inside(), lattice.inside(x, y, z));
      bool crossed = false;
      for (int axis = 0; axis < 3; ++axis) {
        const bool expected = lattice.inside(x, y, z) != lattice.successor(axis, x, y, z);
        crossed |= expected;
        if (std::is_same_v<TypeParam, ThesisVoxel> && expected && axis != 2) continue;  // may be lost
        ASSERT_EQ(voxel.crosses(axis), expected);
      }
      ASSERT_EQ(tree_of(dense).isValueOn(Coord(x, y, z)), crossed);
    });
    EXPECT_NO_THROW(check_consistent(dense, this->context_));
  }
}

TYPED_TEST(Dense, ATripThroughSparseGivesTheSameTree) {
  std::mt19937 random(3);
  for (int run = 0; run < 5; ++run) {
    const FloatHermite sparse = to_sparse(sample_solid(random_blobs(random)));
    const auto dense = to_dense<TypeParam>(sparse, this->context_);
    std::size_t lost = 0;
    const FloatHermite back = to_sparse(dense, this->context_, &lost);
    EXPECT_TRUE(same_bytes(back.leaves, sparse.leaves));
    EXPECT_EQ(back.crossings.size(), sparse.crossings.size());
    EXPECT_EQ(dense.crossings() + lost, sparse.crossings.size());
    // The thesis's codes fall by a step with every trip, for they are rounded down.
    if constexpr (!std::is_same_v<TypeParam, ThesisVoxel>) {
      EXPECT_TRUE(same_tree(tree_of(to_dense<TypeParam>(back, this->context_)), tree_of(dense)));
    }
  }
}

TYPED_TEST(Dense, TheSameTreeAtAnyNumberOfThreads) {
  std::mt19937 random(4);
  const FloatHermite sparse = to_sparse(sample_solid(random_blobs(random)));
  const auto build = [&](std::size_t threads) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return to_dense<TypeParam>(sparse, this->context_);
  };
  const auto one = build(1);
  const FloatHermite from_one = to_sparse(one, this->context_);
  for (const std::size_t threads : {2, 7}) {
    const auto many = build(threads);
    EXPECT_TRUE(same_tree(tree_of(one), tree_of(many)));
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_TRUE(same(to_sparse(many, this->context_), from_one));
  }
}

TYPED_TEST(Dense, NothingIsATreeWithoutNodes) {
  for (const bool outermost : {false, true}) {
    FloatHermite nothing;
    nothing.outermost_inside = outermost;
    const auto dense = to_dense<TypeParam>(nothing, this->context_);
    EXPECT_EQ(dense.leaves(), 0u);
    EXPECT_EQ(dense.crossings(), 0u);
    EXPECT_EQ(tree_of(dense).getValue(Coord(1, 2, 3)).inside(), outermost);
    EXPECT_TRUE(same(to_sparse(dense, this->context_), nothing));
  }
}

class DenseHermiteTest : public testing::Test {
 protected:
  RunContext context_;
};

TEST_F(DenseHermiteTest, FloatVoxelsLoseNothing) {
  std::mt19937 random(6);
  for (int run = 0; run < 5; ++run) {
    const FloatHermite sparse = to_sparse(sample_solid(random_blobs(random)));
    EXPECT_TRUE(same(to_sparse(to_dense<FloatVoxel>(sparse, context_), context_), sparse));
  }
}

TEST_F(DenseHermiteTest, FixedVoxelsHoldThePackedCodes) {
  std::mt19937 random(7);
  for (const NormalCodeId code : kNormalCodes) {
    const FloatHermite sparse = to_sparse(sample_solid(random_blobs(random)));
    const PackedHermite packed = pack(sparse, code, context_);
    const FixedDense dense = to_dense<FixedVoxel>(packed, context_);
    std::size_t lost = 1;
    EXPECT_TRUE(same(to_packed(dense, context_, &lost), packed));
    EXPECT_EQ(lost, 0u);
    // Packing on the way gives the same bits, and unpacking the same floats.
    EXPECT_TRUE(same_tree(tree_of(to_dense<FixedVoxel>(sparse, context_, code)), tree_of(dense)));
    EXPECT_TRUE(same(to_sparse(dense, context_), unpack(packed, context_)));
  }
}

TEST_F(DenseHermiteTest, OtherVoxelsTakeWhatPackedCrossingsStandFor) {
  std::mt19937 random(8);
  const PackedHermite packed =
      pack(to_sparse(sample_solid(random_blobs(random))), NormalCodeId::nearest, context_);
  EXPECT_TRUE(same_bytes(to_sparse(to_dense<FloatVoxel>(packed, context_), context_).crossings,
                         unpack(packed, context_).crossings));
}

TEST_F(DenseHermiteTest, ATurnedBoxHasHolesInTheThesisVoxelAlone) {
  const FloatHermite sparse = to_sparse(sample_solid(turned_box(0.3, 10)));
  std::size_t thesis = 0, fixed = 0;
  const ThesisDense dense = to_dense<ThesisVoxel>(sparse, context_);
  const FloatHermite back = to_sparse(dense, context_, &thesis);
  to_sparse(to_dense<FixedVoxel>(sparse, context_, NormalCodeId::thesis), context_, &fixed);
  // The upper face passes through the plane z = 22 between x = 12 and 13, once for each y from 3 to 22.
  EXPECT_EQ(thesis, 20u);
  EXPECT_EQ(fixed, 0u);
  EXPECT_EQ(dense.crossings() + thesis, sparse.crossings.size());
  // Each of these edges has its middle and its direction as a substitute, and no other edge has one.
  std::size_t substitutes = 0;
  for (std::size_t i = 0; i < sparse.leaves.size(); ++i) {
    const auto exact = sparse.crossings_of(i), got = back.crossings_of(i);
    std::size_t next = 0;
    for_each_crossing(sparse, i, [&](int axis, int sample, const EdgeCrossing& crossing) {
      const std::size_t at = next++;
      if (axis == 2 || ThesisNormalCode::pack(crossing.normal) != 0) return;
      ++substitutes;
      EXPECT_EQ(got[at].offset, 0.5f);
      EXPECT_EQ(got[at].normal[axis], test(sparse.leaves[i].inside, sample) ? 1.0f : -1.0f);
      EXPECT_GT(exact[at].normal[2], 0.9999f);
    });
  }
  EXPECT_EQ(substitutes, thesis);
}

TEST_F(DenseHermiteTest, MemoryIsThatOfLeavesAndNodes) {
  const FloatHermite sparse = to_sparse(sample_solid(ball(12, 12, 12, 9.3)));
  const FixedDense fixed = to_dense<FixedVoxel>(sparse, context_);
  const FloatDense full = to_dense<FloatVoxel>(sparse, context_);
  EXPECT_EQ(full.leaves(), sparse.leaves.size());
  EXPECT_EQ(FloatDense::bytes_per_leaf() - FixedDense::bytes_per_leaf(), 512u * (52 - 10));
  EXPECT_GE(FixedDense::bytes_per_leaf(), 5120u + 64u);
  EXPECT_GT(fixed.memory_bytes(), fixed.leaves() * FixedDense::bytes_per_leaf());
  EXPECT_LT(fixed.memory_bytes(), full.memory_bytes());
}

template <class F>
std::string error_of(F&& f) {
  try {
    f();
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

TEST_F(DenseHermiteTest, ContradictionsAreNamed) {
  const FloatHermite sparse = to_sparse(sample_solid(ball(12, 12, 12, 9.3)));
  const auto changed = [&](auto&& change) {
    FixedDense dense = to_dense<FixedVoxel>(sparse, context_);
    const auto grid = dense.grid->deepCopy();
    change(grid->tree());
    dense.grid = grid;
    return error_of([&] { check_consistent(dense, context_); });
  };
  EXPECT_EQ(changed([](auto&) {}), "no error");
  const Coord crossing(21, 12, 12);  // 12 + 9.3 lies on the edge from 21 to 22
  EXPECT_NE(changed([&](auto& tree) { tree.setValue(crossing, -FixedVoxel{}); }).find("lack 1 crossings"),
            std::string::npos);
  EXPECT_NE(changed([&](auto& tree) {
              FixedVoxel voxel = tree.getValue(crossing);
              voxel.set_raw(2, 5, 5);
              tree.setValue(crossing, voxel);
            }).find("crossings where their signs do not change"),
            std::string::npos);
  EXPECT_NE(changed([&](auto& tree) {
              FixedVoxel voxel = tree.getValue(crossing);
              voxel.set_raw(2, 5, kNoOffset);  // a normal without a crossing
              tree.setValue(crossing, voxel);
            }).find("none of theirs"),
            std::string::npos);
  EXPECT_NE(changed([](auto& tree) {
              tree.addTile(1, Coord(64, 64, 64), -FixedVoxel{}, false);
            }).find("change their sign between blocks"),
            std::string::npos);
  EXPECT_NE(changed([](auto& tree) { tree.addTile(1, Coord(12, 12, 12), FixedVoxel{}, false); }), "no error");
  EXPECT_NE(changed([](auto& tree) {
              FixedVoxel voxel;
              voxel.set_raw(0, 5, 5);
              tree.addTile(2, Coord(1000, 0, 0), voxel, false);
            }).find("crossings in a region without surface"),
            std::string::npos);
}

}  // namespace dense_hermite_test
}  // namespace hermesh
