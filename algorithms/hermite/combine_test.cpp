#include "algorithms/hermite/combine.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <optional>
#include <random>

#include "algorithms/hermite/normal_codes.h"
#include "algorithms/hermite/test_lattice.h"

namespace hermesh {
namespace combine_test {

constexpr std::array kBooleans = {Boolean::unite, Boolean::intersect, Boolean::subtract};

// ---- Random data without any geometry: every sign, offset and normal by itself. ----

std::uint16_t random_normal(std::mt19937& random, NormalCodeId id) {
  return with_normal_code(id, [&](auto code) -> std::uint16_t {
    using Code = decltype(code);
    std::normal_distribution<float> gauss;
    switch (random() % 4) {
      case 0:
        return Code::pack({0, 0, 1});  // the code 0
      case 1:
        return Code::pack({0, 0, -1});
      case 2:
        return Code::pack({1, 2, 3});
      default:
        return Code::pack({gauss(random), gauss(random), gauss(random)});
    }
  });
}

void randomize(std::mt19937& random, NormalCodeId code, PackedCrossing& crossing) {
  // Often equal, often at an end of the edge.
  const std::uint16_t offsets[] = {0, 1, 511, 1021, kLastOffset, static_cast<std::uint16_t>(random() % 1023)};
  const auto tag = static_cast<std::uint16_t>(random() % 3 ? 5 : random() % 64);
  crossing = {random_normal(random, code), static_cast<std::uint16_t>(offsets[random() % 6] | (tag << 10))};
}

void randomize(std::mt19937& random, NormalCodeId, EdgeCrossing& crossing) {
  const float offsets[] = {0.0f, 0.5f, 1.0f, std::uniform_real_distribution<float>()(random)};
  // The zeros of either sign are the same normal, but not the same bytes.
  const std::array<float, 3> normals[] = {
      {0, 0, 1}, {-0.0f, 0, 1}, {0, -0.0f, -1}, {0.6f, 0, 0.8f}, {0.6f, -0.8f, 0}};
  crossing = {offsets[random() % 4], normals[random() % 5]};
}

template <class Crossing>
TestLattice<Crossing> random_lattice(std::mt19937& random, int size, NormalCodeId code) {
  const bool outermost = random() % 2;
  TestLattice<Crossing> lattice{-16, size, outermost};
  const std::uint32_t one_in = 2 + random() % 6;
  const int last = lattice.lower + size - 1;
  lattice.for_each_sample([&](int x, int y, int z) {
    const bool border = std::min({x, y, z}) == lattice.lower || std::max({x, y, z}) == last;
    if (!border) lattice.sign(x, y, z) = random() % one_in == 0;
  });
  lattice.for_each_crossed_edge([&](int axis, int x, int y, int z) {
    randomize(random, code, lattice.crossings[{axis, x, y, z}]);
  });
  return lattice;
}

// ---- The oracle: an edge at a time, unpacked, by sorting the crossings that may be taken. ----

struct OracleCrossing {
  double offset = 0;
  std::array<double, 3> order{};  ///< order of the normal; negation mirrors it about −½
  int tag = 0;
};

OracleCrossing unpacked(const PackedCrossing& crossing, NormalCodeId id) {
  return with_normal_code(id, [&](auto code) {
    const double place = order<decltype(code)>(crossing.normal);
    return OracleCrossing{crossing.offset() / 1022.0, {place, 0, 0}, crossing.tag()};
  });
}
OracleCrossing unpacked(const EdgeCrossing& crossing, NormalCodeId) {
  OracleCrossing result{crossing.offset, {}, 0};
  for (int i = 0; i < 3; ++i) {  // −0 directly before 0
    const double value = crossing.normal[i];
    result.order[i] = value + (std::signbit(value) ? -1e-60 : 1e-60);
    if (value == 0) result.order[i] = std::signbit(value) ? -1e-60 : 1e-60;
  }
  return result;
}

PackedCrossing opposite(const PackedCrossing& crossing, NormalCodeId id) {
  return with_normal_code(id, [&](auto code) {
    return PackedCrossing{decltype(code)::negate(crossing.normal), crossing.offset_and_tag};
  });
}
EdgeCrossing opposite(const EdgeCrossing& crossing, NormalCodeId) {
  return {crossing.offset, {-crossing.normal[0], -crossing.normal[1], -crossing.normal[2]}};
}

template <class Crossing>
TestLattice<Crossing> oracle_complement(TestLattice<Crossing> lattice, NormalCodeId code) {
  lattice.outermost = !lattice.outermost;
  for (char& sign : lattice.signs) sign = !sign;
  for (auto& [edge, crossing] : lattice.crossings) crossing = opposite(crossing, code);
  return lattice;
}

template <class Crossing>
Crossing oracle_choice(bool unites, bool leaves_solid, std::vector<Crossing> candidates, NormalCodeId code) {
  const auto better = [&](const Crossing& first, const Crossing& second) {
    const OracleCrossing a = unpacked(first, code), b = unpacked(second, code);
    const double inside_a = leaves_solid ? a.offset : 1 - a.offset,
                 inside_b = leaves_solid ? b.offset : 1 - b.offset;
    if (a.offset != b.offset) return unites ? inside_a > inside_b : inside_a < inside_b;
    if (a.order != b.order) return unites ? a.order < b.order : a.order > b.order;
    return a.tag < b.tag;
  };
  std::stable_sort(candidates.begin(), candidates.end(), better);
  return candidates.front();
}

template <class Crossing>
TestLattice<Crossing> oracle(Boolean boolean, const TestLattice<Crossing>& a, const TestLattice<Crossing>& b,
                             NormalCodeId code) {
  if (boolean == Boolean::subtract) return oracle(Boolean::intersect, a, oracle_complement(b, code), code);
  const bool unites = boolean == Boolean::unite;
  const auto together = [&](bool p, bool q) { return unites ? p || q : p && q; };
  TestLattice<Crossing> result{a.lower, a.size, together(a.outermost, b.outermost)};
  result.for_each_sample(
      [&](int x, int y, int z) { result.sign(x, y, z) = together(a.inside(x, y, z), b.inside(x, y, z)); });
  result.for_each_crossed_edge([&](int axis, int x, int y, int z) {
    std::vector<Crossing> candidates;
    for (const TestLattice<Crossing>* operand : {&a, &b})
      if (operand->inside(x, y, z) == result.inside(x, y, z) &&
          operand->successor(axis, x, y, z) == result.successor(axis, x, y, z))
        candidates.push_back(operand->crossings.at({axis, x, y, z}));
    ASSERT_FALSE(candidates.empty());
    result.crossings[{axis, x, y, z}] = oracle_choice(unites, result.inside(x, y, z), candidates, code);
  });
  return result;
}

// ---- Tests for both kinds of crossing. ----

template <class Crossing>
SparseHermite<Crossing> sampled(const Solid& solid, int lower = -8, int size = 40) {
  RunContext context;
  const FloatHermite floats = to_sparse(sample_solid(solid, lower, size));
  if constexpr (std::is_same_v<Crossing, EdgeCrossing>)
    return floats;
  else
    return pack(floats, NormalCodeId::octahedral, context);
}

template <class Crossing>
class Combine : public testing::Test {
 public:
  using Hermite = SparseHermite<Crossing>;
  static Hermite run(Boolean boolean, const Hermite& a, const Hermite& b) {
    RunContext context;
    Hermite result = combine(boolean, a, b, context);
    EXPECT_NO_THROW(check_consistent(result));
    return result;
  }
  static Hermite unite(const Hermite& a, const Hermite& b) { return run(Boolean::unite, a, b); }
  static Hermite intersect(const Hermite& a, const Hermite& b) { return run(Boolean::intersect, a, b); }
  static Hermite subtract(const Hermite& a, const Hermite& b) { return run(Boolean::subtract, a, b); }
  static Hermite turned(const Hermite& a) {
    RunContext context;
    Hermite result = complement(a, context);
    EXPECT_NO_THROW(check_consistent(result));
    return result;
  }
  static void expect_laws(const Hermite& a, const Hermite& b, const Hermite& c) {
    const Hermite not_a = turned(a), not_b = turned(b);
    EXPECT_TRUE(same(turned(not_a), a));
    EXPECT_TRUE(same(unite(a, a), a));
    EXPECT_TRUE(same(intersect(a, a), a));
    EXPECT_TRUE(subtract(a, a).leaves.empty());
    EXPECT_FALSE(subtract(a, a).outermost_inside);
    EXPECT_TRUE(unite(a, not_a).leaves.empty());
    EXPECT_TRUE(unite(a, not_a).outermost_inside);
    EXPECT_TRUE(same(unite(a, b), unite(b, a)));
    EXPECT_TRUE(same(intersect(a, b), intersect(b, a)));
    EXPECT_TRUE(same(turned(unite(a, b)), intersect(not_a, not_b)));
    EXPECT_TRUE(same(turned(intersect(a, b)), unite(not_a, not_b)));
    EXPECT_TRUE(same(subtract(a, b), intersect(a, not_b)));
    EXPECT_TRUE(same(unite(unite(a, b), c), unite(a, unite(b, c))));
    EXPECT_TRUE(same(intersect(intersect(a, b), c), intersect(a, intersect(b, c))));
    EXPECT_TRUE(same(subtract(subtract(a, b), c), subtract(a, unite(b, c))));
  }
};
using Crossings = testing::Types<PackedCrossing, EdgeCrossing>;
TYPED_TEST_SUITE(Combine, Crossings);

TYPED_TEST(Combine, AgreesWithTheOracleOnRandomVoxels) {
  std::mt19937 random(7);
  for (const NormalCodeId code : kNormalCodes)
    for (const Boolean boolean : kBooleans) {
      const auto a = random_lattice<TypeParam>(random, 24, code),
                 b = random_lattice<TypeParam>(random, 24, code);
      const auto result = this->run(boolean, to_sparse(a, code), to_sparse(b, code));
      const auto expected = to_sparse(oracle(boolean, a, b, code), code);  // 13,824 voxels
      EXPECT_TRUE(same(result, expected)) << int(boolean) << ' ' << name(code);
      EXPECT_TRUE(same(to_sparse(to_lattice(result, -16, 24), code), expected));
    }
}

TYPED_TEST(Combine, LawsHoldForRandomVoxels) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 8; ++trial) {
    const NormalCodeId code = kNormalCodes[trial % kNormalCodes.size()];
    const auto make = [&] {
      return to_sparse(random_lattice<TypeParam>(random, 16 + 8 * (trial % 2), code), code);
    };
    const auto a = make(), b = make(), c = make();
    this->expect_laws(a, b, c);
  }
}

TYPED_TEST(Combine, LawsHoldForSolids) {
  std::mt19937 random(9);
  for (int trial = 0; trial < 10; ++trial) {
    const auto a = sampled<TypeParam>(random_blobs(random)), b = sampled<TypeParam>(random_blobs(random));
    const auto c = sampled<TypeParam>(random_blobs(random));
    this->expect_laws(a, b, c);
  }
}

TYPED_TEST(Combine, AgreesWithTheOracleOnSolids) {
  std::mt19937 random(10);
  for (int trial = 0; trial < 10; ++trial) {
    const auto a = sampled<TypeParam>(random_blobs(random)), b = sampled<TypeParam>(random_blobs(random));
    for (const Boolean boolean : kBooleans) {
      const auto expected = oracle(boolean, to_lattice(a, -8, 40), to_lattice(b, -8, 40), a.normal_code);
      EXPECT_TRUE(same(this->run(boolean, a, b), to_sparse(expected, a.normal_code)));
    }
  }
}

TYPED_TEST(Combine, TheSameBytesForEveryNumberOfThreads) {
  std::mt19937 random(11);
  // 729 leaves, so more than one chunk; the oracle sees that no column is torn apart or lost between them.
  const auto a = random_lattice<TypeParam>(random, 72, NormalCodeId::octahedral);
  const auto b = random_lattice<TypeParam>(random, 72, NormalCodeId::octahedral);
  const auto sparse_a = to_sparse(a), sparse_b = to_sparse(b);
  for (const Boolean boolean : kBooleans) {
    const auto expected = to_sparse(oracle(boolean, a, b, NormalCodeId::octahedral));
    for (const int threads : {1, 2, 5}) {
      tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                static_cast<std::size_t>(threads));
      EXPECT_TRUE(same(this->run(boolean, sparse_a, sparse_b), expected)) << threads;
    }
  }
}

TYPED_TEST(Combine, AnEmptyOperandAndTheWholeSpaceAreNeutralOrAbsorb) {
  const typename TestFixture::Hermite none, solid = sampled<TypeParam>(ball(10.3, 11.1, 9.7, 8.2));
  const auto all = this->turned(none);
  EXPECT_TRUE(all.outermost_inside && all.leaves.empty());
  EXPECT_TRUE(same(this->unite(solid, none), solid));
  EXPECT_TRUE(same(this->intersect(solid, all), solid));
  EXPECT_TRUE(same(this->subtract(solid, none), solid));
  EXPECT_TRUE(same(this->subtract(all, solid), this->turned(solid)));
  EXPECT_TRUE(same(this->unite(solid, all), all));
  EXPECT_TRUE(same(this->intersect(solid, none), none));
  EXPECT_TRUE(same(this->subtract(solid, all), none));
  EXPECT_TRUE(same(this->subtract(none, solid), none));
  EXPECT_TRUE(same(this->unite(none, none), none));
}

TYPED_TEST(Combine, NestedSolidsLeaveTheOuterOneTheInnerOneOrAShell) {
  // The inner one's leaves are a long run within the outer one, where it has no leaf.
  const auto outer = sampled<TypeParam>(ball(32, 32, 32, 30), 0, 72),
             inner = sampled<TypeParam>(ball(32, 33, 31, 12), 0, 72);
  EXPECT_TRUE(same(this->unite(outer, inner), outer));
  EXPECT_TRUE(same(this->intersect(inner, outer), inner));
  EXPECT_TRUE(this->subtract(inner, outer).leaves.empty());
  const auto shell = this->subtract(outer, inner);
  EXPECT_EQ(shell.leaves.size(), outer.leaves.size() + inner.leaves.size());
  EXPECT_EQ(shell.crossings.size(), outer.crossings.size() + inner.crossings.size());
  EXPECT_TRUE(same(this->unite(shell, inner), outer));
}

TYPED_TEST(Combine, DisjointSolidsAreKeptApart) {
  const auto left = sampled<TypeParam>(ball(6, 6, 6, 4.5)), right = sampled<TypeParam>(ball(20, 6, 6, 4.5));
  const auto both = sampled<TypeParam>(joined({ball(6, 6, 6, 4.5), ball(20, 6, 6, 4.5)}));
  EXPECT_TRUE(same(this->unite(left, right), both));
  EXPECT_TRUE(this->intersect(left, right).leaves.empty());
  EXPECT_TRUE(same(this->subtract(left, right), left));
  EXPECT_TRUE(same(this->subtract(both, right), left));
}

TYPED_TEST(Combine, BoxesThatTouchJoinWithoutASeam) {
  // They meet in x = 9.5: the edge from 9 to 10 is crossed outwards by one and inwards by the other.
  const auto left = sampled<TypeParam>(box(6, 8, 8, 3.5, 4.5, 4.5)),
             right = sampled<TypeParam>(box(13, 8, 8, 3.5, 4.5, 4.5));
  const auto both = sampled<TypeParam>(box(9.5, 8, 8, 7, 4.5, 4.5));
  EXPECT_TRUE(same(this->unite(left, right), both));
  EXPECT_TRUE(this->intersect(left, right).leaves.empty());
}

TYPED_TEST(Combine, PiecesOfACutShareItsCrossings) {
  // A fracture requires that both sides of the cut have the cutter's crossings, with opposite normals.
  const auto whole = sampled<TypeParam>(ball(12, 12, 12, 10.2)),
             cutter = sampled<TypeParam>(box(20, 12, 12, 7.3, 13, 13));
  const auto within = to_lattice(this->intersect(whole, cutter), -8, 40);
  const auto without = to_lattice(this->subtract(whole, cutter), -8, 40);
  int shared = 0;
  for (const auto& [edge, crossing] : without.crossings) {
    const auto other = within.crossings.find(edge);
    if (other == within.crossings.end()) continue;
    ++shared;
    EXPECT_EQ(other->second, opposite(crossing, whole.normal_code));
  }
  EXPECT_GT(shared, 250);  // of about π (10.2² − 0.7²) edges along x
}

// ---- Values by hand, and refusals. ----

/// Data with one sample inside, at the origin; all six crossings at `offset` from it outwards.
PackedHermite one_sample(std::uint16_t up, std::uint16_t down, std::uint16_t normal, std::uint16_t tag) {
  TestLattice<PackedCrossing> lattice{-8, 16};
  lattice.sign(0, 0, 0) = 1;
  lattice.for_each_crossed_edge([&](int axis, int x, int y, int z) {
    const std::uint16_t offset = lattice.inside(x, y, z) ? up : down;
    lattice.crossings[{axis, x, y, z}] = {normal, static_cast<std::uint16_t>(offset | (tag << 10))};
  });
  return to_sparse(lattice);
}

TEST(CombineByHand, AUnionIsLongerAndAnIntersectionShorter) {
  RunContext context;
  const PackedHermite a = one_sample(100, 900, 7, 1), b = one_sample(200, 950, 9, 2);
  const auto both = to_lattice(combine(Boolean::unite, a, b, context), -8, 16);
  const auto common = to_lattice(combine(Boolean::intersect, a, b, context), -8, 16);
  ASSERT_EQ(both.crossings.size(), 6u);
  ASSERT_EQ(common.crossings.size(), 6u);
  for (const auto& [edge, crossing] : both.crossings) {
    const bool up = std::get<1>(edge) + std::get<2>(edge) + std::get<3>(edge) == 0;
    EXPECT_EQ(crossing.offset(), up ? 200 : 900);
    EXPECT_EQ(crossing.normal, up ? 9 : 7);
    EXPECT_EQ(crossing.tag(), up ? 2 : 1);
    EXPECT_EQ(common.crossings.at(edge).offset(), up ? 100 : 950);
    EXPECT_EQ(common.crossings.at(edge).normal, up ? 7 : 9);
  }
}

TEST(CombineByHand, OfEqualOffsetsAUnionTakesTheNormalOfLowerOrder) {
  RunContext context;
  const std::uint16_t low = 0, high = OctahedralNormalCode::pack({1, 2, 3});
  ASSERT_LT(order<OctahedralNormalCode>(low), order<OctahedralNormalCode>(high));
  const PackedHermite a = one_sample(300, 300, high, 9), b = one_sample(300, 300, low, 4),
                      c = one_sample(300, 300, low, 3);
  for (const PackedCrossing& crossing : combine(Boolean::unite, a, b, context).crossings)
    EXPECT_EQ(crossing.normal, low);
  for (const PackedCrossing& crossing : combine(Boolean::intersect, a, b, context).crossings)
    EXPECT_EQ(crossing.normal, high);
  for (const Boolean boolean : {Boolean::unite, Boolean::intersect})  // of equal normals too, the lower tag
    EXPECT_TRUE(same(combine(boolean, b, c, context), c));
}

TEST(CombineByHand, ADifferenceTurnsTheNormalsOfWhatItTakesAway) {
  RunContext context;
  PackedHermite all;
  all.outermost_inside = true;
  const PackedHermite hole = combine(Boolean::subtract, all, one_sample(300, 400, 77, 5), context);
  ASSERT_EQ(hole.crossings.size(), 6u);
  EXPECT_TRUE(hole.outermost_inside);
  for (const PackedCrossing& crossing : hole.crossings) {
    EXPECT_EQ(crossing.normal, OctahedralNormalCode::negate(77));
    EXPECT_EQ(crossing.tag(), 5);
  }
}

TEST(CombineByHand, TheIntersectionIsNotDistributive) {
  // The example of boolean_rule.h, along x from the origin.
  RunContext context;
  const auto along_x = [](bool first, bool second, std::uint16_t offset) {
    TestLattice<PackedCrossing> lattice{-8, 16};
    lattice.sign(0, 0, 0) = first, lattice.sign(1, 0, 0) = second;
    lattice.for_each_crossed_edge([&](int axis, int x, int y, int z) {
      lattice.crossings[{axis, x, y, z}] = {1, offset};
    });
    return to_sparse(lattice);
  };
  const PackedHermite a = along_x(true, false, 900), b = along_x(true, false, 500),
                      c = along_x(false, true, 200);
  const auto outer = combine(Boolean::intersect, a, combine(Boolean::unite, b, c, context), context);
  const auto inner = combine(Boolean::unite, combine(Boolean::intersect, a, b, context),
                             combine(Boolean::intersect, a, c, context), context);
  EXPECT_EQ(to_lattice(outer, -8, 16).crossings.at({0, 0, 0, 0}).offset(), 900);
  EXPECT_EQ(to_lattice(inner, -8, 16).crossings.at({0, 0, 0, 0}).offset(), 500);
}

TEST(CombineByHand, RefusesWhatDoesNotFitTogether) {
  RunContext context;
  const PackedHermite a = one_sample(300, 400, 77, 5);
  PackedHermite shifted = a, coded = a, based = a;
  shifted.placement.offset.x() = 0.01;
  EXPECT_THROW(combine(Boolean::unite, a, shifted, context), Error);
  coded.normal_code = NormalCodeId::thesis;
  EXPECT_THROW(combine(Boolean::unite, a, coded, context), Error);
  // The same lattice, described from another base.
  based.placement.base = {8, 0, 0};
  based.placement.offset.x() = 8;
  EXPECT_NO_THROW(combine(Boolean::unite, a, based, context));
  std::atomic<bool> cancel = true;
  context.cancel = &cancel;
  EXPECT_THROW(combine(Boolean::unite, a, a, context), Cancelled);
}

}  // namespace combine_test
}  // namespace hermesh
