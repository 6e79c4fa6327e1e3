#include "algorithms/search/triangle_tree.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <random>

namespace hermesh {
namespace triangle_tree_test {

struct Soup {
  std::vector<Eigen::Vector3f> points;
  std::vector<Triangle> triangles;
};

/// Triangles of some size around random positions; every fifth is a sliver, a segment, a point or a copy of
/// the one before.
Soup random_soup(int count, double size, const Eigen::Vector3d& origin, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Eigen::Vector3d(unit(random), unit(random), unit(random)); };
  Soup soup;
  for (int i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(soup.points.size());
    const Eigen::Vector3d a = origin + 10 * vector(), b = a + size * vector();
    Eigen::Vector3d c = a + size * vector();
    if (i % 5 == 1) c = 0.3 * a + 0.7 * b + 1e-6 * size * vector();
    if (i % 5 == 2) c = b;
    for (const Eigen::Vector3d& p : {a, i % 5 == 3 ? a : b, i % 5 == 3 ? a : c})
      soup.points.push_back(p.cast<float>());
    if (i % 5 == 4)
      soup.triangles.push_back(soup.triangles.back());
    else
      soup.triangles.push_back({first, first + 1, first + 2});
  }
  return soup;
}

NearestTriangle brute_force(const TriangleTree& tree, const Eigen::Vector3d& p) {
  NearestTriangle best{std::numeric_limits<double>::infinity(), TriangleTree::kNone};
  for (std::uint32_t t = 0; t < tree.triangle_count(); ++t) {
    const double d = squared_distance(p, tree.corner(t, 0), tree.corner(t, 1), tree.corner(t, 2));
    if (d < best.squared) best = {d, t};
  }
  return best;
}

TEST(SquaredDistance, ByHandInEveryRegion) {
  const Eigen::Vector3d corner[3] = {{0, 0, 0}, {4, 0, 0}, {0, 2, 0}};
  const std::pair<Eigen::Vector3d, double> cases[] = {
      {{1, 0.5, 3}, 9}, {{1, 0.5, 0}, 0}, {{-3, -4, 0}, 25},   {{6, 0, 1}, 5},
      {{0, 5, 0}, 9},   {{2, -1, 2}, 5},  {{-1, 1, 1}, 2},     {{3, 3, 0}, 5},
      {{4, 0, 0}, 0},   {{-1, 4, 0}, 5},  {{5, -0.5, 0}, 1.25}};
  for (const auto& [p, squared] : cases)
    for (int turn = 0; turn < 3; ++turn) {
      const Eigen::Vector3d &a = corner[turn], &b = corner[(turn + 1) % 3], &c = corner[(turn + 2) % 3];
      EXPECT_NEAR(squared_distance(p, a, b, c), squared, 1e-14) << p.transpose();
      EXPECT_NEAR(squared_distance(p, a, c, b), squared, 1e-14) << p.transpose();
    }
}

TEST(SquaredDistance, OfDegenerateTriangles) {
  const Eigen::Vector3d o(0, 0, 0), x(2, 0, 0), y(1, 0, 0), p(1, 3, 4);
  EXPECT_EQ(squared_distance(p, o, o, o), 26);
  EXPECT_EQ(squared_distance(p, o, x, x), 25);
  EXPECT_EQ(squared_distance(p, o, y, x), 25);
  EXPECT_EQ(squared_distance(p, x, x, x), 26);
}

TEST(SquaredDistance, OfSliversIsThatOfTheirLongSide) {
  // The apex of a sliver is within its width of the side, so the distances differ by no more than that.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  const auto vector = [&] { return Eigen::Vector3d(unit(random), unit(random), unit(random)); };
  for (int trial = 0; trial < 3000; ++trial) {
    const double width = std::pow(10.0, -16 * std::abs(unit(random)));
    const Eigen::Vector3d a = vector(), b = vector(), p = vector();
    const Eigen::Vector3d c = a + std::abs(unit(random)) * (b - a) + width * vector();
    const double whole = std::sqrt(squared_distance(p, a, b, c)),
                 side = std::sqrt(squared_distance(p, a, b, b));
    EXPECT_LE(whole, side + 1e-15);
    EXPECT_GE(whole, side - 2 * width - 1e-15);
  }
}

TEST(SquaredDistance, TurnsWithTheTriangleEvenForSlivers) {
  // A point lifted off the inside of a sliver is as far as it was lifted.
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0.1, 1);
  for (int trial = 0; trial < 3000; ++trial) {
    const double width = std::pow(10.0, -10 * unit(random)), lift = unit(random);
    const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0), c(unit(random), width, 0);
    const Eigen::Vector3d p = 0.3 * a + 0.3 * b + 0.4 * c + Eigen::Vector3d(0, 0, lift);
    EXPECT_NEAR(std::sqrt(squared_distance(p, a, b, c)), lift, 1e-15);
  }
}

TEST(TriangleTree, FindsWhatBruteForceFinds) {
  for (const double size : {0.1, 1.0, 30.0})
    for (const double scale : {1.0, 123.456}) {
      const Soup soup = random_soup(1500, size, {0, 0, 0}, 7);
      const TriangleTree tree(soup.points, soup.triangles, scale);
      std::mt19937 random(8);
      std::uniform_real_distribution<double> unit(-15, 15);
      for (int trial = 0; trial < 300; ++trial) {
        const Eigen::Vector3d p = scale * Eigen::Vector3d(unit(random), unit(random), unit(random));
        const NearestTriangle expected = brute_force(tree, p), found = tree.nearest(p);
        EXPECT_EQ(found.squared, expected.squared);
        EXPECT_EQ(found.triangle, expected.triangle);
      }
    }
}

TEST(TriangleTree, FarFromTheOrigin) {
  const Soup soup = random_soup(500, 1, {4000, -3000, 1000}, 9);
  const double scale = 2e5;  // coordinates up to 8e8
  const TriangleTree tree(soup.points, soup.triangles, scale);
  std::mt19937 random(10);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int trial = 0; trial < 300; ++trial) {
    const Eigen::Vector3d nearby =
        tree.corner(static_cast<std::uint32_t>(random() % 500), 0) +
        std::pow(10.0, 3 * unit(random)) * Eigen::Vector3d(unit(random), unit(random), unit(random));
    EXPECT_EQ(tree.nearest(nearby).squared, brute_force(tree, nearby).squared);
  }
}

TEST(TriangleTree, KeepsToTheBound) {
  const std::vector<Eigen::Vector3f> points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Triangle> triangles = {{0, 1, 2}, {0, 1, 2}, {2, 0, 1}};
  const TriangleTree tree(points, triangles, 2.0);
  const NearestTriangle on_bound = tree.nearest({0, 0, 3}, 9);
  EXPECT_EQ(on_bound.squared, 9);
  EXPECT_EQ(on_bound.triangle, 0u);
  const NearestTriangle beyond = tree.nearest({0, 0, 3}, 8.99);
  EXPECT_EQ(beyond.squared, 8.99);
  EXPECT_EQ(beyond.triangle, TriangleTree::kNone);
}

TEST(TriangleTree, OfNothingFindsNothing) {
  const TriangleTree tree({}, {}, 1.0);
  EXPECT_EQ(tree.nearest({0, 0, 0}).triangle, TriangleTree::kNone);
}

TEST(TriangleTree, OrdersCrowdedPlacesByACurveOfTheirOwn) {
  // All but one triangle are in one cell of the outer curve; leaves are small all the same.
  Soup soup = random_soup(4000, 1e-3, {0, 0, 0}, 11);
  soup.points.push_back({1e7f, 1e7f, 1e7f});
  const auto last = static_cast<std::uint32_t>(soup.points.size() - 1);
  soup.triangles.push_back({last, last, last});
  const TriangleTree tree(soup.points, soup.triangles, 1.0);
  double sum = 0;
  for (std::size_t leaf = 0; leaf < 490; ++leaf) {
    const TriangleTree::BoxPack& pack = tree.packs()[leaf / TriangleTree::kFan];
    sum += pack.upper[0][leaf % TriangleTree::kFan] - pack.lower[0][leaf % TriangleTree::kFan];
  }
  EXPECT_LT(sum / 490, 5);  // of 20; in the order of their numbers it would be about 15
}

TEST(TriangleTree, IsTheSameForEveryNumberOfThreads) {
  const Soup soup = random_soup(100000, 0.2, {0, 0, 0}, 12);
  std::vector<TriangleTree> trees;
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    trees.emplace_back(soup.points, soup.triangles, 3.0);
    const std::span<const TriangleTree::BoxPack> one = trees[0].packs(), other = trees.back().packs();
    ASSERT_EQ(one.size(), other.size());
    EXPECT_EQ(std::memcmp(one.data(), other.data(), one.size_bytes()), 0);
    for (std::size_t leaf = 0; leaf * TriangleTree::kLeafSize < soup.triangles.size(); ++leaf)
      ASSERT_TRUE(std::ranges::equal(trees[0].leaf(leaf), trees.back().leaf(leaf)));
  }
  EXPECT_LT(static_cast<double>(trees[0].byte_size()) / 100000, 9);
}

}  // namespace triangle_tree_test
}  // namespace hermesh
