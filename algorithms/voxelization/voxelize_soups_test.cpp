// Voxelizations of random soups, compared with the nearest triangle that a tree finds.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/search/triangle_tree.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

void add_triangle(PolygonMesh& mesh, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const std::uint32_t n = std::uint32_t(mesh.points.size());
  for (const Vector3d& p : {a, b, c}) mesh.points.push_back(p.cast<float>());
  mesh.triangles.push_back({n, n + 1, n + 2});
}

class Soups {
 public:
  explicit Soups(std::uint64_t seed) : random_(seed) {}

  PolygonMesh next() {
    PolygonMesh mesh;
    const int kind = int(random_() % 8), n = 1 + int(random_() % 24);
    for (int i = 0; i < n; ++i) {
      const Vector3d a = point(12), b = kind == 3 ? a : Vector3d(a + point(kind == 5 ? 60 : 6));
      Vector3d c = a + point(6);
      if (kind == 1) c = 0.5 * (a + b) + 1e-4 * point(1);  // slivers
      if (kind == 2) c = a + 0.3 * (b - a);                // segments
      if (kind == 3) c = a;                                // points
      if (kind == 4) c = a + 1e-6 * point(1);              // needles
      if (kind == 6) {
        for (const Vector3d& v : {a, b, c}) add_whole(mesh, v);  // corners on voxels
      }
      if (kind != 6) add_triangle(mesh, a, b, c);
      if (kind == 7) add_triangle(mesh, a, c, b);  // coincident
    }
    if (kind == 6) {
      mesh.triangles.clear();
      for (std::uint32_t i = 0; i + 2 < mesh.points.size(); i += 3)
        mesh.triangles.push_back({i, i + 1, i + 2});
    }
    if (random_() % 4 == 0) mesh.origin = Vector3d(1e7, -3e8, 12345.678);
    return mesh;
  }
  double band() { return std::array{1.0, 1.5, 3.0, 4.25}[random_() % 4]; }
  double voxel_size() { return std::array{1.0, 0.37, 2.9}[random_() % 3]; }

 private:
  Vector3d point(double size) {
    std::uniform_real_distribution<double> uniform(-size, size);
    const double x = uniform(random_), y = uniform(random_);
    return {x, y, uniform(random_)};
  }
  static void add_whole(PolygonMesh& mesh, const Vector3d& v) {
    mesh.points.push_back(v.array().round().matrix().cast<float>());
  }
  std::mt19937_64 random_;
};

/// Holds so many random soups' bands against the nearest triangles, one by one.
void check_soups(int count, unsigned seed) {
  Soups soups(seed);
  std::size_t checked = 0;
  for (int i = 0; i < count; ++i) {
    const PolygonMesh mesh = soups.next();
    const double band = soups.band(), voxel_size = soups.voxel_size();
    RunContext context;
    const Voxelization v = voxelize(
        mesh,
        {.voxel_size = voxel_size, .exterior_band = band, .interior_band = band, .signs = SignRule::none},
        context);
    // A random sample of the box, or the whole of it where it is small, keeps this to seconds.
    const std::vector<Triangle> triangles = triangulated(mesh);
    const TriangleTree tree(mesh.points, triangles, 1.0 / voxel_size);
    const auto accessor = v.distance->getConstAccessor();
    std::size_t looked = 0;
    for (auto voxel = v.distance->cbeginValueAll(); voxel && looked < 60000; ++voxel) {
      if (!voxel.isVoxelValue()) continue;
      if (++looked % 37 != std::size_t(i % 37)) continue;
      const openvdb::Coord c = voxel.getCoord();
      const double truth = std::sqrt(tree.nearest(Vector3d(c.x(), c.y(), c.z())).squared);
      ++checked;
      if (voxel.isValueOn()) {
        ASSERT_NEAR(*voxel / voxel_size, truth, 1e-5) << "soup " << i << " at " << c;
      } else {
        ASSERT_GT(truth, band - 1e-4) << "soup " << i << " at " << c;
      }
    }
    // And every leaf is there: around each corner the band is active.
    for (const Triangle& t : triangles)
      for (const std::uint32_t p : t) {
        const Vector3d at = mesh.points[p].cast<double>() / voxel_size;
        const openvdb::Coord c(int(std::lround(at.x())), int(std::lround(at.y())), int(std::lround(at.z())));
        ASSERT_TRUE(accessor.isValueOn(c)) << "soup " << i;
      }
  }
  EXPECT_GT(checked, 50u * std::size_t(count));
}

/// Its corners lie on a line but for rounding, so that its normal is noise, and no end of it may be lost by
/// that.
TEST(Voxelize, ANeedleHasTheBandAroundBothEnds) {
  PolygonMesh needle;
  needle.points = {{1.9281562566757202f, 0.71781373023986816f, 2.6251864433288574f},
                   {-2.2653148174285889f, -0.73634469509124756f, 4.4785332679748535f},
                   {0.67011493444442749f, 0.28156620264053345f, 3.1811904907226562f}};
  needle.triangles = {{0, 1, 2}};
  RunContext context;
  const Voxelization v = voxelize(
      needle, {.voxel_size = 0.37, .exterior_band = 1.5, .interior_band = 1.5, .signs = SignRule::none},
      context);
  const auto accessor = v.distance->getConstAccessor();
  for (int step = 0; step <= 100; ++step) {
    const Eigen::Vector3f at = needle.points[0] + 0.01f * float(step) * (needle.points[1] - needle.points[0]);
    const Eigen::Vector3d voxels = at.cast<double>() / 0.37;
    const openvdb::Coord c(int(std::lround(voxels.x())), int(std::lround(voxels.y())),
                           int(std::lround(voxels.z())));
    EXPECT_TRUE(accessor.isValueOn(c)) << c;
  }
}

TEST(Voxelize, ThreeHundredSoupsAreExact) { check_soups(300, 20111); }
TEST(Slow, TwentyThousandSoupsAreExact) { check_soups(20000, 20112); }

}  // namespace
}  // namespace hermesh
