#include "algorithms/voxelization/distance/triangle_bins.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "algorithms/voxelization/distance/band.h"

namespace hermesh {
namespace triangle_bins_test {

using Eigen::Vector3f;

/// Triangles of about `size` in random order along a long bent sheet, so that there are many slabs.
PolygonMesh sheet(std::size_t count, float size, bool shuffled) {
  std::mt19937 random(7);
  const auto number = [&](float scale) { return scale * (float(random() % 100'000u) / 100'000.0f - 0.5f); };
  PolygonMesh mesh;
  for (std::size_t t = 0; t < count; ++t) {
    const float x = 300.0f * float(t) / float(count) - 150.0f;
    const Vector3f centre(x, 20.0f * std::sin(0.05f * x) + number(20), number(20));
    const std::uint32_t n = std::uint32_t(mesh.points.size());
    for (int c = 0; c < 3; ++c)
      mesh.points.push_back(centre + Vector3f(number(size), number(size), number(size)));
    mesh.triangles.push_back({n, n + 1, n + 2});
  }
  if (shuffled)
    for (std::size_t t = count; t > 1; --t) std::swap(mesh.triangles[t - 1], mesh.triangles[random() % t]);
  return mesh;
}

double gap2(const Bounds& box, const BlockAt& block) {
  double sum = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    const double g = std::max({0.0, box.lower[a] - (block[a] * 8.0 + 7.0), block[a] * 8.0 - box.upper[a]});
    sum += g * g;
  }
  return sum;
}

Bounds box_of(const IndexSoup& soup, std::uint32_t t) {
  const TriangleCorners c = soup.corners(t);
  Bounds box;
  for (std::size_t a = 0; a < 3; ++a) {
    box.lower[a] = std::min({c[a], c[a + 3], c[a + 6]});
    box.upper[a] = std::max({c[a], c[a + 3], c[a + 6]});
  }
  return box;
}

std::vector<std::uint32_t> asked(const TriangleBins& bins, const BlockAt& block) {
  std::vector<std::uint32_t> found;
  bins.for_each_cluster(block, [&](const TriangleBins::Cluster& cluster) {
    found.insert(found.end(), cluster.triangles.begin(), cluster.triangles.end());
  });
  if (const std::uint32_t i = bins.blocks().find(block); i != BlockTable::kNone)
    found.insert(found.end(), bins.large(i).begin(), bins.large(i).end());
  std::sort(found.begin(), found.end());
  return found;
}

/// Expects every triangle whose box is within reach of the block, and none twice.
void expect_complete(const TriangleBins& bins, const IndexSoup& soup, const BlockAt& block, double reach) {
  const std::vector<std::uint32_t> found = asked(bins, block);
  ASSERT_TRUE(std::adjacent_find(found.begin(), found.end()) == found.end());
  for (std::uint32_t t = 0; t < soup.size(); ++t)
    ASSERT_TRUE(gap2(box_of(soup, t), block) > reach * reach ||
                std::binary_search(found.begin(), found.end(), t))
        << t;
}

class ManySlabs : public testing::TestWithParam<bool> {};

TEST_P(ManySlabs, ABlockFindsItsTrianglesWithAndWithoutItsSlabInMemory) {
  const PolygonMesh mesh = sheet(300'000, 1.0f, GetParam());
  const IndexSoup soup(mesh, 1.0);
  RunContext context;
  TriangleBins bins(soup, 3.0, context);
  ASSERT_GT(bins.slab_count(), 2u);
  const std::vector<BlockAt> blocks = bins.blocks().blocks();
  for (std::size_t i = 0; i < blocks.size(); i += 97) {
    bins.forget_slabs();
    expect_complete(bins, soup, blocks[i], 3.0);
    const std::vector<std::uint32_t> without = asked(bins, blocks[i]);
    bins.go_to_slab(bins.slab_of(blocks[i]));
    expect_complete(bins, soup, blocks[i], 3.0);
    for (const std::uint32_t t : asked(bins, blocks[i])) ASSERT_LT(t, soup.size());
    EXPECT_FALSE(without.empty() && !asked(bins, blocks[i]).empty());
  }
}

TEST_P(ManySlabs, EveryBlockNearATriangleIsThere) {
  const PolygonMesh mesh = sheet(100'000, 2.0f, GetParam());
  const IndexSoup soup(mesh, 1.0);
  RunContext context;
  const TriangleBins bins(soup, 3.0, context);
  for (std::uint32_t t = 0; t < soup.size(); t += 11) {
    const Bounds box = box_of(soup, t);
    // The voxels next to the middle of the box are within reach.
    BlockAt block;
    for (std::size_t a = 0; a < 3; ++a)
      block[a] = std::int32_t(std::floor(0.5 * (box.lower[a] + box.upper[a]) + 0.5)) >> 3;
    ASSERT_NE(bins.blocks().find(block), BlockTable::kNone);
  }
}

TEST_P(ManySlabs, OnlyTheSlabsAroundTakeMemory) {
  const PolygonMesh mesh = sheet(600'000, 0.5f, GetParam());
  const IndexSoup soup(mesh, 1.0);
  RunContext context;
  TriangleBins bins(soup, 3.0, context);
  ASSERT_GE(bins.slab_count(), 8u);
  // Packed numbers take two bytes a triangle where the mesh is in any order, and one where it goes along the
  // surface; a triangle of a slab takes four more and its sixteenth of a box of 24.
  bins.forget_slabs();
  EXPECT_LT(bins.bytes_in_memory(), (GetParam() ? 3.0 : 2.0) * double(soup.size()));
  const std::size_t packed = bins.bytes_in_memory();
  bins.go_to_slab(4);
  EXPECT_LT(bins.bytes_in_memory() - packed, 8 * 3 * soup.size() / bins.slab_count() * 3 / 2);
}

INSTANTIATE_TEST_SUITE_P(OrderOfTheMesh, ManySlabs, testing::Bool());

TEST(TriangleBins, ManyThreadsMayAskWithoutSlabs) {
  const PolygonMesh mesh = sheet(200'000, 1.0f, true);
  const IndexSoup soup(mesh, 1.0);
  RunContext context;
  TriangleBins bins(soup, 3.0, context);
  bins.forget_slabs();
  const std::vector<BlockAt> blocks = bins.blocks().blocks();
  std::vector<std::vector<std::uint32_t>> found(blocks.size());
  tbb::parallel_for(std::size_t(0), blocks.size(),
                    [&](std::size_t i) { found[i] = asked(bins, blocks[blocks.size() - 1 - i]); });
  for (std::size_t i = 0; i < blocks.size(); i += 31)
    EXPECT_EQ(found[i], asked(bins, blocks[blocks.size() - 1 - i]));
}

TEST(TriangleBins, SmallBoxFindsWhatMeetsIt) {
  const PolygonMesh mesh = sheet(100'000, 1.0f, true);
  const IndexSoup soup(mesh, 1.0);
  RunContext context;
  TriangleBins bins(soup, 3.0, context);
  bins.forget_slabs();
  const std::vector<BlockAt> blocks = bins.blocks().blocks();
  for (std::size_t i = 0; i < blocks.size(); i += 53) {
    Bounds near = around(blocks[i], -2.0);
    std::set<std::uint32_t> found;
    bins.for_each_cluster(blocks[i], near, [&](const TriangleBins::Cluster& cluster) {
      found.insert(cluster.triangles.begin(), cluster.triangles.end());
    });
    for (std::uint32_t t = 0; t < soup.size(); ++t) {
      const Bounds box = box_of(soup, t);
      bool meets = true;
      for (std::size_t a = 0; a < 3; ++a)
        meets &= box.lower[a] <= near.upper[a] && box.upper[a] >= near.lower[a];
      ASSERT_TRUE(!meets || found.contains(t)) << t;
    }
  }
}

/// Distances do not depend on the order of the triangles in the mesh.
TEST(Band, SameDistancesWhateverTheOrderOfTheTriangles) {
  PolygonMesh mesh = sheet(200'000, 1.0f, false);
  RunContext context;
  const auto make = [&] {
    const IndexSoup soup(mesh, 1.0);
    TriangleBins bins(soup, 3.0, context);
    return compute_band(soup, bins, {.reach = 3.0, .voxel_size = 1.0}, context);
  };
  const Band once = make();
  std::mt19937 random(3);
  for (std::size_t t = mesh.triangles.size(); t > 1; --t)
    std::swap(mesh.triangles[t - 1], mesh.triangles[random() % t]);
  const Band again = make();
  std::size_t leaves = 0;
  for (const auto& leaf : once.leaves) leaves += leaf ? 1 : 0;
  ASSERT_GT(leaves, 100u);
  std::map<BlockAt, const FloatLeaf*> other;
  for (std::size_t i = 0; i < again.blocks.size(); ++i)
    if (again.leaves[i]) other[again.blocks[i]] = again.leaves[i].get();
  ASSERT_EQ(other.size(), leaves);
  for (std::size_t i = 0; i < once.blocks.size(); ++i)
    for (unsigned v = 0; v < (once.leaves[i] ? 512u : 0u); ++v) {
      // Of two triangles that share the nearest point one may be left out, as its cluster cannot be nearer;
      // their distances are equal except for the rounding of their planes.
      ASSERT_NEAR(once.leaves[i]->getValue(v), other.at(once.blocks[i])->getValue(v), 2e-6);
    }
}

}  // namespace triangle_bins_test
}  // namespace hermesh
