#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "algorithms/thesis/thesis_voxelizer.h"

namespace hermesh {
namespace thesis_rasterization_test {

using Eigen::Vector3d;

// ---- The exact rasterisation, as an oracle: separating axes of a triangle and a closed cube of edge 1.

bool touches(const GridTriangle& t, const Voxel& voxel) {
  const Vector3d centre(voxel[0], voxel[1], voxel[2]);
  const Vector3d p[3] = {t[0] - centre, t[1] - centre, t[2] - centre};
  const Vector3d edges[3] = {p[1] - p[0], p[2] - p[1], p[0] - p[2]};
  const auto separates = [&](const Vector3d& axis) {
    const double d[3] = {axis.dot(p[0]), axis.dot(p[1]), axis.dot(p[2])};
    const double reach = 0.5 * axis.cwiseAbs().sum();
    return std::min({d[0], d[1], d[2]}) > reach || std::max({d[0], d[1], d[2]}) < -reach;
  };
  if (separates(edges[0].cross(edges[1]))) return false;
  for (int a = 0; a < 3; ++a) {
    if (separates(Vector3d::Unit(a))) return false;
    for (const Vector3d& edge : edges)
      if (separates(edge.cross(Vector3d::Unit(a)))) return false;
  }
  return true;
}

std::vector<Voxel> exact_rasterization(const GridTriangle& t) {
  const Vector3d low = t[0].cwiseMin(t[1]).cwiseMin(t[2]), high = t[0].cwiseMax(t[1]).cwiseMax(t[2]);
  std::vector<Voxel> result;
  const auto from = [&](int a) { return int(std::floor(low[a])); };
  const auto to = [&](int a) { return int(std::ceil(high[a])); };
  for (int x = from(0); x <= to(0); ++x)
    for (int y = from(1); y <= to(1); ++y)
      for (int z = from(2); z <= to(2); ++z)
        if (touches(t, {x, y, z})) result.push_back({x, y, z});
  return result;
}

GridTriangle random_triangle(std::mt19937_64& random, double size) {
  std::uniform_real_distribution<double> within(0.0, 1.0);
  const auto point = [&] { return Vector3d(within(random), within(random), within(random)); };
  const Vector3d shift = point();
  GridTriangle t;
  for (Vector3d& corner : t) corner = shift + size * point();
  return t;
}

TEST(ThesisRasterization, SmallTrianglesGiveTheVoxelsOfTheirCorners) {
  const std::vector<Voxel> voxels =
      rasterize_by_samples({Vector3d(0.4, 0, 0), Vector3d(0.6, 0, 0), Vector3d(0.4, -0.55, 0.5)});
  EXPECT_EQ(voxels, (std::vector<Voxel>{{0, -1, 1}, {0, 0, 0}, {1, 0, 0}}));
}

TEST(ThesisRasterization, LongSegmentsAreSampledAtEveryVoxel) {
  const Vector3d a(0, 0, 0), b(5, 0, 0);
  const std::vector<Voxel> line = rasterize_by_samples({a, b, a});
  EXPECT_EQ(line, (std::vector<Voxel>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}, {5, 0, 0}}));
}

// Trap T8: not every voxel that a triangle touches holds a sample.
TEST(ThesisRasterization, SamplesMissSomeVoxelsAndInventNone) {
  std::mt19937_64 random(8);
  for (const double size : {1.0, 2.0, 5.0, 20.0, 60.0}) {
    std::size_t touched = 0, missed = 0;
    for (int i = 0; i < 300; ++i) {
      const GridTriangle t = random_triangle(random, size);
      const std::vector<Voxel> sampled = rasterize_by_samples(t), exact = exact_rasterization(t);
      touched += exact.size();
      for (const Voxel& voxel : exact)
        missed += std::binary_search(sampled.begin(), sampled.end(), voxel) ? 0 : 1;
      for (const Voxel& voxel : sampled) ASSERT_TRUE(std::binary_search(exact.begin(), exact.end(), voxel));
    }
    const double share = double(missed) / double(touched);
    std::printf("triangles in a box of %2g voxels: %.1f %% of the touched voxels missed\n", size,
                100 * share);
    EXPECT_GT(share, 0.05);
    EXPECT_LT(share, 0.75);
  }
}

}  // namespace thesis_rasterization_test
}  // namespace hermesh
