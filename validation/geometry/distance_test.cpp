#include "validation/geometry/distance.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <numbers>
#include <random>

#include "validation/geometry/surface_samples.h"
#include "validation/geometry/test_meshes.h"
#include "validation/hausdorff.h"

namespace hermesh::validation {
namespace {

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

void expect_brackets(const HausdorffBound& b, double truth, double gap) {
  EXPECT_LE(b.lower, truth);
  EXPECT_GE(b.upper, truth);
  EXPECT_LE(b.upper - b.lower, gap * 1.001 + 1e-7);
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

}  // namespace
}  // namespace hermesh::validation
