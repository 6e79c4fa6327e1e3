#include "algorithms/voxelization/inside/winding_number.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <random>

#include "algorithms/lattice/simd/simd_level.h"
#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace winding_number_test {

using voxelize_for_tests::exact_winding_number;

struct Soup {
  std::vector<Eigen::Vector3f> points;
  std::vector<Triangle> triangles;

  double exact(const Eigen::Vector3d& p) const { return exact_winding_number(points, triangles, 1.0, p); }
  void add(const Soup& other) {
    const auto shift = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), other.points.begin(), other.points.end());
    for (const Triangle& t : other.triangles) triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  }
};

/// An icosahedron with each face split in four again and again, on a sphere about 0.
Soup icosphere(double radius, int splits) {
  const double g = (1 + std::sqrt(5.0)) / 2;
  std::vector<Eigen::Vector3d> p = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                    {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                    {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
  Soup soup;
  soup.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int split = 0; split < splits; ++split) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(p.size()));
      if (is_new) p.push_back(p[a].normalized() + p[b].normalized());
      return at->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : soup.triangles) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      for (const Triangle& t : {Triangle{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}})
        finer.push_back(t);
    }
    soup.triangles = std::move(finer);
  }
  for (const Eigen::Vector3d& v : p) soup.points.push_back((radius * v.normalized()).cast<float>());
  return soup;
}

Soup random_soup(int count, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto vector = [&] { return Eigen::Vector3f(unit(random), unit(random), unit(random)); };
  Soup soup;
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(count); ++i) {
    const Eigen::Vector3f centre = 20 * vector();
    for (int c = 0; c < 3; ++c) soup.points.push_back(centre + static_cast<float>(size) * vector());
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return soup;
}

std::vector<Eigen::Vector3d> random_points(int count, double reach, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-reach, reach);
  std::vector<Eigen::Vector3d> points(count);
  for (Eigen::Vector3d& p : points) p = {unit(random), unit(random), unit(random)};
  return points;
}

std::vector<Eigen::Vector3d> block_at(const Eigen::Vector3d& lower) {
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 512; ++i) points.push_back(lower + Eigen::Vector3d(i >> 6, (i >> 3) & 7, i & 7));
  return points;
}

/// The largest error of single queries, and of queries in blocks around the same points.
double largest_error(const Soup& soup, std::span<const Eigen::Vector3d> places) {
  const TriangleTree tree(soup.points, soup.triangles, 1.0);
  const WindingNumber fast(tree);
  double largest = 0;
  std::vector<float> values(512);
  for (std::size_t i = 0; i < places.size(); ++i) {
    largest = std::max(largest, std::abs(fast.at(places[i]) - soup.exact(places[i])));
    if (i % 16 != 0) continue;
    const std::vector<Eigen::Vector3d> block = block_at(places[i].array().floor() - 4);
    fast.at(block, values);
    for (std::size_t k = i % 7; k < 512; k += 37)
      largest = std::max(largest, std::abs(values[k] - soup.exact(block[k])));
  }
  return largest;
}

TEST(WindingNumber, CountsTheSheetsAroundAPoint) {
  Soup sphere = icosphere(10, 3);
  const Soup inner = icosphere(5, 2);
  const std::vector<std::int8_t> over(sphere.triangles.size(), -1);
  const TriangleTree one(sphere.points, sphere.triangles, 1.0);
  EXPECT_NEAR(WindingNumber(one).at({1, 2, 3}), 1, 0.01);
  EXPECT_NEAR(WindingNumber(one).at({12, 0, 0}), 0, 0.01);
  EXPECT_NEAR(WindingNumber(one).at({1e6, 1e6, 0}), 0, 1e-6);
  EXPECT_NEAR(WindingNumber(one, over).at({1, 2, 3}), -1, 0.01);
  sphere.add(inner);
  const TriangleTree two(sphere.points, sphere.triangles, 1.0);
  EXPECT_NEAR(WindingNumber(two).at({1, 2, 3}), 2, 0.01);
  EXPECT_NEAR(WindingNumber(two).at({0, 7, 0}), 1, 0.01);
  std::vector<std::int8_t> hole(sphere.triangles.size(), 1);
  std::fill_n(hole.end() - static_cast<std::ptrdiff_t>(inner.triangles.size()), inner.triangles.size(), -1);
  EXPECT_NEAR(WindingNumber(two, hole).at({1, 2, 3}), 0, 0.01);
}

TEST(WindingNumber, LeavesOutWhatHasNoTurn) {
  const Soup sphere = icosphere(10, 3);
  const TriangleTree tree(sphere.points, sphere.triangles, 1.0);
  const std::vector<std::int8_t> none(sphere.triangles.size(), 0);
  EXPECT_EQ(WindingNumber(tree, none).at({1, 2, 3}), 0);
  EXPECT_EQ(WindingNumber(tree, none).at({9.9, 0, 0}), 0);
}

TEST(WindingNumber, OfNothingIsZero) {
  const TriangleTree tree({}, {}, 1.0);
  EXPECT_EQ(WindingNumber(tree).at({0, 0, 0}), 0);
}

TEST(WindingNumber, OfAHemisphereOnItsAxis) {
  // From height z its rim is seen under the solid angle 2π(1 − z/√(z² + r²)), the missing part.
  Soup half = icosphere(10, 5);
  std::erase_if(half.triangles, [&](const Triangle& t) {
    return half.points[t[0]][2] + half.points[t[1]][2] + half.points[t[2]][2] < 0;
  });
  const TriangleTree tree(half.points, half.triangles, 1.0);
  const WindingNumber fast(tree);
  for (const double z : {-20.0, -5.0, 0.0, 2.0, 5.0, 9.0})
    EXPECT_NEAR(fast.at({0, 0, z}), 0.5 * (1 + z / std::hypot(z, 10)), 0.012) << z;
  EXPECT_NEAR(fast.at({0, 0, 15}), 0.5 * (15 / std::hypot(15.0, 10) - 1), 0.012);
}

TEST(WindingNumber, OfOneTriangleByHand) {
  // The corner of a cube sees an eighth of the sphere through (1,0,0) (0,1,0) (0,0,1).
  const std::vector<Eigen::Vector3f> points = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const std::vector<Triangle> triangles = {{0, 1, 2}};
  EXPECT_NEAR(exact_winding_number(points, triangles, 3.0, {0, 0, 0}), 0.125, 1e-15);
  const TriangleTree tree(points, triangles, 3.0);
  EXPECT_NEAR(WindingNumber(tree).at({0, 0, 0}), 0.125, 1e-6);
}

TEST(WindingNumber, JumpsByOneAcrossASurface) {
  const Soup sphere = icosphere(10, 4);
  const TriangleTree tree(sphere.points, sphere.triangles, 1.0);
  const WindingNumber fast(tree);
  for (std::uint32_t t = 0; t < sphere.triangles.size(); t += 7) {
    const Eigen::Vector3d middle = (tree.corner(t, 0) + tree.corner(t, 1) + tree.corner(t, 2)) / 3;
    const Eigen::Vector3d step = 1e-7 * middle.normalized();
    EXPECT_NEAR(fast.at(middle - step), 1, 0.01);
    EXPECT_NEAR(fast.at(middle + step), 0, 0.01);
  }
}

TEST(WindingNumber, IsExactToAHundredthOnSpheres) {
  const Soup sphere = icosphere(30, 5);
  std::vector<Eigen::Vector3d> places = random_points(300, 35, 1);
  for (std::size_t i = 0; i < places.size(); i += 2)
    places[i] = (30 + 0.1 * std::sin(double(i))) * places[i].normalized();
  EXPECT_LT(largest_error(sphere, places), 0.01);
}

TEST(WindingNumber, IsExactToAHundredthOnNoise) {
  // A crumpled sphere: neighbouring faces point anywhere.
  Soup noise = icosphere(20, 5);
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (Eigen::Vector3f& p : noise.points)
    p += 1.5f * Eigen::Vector3f(unit(random), unit(random), unit(random));
  std::vector<Eigen::Vector3d> places = random_points(300, 25, 3);
  for (std::size_t i = 0; i < places.size(); i += 2) places[i] = 20 * places[i].normalized();
  EXPECT_LT(largest_error(noise, places), 0.01);
}

TEST(WindingNumber, IsExactToAHundredthOnSoups) {
  for (const double size : {0.2, 1.0, 8.0}) {
    const Soup soup = random_soup(4000, size, 4);
    EXPECT_LT(largest_error(soup, random_points(200, 25, 5)), 0.01) << size;
  }
}

TEST(WindingNumber, TakesLargeTrianglesInDoublePrecision) {
  // A block next to the face of a box 2e6 voxels wide, with samples 1e-3 voxels from it.
  Soup box;
  for (int i = 0; i < 8; ++i)
    box.points.push_back(1e6f * Eigen::Vector3f(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  box.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  const TriangleTree tree(box.points, box.triangles, 1.0);
  std::vector<float> values(512);
  WindingNumber(tree).at(block_at({1e6 - 4 + 1e-3, 12345, 777}), values);
  for (int i = 0; i < 512; ++i) EXPECT_NEAR(values[i], (i >> 6) < 4 ? 1.0 : 0.0, 1e-5);
}

TEST(WindingNumber, OfManyPointsIsThatOfEach) {
  const Soup sphere = icosphere(12, 4);
  const TriangleTree tree(sphere.points, sphere.triangles, 1.0);
  const WindingNumber fast(tree);
  const std::vector<Eigen::Vector3d> points = random_points(1300, 14, 6);  // several batches, not full ones
  std::vector<float> values(points.size());
  fast.at(points, values);
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(values[i], fast.at(points[i]), 0.01);
  for (const std::size_t count : {0, 1, 2, 17, 65, 130}) {
    std::vector<float> few(count, -9.0f);
    fast.at(std::span(points).first(count), few);
    for (std::size_t i = 0; i < count; ++i) EXPECT_NEAR(few[i], values[i], 0.01);
  }
}

TEST(WindingNumber, IsTheSameForEveryNumberOfThreads) {
  const Soup soup = random_soup(30000, 1, 7);
  const std::vector<Eigen::Vector3d> points = block_at({3, -2, 5});
  std::vector<std::vector<float>> values;
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    const TriangleTree tree(soup.points, soup.triangles, 1.0);
    values.emplace_back(points.size());
    WindingNumber(tree).at(points, values.back());
    EXPECT_EQ(values[0], values.back());
  }
}

TEST(WindingNumber, IsTheSameAtAnyLevelOfVectorCode) {
  Soup soup = random_soup(3000, 1, 7);
  soup.add(icosphere(40, 0));  // its triangles are large compared with a block
  const std::vector<Eigen::Vector3d> points = block_at({3, -2, 5});
  std::vector<std::vector<float>> values;
  const TriangleTree tree(soup.points, soup.triangles, 1.0);
  for (const SimdLevel level : available_simd_levels()) {
    setenv("HERMESH_SIMD", std::string(name(level)).c_str(), 1);
    values.emplace_back(points.size());
    WindingNumber(tree).at(points, values.back());
    EXPECT_EQ(values[0], values.back()) << name(level);
  }
  unsetenv("HERMESH_SIMD");
}

}  // namespace winding_number_test
}  // namespace hermesh
