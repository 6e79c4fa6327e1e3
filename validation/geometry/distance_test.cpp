#include "validation/geometry/distance.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "validation/geometry/test_meshes.h"
#include "validation/hausdorff.h"

namespace hermesh::validation {
namespace distance_test {

using namespace test;

MeshFile square(double z, double x0 = 0.0, double x1 = 1.0) {
  MeshFile mesh;
  mesh.points = {{x0, 0, z}, {x1, 0, z}, {x1, 1, z}, {x0, 1, z}};
  mesh.quads = {{0, 1, 2, 3}};
  return mesh;
}

Distances distances(const MeshFile& from, const MeshFile& to, std::int64_t samples = 20000) {
  RunContext context;
  return sampled_distances(TriangleSoup(from), TriangleTree(TriangleSoup(to)), samples, context);
}

HausdorffBound bound(const MeshFile& from, const MeshFile& to, double gap) {
  RunContext context;
  return certified_distance(TriangleSoup(from), TriangleTree(TriangleSoup(to)), gap, context);
}

void expect_brackets(const HausdorffBound& b, double truth, double gap, double slack = 1e-7) {
  EXPECT_LE(b.lower, truth);
  EXPECT_GE(b.upper, truth);
  EXPECT_LE(b.upper - b.lower, gap * 1.001 + slack);
}

// The distance to a triangle by its definition: the least over a fine lattice of its points.
double lattice_distance(const Corners& t, const Eigen::Vector3d& p, int n) {
  double least = 1e300;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; i + j <= n; ++j)
      least = std::min(least, (t[0] + (t[1] - t[0]) * i / n + (t[2] - t[0]) * j / n - p).norm());
  return least;
}

TEST(ClosestPoint, AgreesWithALattice) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
  const auto point = [&] {
    return Eigen::Vector3d(coordinate(random), coordinate(random), coordinate(random));
  };
  for (int i = 0; i < 300; ++i) {
    const Corners t{point(), point(), point()};
    const Eigen::Vector3d p = 2.0 * point();
    const double distance = (closest_point(t, p) - p).norm();
    const double lattice = lattice_distance(t, p, 60);
    EXPECT_LE(distance, lattice + 1e-12);
    EXPECT_GE(distance, lattice - 3.5 / 60);  // no side is longer than 2√3
  }
}

TEST(ClosestPoint, TrianglesWithoutArea) {
  const Eigen::Vector3d a(0, 0, 0), b(2, 0, 0), c(1, 0, 0), p(1.5, 3, 0);
  EXPECT_EQ((closest_point({a, a, a}, p) - a).norm(), 0.0);
  EXPECT_NEAR((closest_point({a, b, c}, p) - p).norm(), 3.0, 1e-15);
  EXPECT_NEAR((closest_point({c, a, b}, p) - p).norm(), 3.0, 1e-15);
  EXPECT_NEAR((closest_point({a, a, b}, p) - p).norm(), 3.0, 1e-15);
}

TEST(TriangleTree, FindsWhatBruteForceFinds) {
  const MeshFile mesh = torus(30, 17);
  const TriangleSoup soup(mesh);
  const TriangleTree tree(soup);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> coordinate(-2.0, 2.0);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    double least = 1e300;
    for (std::size_t t = 0; t < soup.triangles.size(); ++t)
      least = std::min(least, (closest_point(soup.corners(t), p) - p).squaredNorm());
    EXPECT_EQ(tree.closest(p).squared, least);
    EXPECT_EQ(tree.closest(p, std::uint32_t(soup.triangles.size() - 1)).squared, least);
  }
  EXPECT_THROW(TriangleTree(TriangleSoup(MeshFile{})), Error);
}

TEST(SurfaceSamples, AreSpreadByArea) {
  // A unit square and one of a ninth of its area.
  MeshFile mesh = together(square(0.0), square(5.0, 0.0, 1.0 / 9.0));
  const TriangleSoup soup(mesh);
  const SurfaceSamples samples(soup, 10000);
  int upper = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::int64_t i = 0; i < samples.size(); ++i) {
    upper += samples[i].z() > 1.0;
    if (samples[i].z() < 1.0) mean += samples[i] / 9000.0;
  }
  EXPECT_NEAR(upper, 1000, 1);
  EXPECT_NEAR(mean.x(), 0.5, 0.01);
  EXPECT_NEAR(mean.y(), 0.5, 0.01);
}

TEST(Distances, ParallelSquares) {
  const Distances d = distances(square(0.0), square(0.25));
  EXPECT_DOUBLE_EQ(d.max, 0.25);
  EXPECT_NEAR(d.mean, 0.25, 1e-12);
  EXPECT_NEAR(d.rms, 0.25, 1e-12);
  EXPECT_EQ(d.samples, 20004);
}

TEST(Distances, MeanAndRmsAreOverTheArea) {
  // From [0,1]² to its left edge strip: the distance is x − 1/4 beyond the strip, 0 within.
  const Distances d = distances(square(0.0), square(0.0, 0.0, 0.25));
  EXPECT_DOUBLE_EQ(d.max, 0.75);
  EXPECT_DOUBLE_EQ(d.worst.x(), 1.0);
  EXPECT_NEAR(d.mean, 0.75 * 0.75 / 2.0, 1e-3);
  EXPECT_NEAR(d.rms, std::sqrt(0.75 * 0.75 * 0.75 / 3.0), 1e-3);
  EXPECT_EQ(distances(square(0.0, 0.0, 0.25), square(0.0)).max, 0.0);
}

TEST(Distances, IsolatedPointsAreNoSurface) {
  MeshFile mesh = square(0.0);
  mesh.points.emplace_back(100.0, 0.0, 0.0);
  EXPECT_DOUBLE_EQ(distances(mesh, square(0.5)).max, 0.5);
}

TEST(Distances, SameAtAnyThreadCount) {
  std::vector<Distances> all;
  for (std::size_t threads : {1u, 2u, 5u}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    all.push_back(distances(torus(50, 20), torus(23, 11)));
    const HausdorffBound b = bound(torus(50, 20), torus(23, 11), 1e-4);
    EXPECT_LE(all[0].max, b.upper);
    all.back().mean += b.lower + b.upper;
  }
  for (const Distances& d : all) {
    EXPECT_GT(d.max, 0.0);
    EXPECT_EQ(d.max, all[0].max);
    EXPECT_EQ(d.mean, all[0].mean);
    EXPECT_EQ(d.rms, all[0].rms);
    EXPECT_EQ(d.worst, all[0].worst);
  }
}

TEST(Hausdorff, NestedCubes) {
  const MeshFile outer = cube_of_triangles({-1, -1, -1}, 2.0), inner = cube_of_quads({-0.5, -0.5, -0.5}, 1.0);
  expect_brackets(bound(inner, outer, 1e-4), 0.5, 1e-4);
  expect_brackets(bound(outer, inner, 1e-4), std::sqrt(0.75), 1e-4);
  expect_brackets(bound(outer, outer, 1e-4), 0.0, 1e-4);
}

TEST(Hausdorff, ParallelOffset) { expect_brackets(bound(square(0.0), square(0.125), 1e-6), 0.125, 1e-6); }

TEST(Hausdorff, FindsAMaximumBetweenThePoints) {
  // All points of the square lie on one of the two strips; the farthest points are on the line x = 0.5
  // between them.
  const MeshFile strips = together(square(0.0, 0.0, 0.1), square(0.0, 0.9, 1.0));
  EXPECT_EQ(distances(square(0.0), strips, 0).max, 0.0);
  for (double gap : {0.1, 1e-3, 1e-4}) expect_brackets(bound(square(0.0), strips, gap), 0.4, gap);
}

TEST(Hausdorff, CoarsePrismAgainstFine) {
  // Without their ends: the sagitta 1 − cos(π/8) is at the middles of the coarse sides. The fine prism has a
  // sagitta of its own, by which the distance may be less.
  MeshFile coarse = prism(8), fine = prism(512);
  coarse.triangles.clear();
  fine.triangles.clear();
  const double sagitta = 1.0 - std::cos(std::numbers::pi / 8.0);
  const double own = 1.0 - std::cos(std::numbers::pi / 512.0);
  const HausdorffBound b = bound(coarse, fine, 2e-3);
  EXPECT_LE(b.lower, sagitta);
  EXPECT_GE(b.upper, sagitta - own);
  EXPECT_LE(b.upper - b.lower, 2.1e-3);
}

TEST(Hausdorff, BracketsDenseSampling) {
  const MeshFile a = torus(15, 9), b = torus(31, 14);
  const HausdorffBound certified = bound(a, b, 3e-3);
  const Distances sampled = distances(a, b, 30000);
  EXPECT_LE(sampled.max, certified.upper);
  EXPECT_GE(sampled.max, certified.lower - 6e-3);
  EXPECT_LE(certified.upper - certified.lower, 3e-3 + 1e-7);
}

// A needle a hundred million times as long as it is high, whose computed plane is tilted by that much. The
// truth is from quadruple precision: the foot is within the needle.
TEST(Hausdorff, ToANeedle) {
  MeshFile needle;
  needle.points = {{-0.19135289940533243, 0.25855359820650692, 0.166432725163458},
                   {-0.75100411165972891, -0.29349765187174526, -0.45165297917633951},
                   {-0.24687742030814802, 0.20378307162904363, 0.10511074898065616}};
  needle.triangles = {{0, 1, 2}};
  const Eigen::Vector3d p(-0.43707430461282631, 0.016201436042990278, -0.09994044621478157);
  MeshFile from;
  from.points = {p, p + Eigen::Vector3d(1e-9, 0, 0), p + Eigen::Vector3d(0, 1e-9, 0)};
  from.triangles = {{0, 1, 2}};
  const HausdorffBound b = bound(from, needle, 1e-12);
  const double truth = 0.0039201627952987232;
  EXPECT_LE(b.lower, truth);
  EXPECT_GE(b.upper, truth);
  EXPECT_NEAR(b.upper, truth, 1e-6);
}

TEST(Hausdorff, FarFromTheOrigin) {
  const Eigen::Vector3d far(3e6, -2e6, 1e6);
  const MeshFile outer = cube_of_triangles(far - Eigen::Vector3d::Ones(), 2.0);
  const MeshFile inner = cube_of_triangles(far - 0.5 * Eigen::Vector3d::Ones(), 1.0);
  expect_brackets(bound(outer, inner, 1e-4), std::sqrt(0.75), 1e-4);
}

/// A square of side 2 about the z axis, turned by an angle about the x axis; its normal is +z for 0.
MeshFile leaning_square(double degrees) {
  const double radians = degrees * std::numbers::pi / 180.0;
  MeshFile mesh;
  for (const auto& [x, y] : {std::pair{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}})
    mesh.points.emplace_back(x, y * std::cos(radians), y * std::sin(radians));
  mesh.quads.push_back({0, 1, 2, 3});
  return mesh;
}

NormalAngles angles(const MeshFile& from, const MeshFile& to) {
  RunContext context;
  const TriangleSoup from_soup(from), to_soup(to);
  return sampled_normal_angles(from_soup, TriangleTree(to_soup), 1000, context);
}

TEST(NormalError, IsTheAngleBetweenTwoPlanes) {
  for (const double degrees : {0.0, 1e-3, 17.0, 90.0, 179.0}) {
    const NormalAngles found = angles(leaning_square(degrees), leaning_square(0.0));
    EXPECT_NEAR(found.mean, degrees, 1e-9);
    EXPECT_NEAR(found.rms, degrees, 1e-9);
    EXPECT_NEAR(found.max, degrees, 1e-9);
    EXPECT_EQ(found.samples, 1000);
  }
}

TEST(NormalError, DetectsASurfaceThatIsInsideOut) {
  MeshFile reversed = leaning_square(0.0);
  reversed.quads[0] = {3, 2, 1, 0};
  EXPECT_NEAR(angles(reversed, leaning_square(0.0)).mean, 180.0, 1e-9);
}

TEST(NormalError, AveragesOverTheArea) {
  // Half of the area leans by 60 degrees: the mean is 30, the rms 60/√2.
  MeshFile both = leaning_square(0.0);
  const MeshFile leaning = leaning_square(60.0);
  for (const Eigen::Vector3d& p : leaning.points) both.points.push_back(p + Eigen::Vector3d(0, 0, 5));
  both.quads.push_back({4, 5, 6, 7});
  MeshFile flat = leaning_square(0.0);
  for (Eigen::Vector3d& p : flat.points) p *= 100.0;
  const NormalAngles found = angles(both, flat);
  EXPECT_NEAR(found.mean, 30.0, 1e-9);
  EXPECT_NEAR(found.rms, 60.0 / std::sqrt(2.0), 1e-9);
}

TEST(NormalError, LeavesOutTrianglesWithoutArea) {
  MeshFile needle = leaning_square(10.0);
  needle.triangles.push_back({0, 1, 1});
  EXPECT_NEAR(angles(needle, leaning_square(0.0)).max, 10.0, 1e-9);
}

constexpr double kSlack = 3.9e-7;  // the bracket is widened by 1e-7 of a diagonal of √2 on both sides

// The unit square in n × n cells of two triangles each, lifted to z(x, y).
MeshFile sheet(int n, const std::function<double(double, double)>& z) {
  MeshFile mesh;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) {
      const double x = double(i) / n, y = double(j) / n;
      mesh.points.emplace_back(x, y, z(x, y));
    }
  const auto point = [n](int i, int j) { return std::uint32_t(i * (n + 1) + j); };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      mesh.quads.push_back({point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)});
  return mesh;
}

// Two large triangles over 7442 small ones, at most a thousandth of a cell's width away. Halving alone would
// refine to that size along all sides of the cells, which takes half a minute. The greatest distance is that
// of the raised side of the tilted square to the side of the flat one. (The number of cells is odd, because
// halving would otherwise follow their sides.)
TEST(TriangleCover, LargeTrianglesOverSmallOnes) {
  const double height = 1.0 / 65536, gap = 1.0 / 524288;
  const MeshFile flat = sheet(61, [](double, double) { return 0.0; });
  const MeshFile tilted = sheet(1, [&](double x, double) { return height * x; });
  expect_brackets(bound(tilted, flat, gap), height, gap, kSlack);
  // In the other direction it is that of the same points to the tilted plane, with feet within the square.
  expect_brackets(bound(flat, tilted, gap), height / std::sqrt(1.0 + height * height), gap, kSlack);
}

// The plane z = 0 over a roof with the ridge at x = 1/2: at u from the ridge the distance to the plane z =
// −u/8 is u/8 / √(1 + 1/64), and greatest at u = 1/2.
TEST(TriangleCover, OverARidge) {
  const MeshFile plane = sheet(1, [](double, double) { return 0.0; });
  const MeshFile roof = sheet(46, [](double x, double) { return -0.125 * std::abs(x - 0.5); });
  expect_brackets(bound(plane, roof, 1e-5), 0.0625 / std::sqrt(1.0 + 1.0 / 64), 1e-5, kSlack);
}

// 2 × 2 cells of the fine sheet are missing: the middle of the hole is a cell's width from the others.
TEST(TriangleCover, OverAHole) {
  MeshFile fine = sheet(40, [](double, double) { return 0.0; });
  const std::size_t corner = 20 * 40 + 20;
  for (const std::size_t cell : {corner + 41, corner + 40, corner + 1, corner})
    fine.quads.erase(fine.quads.begin() + std::ptrdiff_t(cell));
  expect_brackets(bound(sheet(1, [](double, double) { return 0.0; }), fine, 1e-5), 1.0 / 40, 1e-5, kSlack);
}

// No point of the piece is farther from the surface than the bound.
TEST(TriangleCover, BoundsAllPoints) {
  const MeshFile mesh = torus(60, 30);
  const TriangleSoup soup(mesh);
  const TriangleTree tree(soup);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto offset = [&](double size) {
    return Eigen::Vector3d(size * uniform(random), size * uniform(random), size * uniform(random));
  };
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    const Corners& near = tree.corners(random() % tree.size());
    const double size = i % 2 == 0 ? 0.05 : 0.15, limit = i % 3 == 0 ? 0.01 : 0.05;
    Corners piece;
    for (Eigen::Vector3d& corner : piece)
      corner = tree.closest(near[0] + offset(size)).point + offset(0.5 * limit);
    const double bound = cover_bound(piece, tree, 1.0, limit);
    if (!std::isfinite(bound)) continue;
    ++found;
    EXPECT_LE(bound, limit);
    for (int a = 0; a <= 12; ++a)
      for (int b = 0; a + b <= 12; ++b) {
        const Eigen::Vector3d p = piece[0] + (piece[1] - piece[0]) * a / 12 + (piece[2] - piece[0]) * b / 12;
        EXPECT_LE(std::sqrt(tree.closest(p).squared), bound + 1e-12);
      }
  }
  EXPECT_GT(found, 200);
}

}  // namespace distance_test
}  // namespace hermesh::validation
