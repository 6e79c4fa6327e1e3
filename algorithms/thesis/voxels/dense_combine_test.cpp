#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <set>
#include <utility>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/hermite/combine.h"
#include "algorithms/hermite/test_lattice.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "algorithms/thesis/voxels/dense_tree.h"
#include "algorithms/thesis/voxels/voxel_rules.h"
#include "algorithms/thesis/voxels/voxels.h"

namespace hermesh {
namespace dense_combine_test {

constexpr std::array kBooleans = {Boolean::unite, Boolean::intersect, Boolean::subtract};

// ---- Equality by value and by topology. ----

template <class Node>
bool same_nodes(const Node& a, const Node& b) {
  if constexpr (Node::LEVEL == 0) {
    return a.getValueMask() == b.getValueMask() &&
           std::memcmp(a.buffer().data(), b.buffer().data(), Node::SIZE * sizeof(typename Node::ValueType)) ==
               0;
  } else {
    if (a.getChildMask() != b.getChildMask() || a.getValueMask() != b.getValueMask()) return false;
    for (openvdb::Index slot = 0; slot < Node::NUM_VALUES; ++slot) {
      const auto &in_a = a.getTable()[slot], &in_b = b.getTable()[slot];
      if (a.isChildMaskOn(slot) ? !same_nodes(*in_a.getChild(), *in_b.getChild())
                                : in_a.getValue() != in_b.getValue())
        return false;
    }
    return true;
  }
}

template <class Voxel>
testing::AssertionResult same(const DenseHermite<Voxel>& a, const DenseHermite<Voxel>& b) {
  const auto &root_a = a.grid->tree().root(), &root_b = b.grid->tree().root();
  if (root_a.background() != root_b.background())
    return testing::AssertionFailure() << "infinity differs in sign";
  if (root_a.getTableSize() != root_b.getTableSize())
    return testing::AssertionFailure() << "roots differ in size";
  if (a.leaves() != b.leaves())
    return testing::AssertionFailure() << "leaves differ, " << a.leaves() << " and " << b.leaves();
  auto tile_b = root_b.cbeginValueAll();
  for (auto tile = root_a.cbeginValueAll(); tile; ++tile, ++tile_b)
    if (!tile_b || tile.getCoord() != tile_b.getCoord() || *tile != *tile_b)
      return testing::AssertionFailure() << "tiles of the roots differ";
  auto child_b = root_b.cbeginChildOn();
  for (auto child = root_a.cbeginChildOn(); child; ++child, ++child_b)
    if (!child_b || child.getCoord() != child_b.getCoord() || !same_nodes(*child, *child_b))
      return testing::AssertionFailure() << "branches differ";
  return testing::AssertionSuccess();
}

// ---- All layouts but the printed one. ----

template <class Voxel>
DenseHermite<Voxel> dense(const FloatHermite& hermite) {
  RunContext context;
  return to_dense<Voxel>(hermite, context, NormalCodeId::octahedral);
}

/// The sparse combination as a layout can represent it: for FixedVoxel, that of the packed data.
template <class Voxel>
DenseHermite<Voxel> expected(Boolean boolean, const FloatHermite& a, const FloatHermite& b) {
  RunContext context;
  if constexpr (std::is_same_v<Voxel, FixedVoxel>)
    return to_dense<FixedVoxel>(combine(boolean, pack(a, NormalCodeId::octahedral, context),
                                        pack(b, NormalCodeId::octahedral, context), context),
                                context);
  else
    return to_dense<Voxel>(combine(boolean, a, b, context), context);
}

/// Data with signs at random; offsets often equal, or at an end of the edge.
FloatHermite random_voxels(std::mt19937& random, int size) {
  TestLattice<EdgeCrossing> lattice{-16, size, random() % 2 != 0};
  const std::uint32_t one_in = 2 + random() % 6;
  const int last = lattice.lower + size - 1;
  lattice.for_each_sample([&](int x, int y, int z) {
    const bool border = std::min({x, y, z}) == lattice.lower || std::max({x, y, z}) == last;
    if (!border) lattice.sign(x, y, z) = random() % one_in == 0;
  });
  lattice.for_each_crossed_edge([&](int axis, int x, int y, int z) {
    const float offsets[] = {0.0f, 0.5f, 1.0f, std::uniform_real_distribution<float>()(random)};
    const std::array<float, 3> normals[] = {{0, 0, 1}, {0, 0, -1}, {0.6f, 0, 0.8f}, {0.6f, -0.8f, 0}};
    lattice.crossings[{axis, x, y, z}] = {offsets[random() % 4], normals[random() % 4]};
  });
  return to_sparse(lattice);
}

template <class Voxel>
class DenseCombine : public testing::Test {
 public:
  using Dense = DenseHermite<Voxel>;
  static Dense run(Boolean boolean, const Dense& a, const Dense& b) {
    RunContext context;
    const Dense result = combine(boolean, a, b, context);
    EXPECT_NO_THROW(check_consistent(result, context));
    return result;
  }
  static Dense turned(const Dense& a) {
    RunContext context;
    return complement(a, context);
  }
};
using Ruled = testing::Types<FixedVoxel, FloatVoxel, DirectedVoxel>;
TYPED_TEST_SUITE(DenseCombine, Ruled);

TYPED_TEST(DenseCombine, TheSameAsSparseForRandomVoxels) {
  std::mt19937 random(21);
  for (int trial = 0; trial < 3; ++trial) {
    const FloatHermite a = random_voxels(random, 32), b = random_voxels(random, 32);
    for (const Boolean boolean : kBooleans)
      EXPECT_TRUE(same(this->run(boolean, dense<TypeParam>(a), dense<TypeParam>(b)),
                       expected<TypeParam>(boolean, a, b)));
  }
}

TYPED_TEST(DenseCombine, TheSameAsSparseForSolids) {
  std::mt19937 random(22);
  for (int trial = 0; trial < 6; ++trial) {
    const FloatHermite a = to_sparse(sample_solid(random_blobs(random))),
                       b = to_sparse(sample_solid(random_blobs(random)));
    for (const Boolean boolean : kBooleans)
      EXPECT_TRUE(same(this->run(boolean, dense<TypeParam>(a), dense<TypeParam>(b)),
                       expected<TypeParam>(boolean, a, b)));
  }
}

TYPED_TEST(DenseCombine, LawsHold) {
  std::mt19937 random(23);
  for (int trial = 0; trial < 4; ++trial) {
    const auto make = [&] {
      return dense<TypeParam>(trial % 2 ? random_voxels(random, 24)
                                        : to_sparse(sample_solid(random_blobs(random))));
    };
    const auto a = make(), b = make(), c = make(), not_a = this->turned(a), not_b = this->turned(b);
    const auto unite = [&](const auto& p, const auto& q) { return this->run(Boolean::unite, p, q); };
    const auto intersect = [&](const auto& p, const auto& q) { return this->run(Boolean::intersect, p, q); };
    const auto subtract = [&](const auto& p, const auto& q) { return this->run(Boolean::subtract, p, q); };
    EXPECT_TRUE(same(this->turned(not_a), a));
    EXPECT_TRUE(same(unite(a, a), a));
    EXPECT_TRUE(same(intersect(a, a), a));
    EXPECT_EQ(subtract(a, a).leaves(), 0u);
    EXPECT_EQ(unite(a, not_a).leaves(), 0u);
    EXPECT_TRUE(same(unite(a, b), unite(b, a)));
    EXPECT_TRUE(same(this->turned(unite(a, b)), intersect(not_a, not_b)));
    EXPECT_TRUE(same(this->turned(intersect(a, b)), unite(not_a, not_b)));
    EXPECT_TRUE(same(subtract(a, b), intersect(a, not_b)));
    EXPECT_TRUE(same(unite(unite(a, b), c), unite(a, unite(b, c))));
    EXPECT_TRUE(same(subtract(subtract(a, b), c), subtract(a, unite(b, c))));
  }
}

TYPED_TEST(DenseCombine, UniformOperandsDecideEverythingOrNothing) {
  const auto none = dense<TypeParam>(FloatHermite{}), all = this->turned(none);
  const auto solid = dense<TypeParam>(to_sparse(sample_solid(ball(10.3, 11.1, 9.7, 8.2))));
  EXPECT_TRUE(same(this->run(Boolean::unite, solid, none), solid));
  EXPECT_TRUE(same(this->run(Boolean::unite, none, solid), solid));
  EXPECT_TRUE(same(this->run(Boolean::unite, solid, all), all));
  EXPECT_TRUE(same(this->run(Boolean::intersect, all, solid), solid));
  EXPECT_TRUE(same(this->run(Boolean::intersect, none, solid), none));
  EXPECT_TRUE(same(this->run(Boolean::subtract, all, solid), this->turned(solid)));
  EXPECT_TRUE(same(this->run(Boolean::subtract, solid, all), none));
}

TYPED_TEST(DenseCombine, BranchesInDifferentNodesOfTheRoot) {
  // 10,000 voxels apart along x, and along z, where the root has a gap in the column.
  const FloatHermite here = to_sparse(sample_solid(ball(6, 6, 6, 4.5)));
  RunContext context;
  for (const int axis : {0, 2}) {
    FloatHermite there = here;
    for (SignLeaf& leaf : there.leaves) leaf.lower[axis] += 10000;
    const FloatHermite not_here = complement(here, context),
                       both = combine(Boolean::unite, here, there, context);
    for (const Boolean boolean : kBooleans) {
      for (const auto& [a, b] : {std::pair(here, there), std::pair(there, not_here),
                                 std::pair(not_here, there), std::pair(both, here), std::pair(there, both)})
        EXPECT_TRUE(same(this->run(boolean, dense<TypeParam>(a), dense<TypeParam>(b)),
                         expected<TypeParam>(boolean, a, b)));
    }
  }
}

TYPED_TEST(DenseCombine, OperandsMovedInGiveUpTheirNodesAndSharedOnesAreLeftAlone) {
  RunContext context;
  const FloatHermite left = to_sparse(sample_solid(ball(6, 6, 6, 4.5))),
                     right = to_sparse(sample_solid(ball(24, 6, 6, 4.5)));
  auto a = dense<TypeParam>(left), b = dense<TypeParam>(right);
  const auto leaves = [](const auto& hermite) {
    std::set<const void*> result;
    for (auto leaf = hermite.grid->tree().cbeginLeaf(); leaf; ++leaf) result.insert(&*leaf);
    return result;
  };
  const auto shared = combine(Boolean::unite, a, b, context);
  EXPECT_TRUE(same(a, dense<TypeParam>(left)));
  EXPECT_TRUE(same(b, dense<TypeParam>(right)));
  for (const void* leaf : leaves(shared)) EXPECT_FALSE(leaves(a).count(leaf) || leaves(b).count(leaf));
  std::set<const void*> before = leaves(a);
  before.merge(leaves(b));
  const auto moved = combine(Boolean::unite, std::move(a), std::move(b), context);
  EXPECT_EQ(leaves(moved), before);
  EXPECT_TRUE(same(moved, shared));
  auto copy = moved;
  EXPECT_TRUE(
      same(combine(Boolean::subtract, moved, std::move(copy), context), dense<TypeParam>(FloatHermite{})));
}

TYPED_TEST(DenseCombine, TheSameForEveryNumberOfThreads) {
  std::mt19937 random(24);
  const auto a = dense<TypeParam>(random_voxels(random, 64)), b = dense<TypeParam>(random_voxels(random, 64));
  const auto once = this->run(Boolean::subtract, a, b);
  for (const int threads : {1, 5}) {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                              static_cast<std::size_t>(threads));
    EXPECT_TRUE(same(this->run(Boolean::subtract, a, b), once));
  }
}

TEST(DenseCombineRefuses, OtherLatticesAndNormalCodes) {
  RunContext context;
  const FloatHermite solid = to_sparse(sample_solid(ball(10.3, 11.1, 9.7, 8.2)));
  const FixedDense a = dense<FixedVoxel>(solid);
  FixedDense shifted = a, coded = a;
  shifted.placement.offset.x() = 0.01;
  coded.normal_code = NormalCodeId::nearest;
  EXPECT_THROW(combine(Boolean::unite, a, shifted, context), Error);
  EXPECT_THROW(combine(Boolean::unite, a, coded, context), Error);
}

// ---- The printed layout. ----

ThesisVoxel voxel(bool inside, int axis, float offset, const std::array<float, 3>& normal) {
  ThesisVoxel result;
  result.set_inside(inside);
  result.set(axis, {offset, normal});
  return result;
}
ThesisVoxel printed(Boolean boolean, ThesisVoxel a, const ThesisVoxel& b) {
  PrintedVoxel::combine(BooleanRule(boolean), a, b);
  return a;
}

TEST(PrintedVoxel, TakesTheLesserOrGreaterSignedDistanceWithItsNormal) {
  const std::array<float, 3> one = {1, 2, 3}, two = {-3, 2, 1};
  ThesisVoxel outside, inside;
  inside.set_inside(true);
  for (int axis = 0; axis < 3; ++axis) {
    const ThesisVoxel near = voxel(true, axis, 0.2f, one), far = voxel(true, axis, 0.7f, two);
    EXPECT_EQ(printed(Boolean::unite, near, far), far);  // −0.7 < −0.2
    EXPECT_EQ(printed(Boolean::intersect, far, near), near);
    EXPECT_EQ(printed(Boolean::unite, near, inside), inside);  // −∞
    EXPECT_EQ(printed(Boolean::unite, outside, near), near);   // ∞
    EXPECT_EQ(printed(Boolean::intersect, inside, near), near);
    EXPECT_EQ(printed(Boolean::intersect, outside, near), outside);
    const ThesisVoxel enters = voxel(false, axis, 0.2f, one), later = voxel(false, axis, 0.7f, two);
    EXPECT_EQ(printed(Boolean::unite, later, enters), enters);
    EXPECT_EQ(printed(Boolean::intersect, enters, later), later);
    // The complement of a solid entered at 0.2 is left there, with the opposite normal.
    EXPECT_EQ(printed(Boolean::subtract, inside, enters), voxel(true, axis, 0.2f, {-1, -2, -3}));
    // Zeros of either sign: −0 < 0.
    EXPECT_TRUE(printed(Boolean::unite, voxel(false, axis, 0, one), voxel(true, axis, 0, two)).inside());
    EXPECT_EQ(printed(Boolean::unite, voxel(false, axis, 0, one), voxel(true, axis, 0, two)),
              voxel(true, axis, 0, two));
  }
}

TEST(PrintedVoxel, TheComplementLosesANormalThatBecomesZero) {
  // Near −z with the signs of the negative octant: the code is 0xE000, its opposite 0.
  const std::array<float, 3> down = {-1e-4f, -1e-4f, -1};
  for (int axis = 0; axis < 3; ++axis) {
    const ThesisVoxel before = voxel(false, axis, 0.5f, down);
    ASSERT_TRUE(before.crosses(axis));
    ThesisVoxel twice = before;
    PrintedVoxel::turn(twice);
    EXPECT_TRUE(twice.inside());
    EXPECT_EQ(twice.crosses(axis), axis == 2);
    PrintedVoxel::turn(twice);
    EXPECT_EQ(twice == before, axis == 2);
  }
}

/// Counts of a grid's violations of the invariants of Hermite data.
struct Violations {
  std::size_t lost = 0;      ///< edges whose ends differ in sign, without a crossing
  std::size_t spurious = 0;  ///< edges whose ends have one sign, with a crossing

  bool operator==(const Violations&) const = default;
};

template <class Voxel>
Violations violations(const DenseHermite<Voxel>& hermite) {
  RunContext context;
  Violations result;
  const FloatHermite sparse = to_sparse(hermite, context, &result.lost);
  EXPECT_NO_THROW(check_consistent(sparse));
  result.spurious = hermite.crossings() + result.lost - sparse.crossings.size();
  return result;
}

/// Number of voxels that are not the same in both.
std::size_t differences(const ThesisDense& a, const ThesisDense& b, int lower = -8, int size = 40) {
  std::size_t result = 0;
  const auto &tree_a = a.grid->tree(), &tree_b = b.grid->tree();
  for (int x = lower; x < lower + size; ++x)
    for (int y = lower; y < lower + size; ++y)
      for (int z = lower; z < lower + size; ++z)
        result += tree_a.getValue({x, y, z}) != tree_b.getValue({x, y, z});
  return result;
}

template <class Voxel>
DenseHermite<Voxel> run(Boolean boolean, const Solid& a, const Solid& b) {
  RunContext context;
  return combine(boolean, dense<Voxel>(to_sparse(sample_solid(a))), dense<Voxel>(to_sparse(sample_solid(b))),
                 context);
}
ThesisDense turned(const ThesisDense& a) {
  RunContext context;
  return complement(a, context);
}
std::size_t against_de_morgan(const Solid& a, const Solid& b) {
  RunContext context;
  const auto not_a = turned(dense<ThesisVoxel>(to_sparse(sample_solid(a))));
  const auto not_b = turned(dense<ThesisVoxel>(to_sparse(sample_solid(b))));
  return differences(turned(run<ThesisVoxel>(Boolean::unite, a, b)),
                     combine(Boolean::intersect, not_a, not_b, context));
}

/// A slab whose upper and lower faces are turned by about 0.3° out of the lattice planes.
Solid tilted_slab(double x0, double bottom, double top) {
  const Solid sides = box(x0, 10.3, 10.3, 8.3, 8.3, 30);
  return [=](double x, double y, double z) {
    const double height = z + 0.004 * (x - 10) + 0.003 * (y - 10);
    return std::max({sides(x, y, z), height - top, bottom - height});
  };
}

TEST(ThesisCombine, IsTheRuleWhereNothingIsLostAndNothingMeets) {
  // All normals are along the axes, those of edges along x and y in x and y, and no edge is crossed by both
  // operands against each other.
  const Solid a = box(8.3, 9.2, 9.4, 6.1, 7.3, 5.2), b = box(14.2, 11.4, 10.7, 5.1, 8.6, 7.4);
  RunContext context;
  for (const Boolean boolean : kBooleans) {
    const ThesisDense result = run<ThesisVoxel>(boolean, a, b);
    EXPECT_EQ(violations(result), Violations{});
    EXPECT_NO_THROW(check_consistent(result, context));
    const FloatDense rule = run<FloatVoxel>(boolean, a, b);
    EXPECT_EQ(result.leaves(), rule.leaves());
    EXPECT_EQ(result.crossings(), rule.crossings());
  }
  EXPECT_EQ(against_de_morgan(a, b), 0u);
  const auto solid = dense<ThesisVoxel>(to_sparse(sample_solid(a)));
  EXPECT_EQ(differences(turned(turned(solid)), solid), 0u);
}

TEST(ThesisCombine, SaysThatEdgesAreCrossedAlongTheSeamOfTwoBalls) {
  // Nothing special about them: wherever two surfaces pass through an edge in opposite directions.
  const Solid a = ball(9.3, 10.1, 9.6, 7.4), b = ball(14.2, 11.3, 10.7, 6.1);
  for (const Boolean boolean : kBooleans) {
    EXPECT_GT(violations(run<ThesisVoxel>(boolean, a, b)).spurious, 0u);
    EXPECT_EQ(violations(run<FixedVoxel>(boolean, a, b)), Violations{});
  }
}

TEST(ThesisCombine, SaysThatEdgesAreCrossedWhereFacesMeet) {
  // A gap of 0.4 voxels between x = 9.3 and 9.7 (trap T11). The edges from 9 to 10 lie within the union.
  const Solid left = box(6, 8.2, 8.2, 3.3, 4.5, 4.5), right = box(13, 8.2, 8.2, 3.3, 4.5, 4.5);
  const ThesisDense both = run<ThesisVoxel>(Boolean::unite, left, right);
  EXPECT_EQ(violations(both), (Violations{0, 81}));  // one for each of 9 × 9 lattice lines through the faces
  EXPECT_EQ(violations(run<FixedVoxel>(Boolean::unite, left, right)), Violations{});
  RunContext context;
  EXPECT_THROW(check_consistent(both, context), Error);
}

TEST(ThesisCombine, LosesCrossingsOfFacesNearlyAlongZ) {
  // The upper face has normals near (0, 0, 1), which along x and y mean that there is no crossing (trap T2).
  // It comes through z = 14 within the slab; the other operand is in a corner.
  const Solid slab = tilted_slab(10.3, 3.5, 14.0), corner = ball(3.1, 3.2, 4.3, 3.3);
  for (const Boolean boolean : kBooleans) {
    const Violations printed = violations(run<ThesisVoxel>(boolean, slab, corner));
    EXPECT_EQ(printed.lost > 0, boolean != Boolean::intersect) << printed.lost;
    EXPECT_EQ(violations(run<FixedVoxel>(boolean, slab, corner)), Violations{});
  }
}

TEST(ThesisCombine, BreaksDeMorganForFacesNearlyAlongMinusZ) {
  // The lower face has normals near (0, 0, −1) in the negative octant, which the complement cannot turn
  // about. Where it comes through z = 4, the other operand has a steep face that enters the same edges a
  // little later. So the union has the slab's crossings, and its complement none; but of the two complements
  // one has the steep face's left.
  const Solid slab = tilted_slab(10.3, 4.0, 13.5), sides = box(10.3, 10.3, 10.3, 8.3, 8.3, 8.3);
  const Solid steep = [=](double x, double y, double z) {
    return std::max(sides(x, y, z), 0.1 - 0.8 * (x - 10) - 0.6 * (y - 10));
  };
  EXPECT_GT(against_de_morgan(slab, steep), 0u);
  const auto solid = dense<ThesisVoxel>(to_sparse(sample_solid(slab)));
  EXPECT_EQ(violations(solid), Violations{});
  EXPECT_GT(violations(turned(solid)).lost, 0u);
  EXPECT_GT(differences(turned(turned(solid)), solid), 0u);
}

}  // namespace dense_combine_test
}  // namespace hermesh
