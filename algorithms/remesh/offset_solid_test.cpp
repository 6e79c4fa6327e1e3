#include "algorithms/remesh/offset_solid.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <numbers>

#include "algorithms/remesh/height_field.h"
#include "algorithms/remesh/remesh.h"
#include "algorithms/variants.h"
#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace offset_solid_test {

using Eigen::Vector3d;
using std::numbers::pi;
using voxelize_for_tests::add_triangle;
using voxelize_for_tests::append;
using voxelize_for_tests::box;
using voxelize_for_tests::sphere;

constexpr double kTolerance = 0.1;  ///< of the default extractor, in voxels

Remeshed offset_of(const PolygonMesh& mesh, const Offset& offset, double voxel_size) {
  RunContext context;
  const VoxelizeRecipe voxelizing{
      .chosen = choose(our_voxelizers(), "hermesh"), .voxel_size = voxel_size, .offset = offset};
  return remesh(mesh, voxelizing, {.chosen = choose(our_extractors(), "manifold-dual-contouring")}, context);
}

Remeshed grown(const PolygonMesh& mesh, double distance, double voxel_size) {
  return offset_of(mesh, {Offset::Kind::solid, distance}, voxel_size);
}

/// Returns the volume that a mesh encloses.
double volume(const PolygonMesh& mesh) {
  double sum = 0.0;
  for (const Triangle& t : triangulated(mesh))
    sum += mesh.world(t[0]).dot(mesh.world(t[1]).cross(mesh.world(t[2]))) / 6.0;
  return sum;
}

double largest(const OffsetErrors& errors) { return std::max(errors.below, errors.above); }

/// The mesh of a ball of the tests: chords of 48 steps make it smaller by 0.2 %.
constexpr double kRadius = 1.0;
PolygonMesh ball(const Vector3d& centre = Vector3d::Zero()) { return sphere(centre, kRadius, 96); }

TEST(OffsetSolid, BallsGrowAndShrink) {
  for (const double distance : {0.3, 0.05, -0.05, -0.3}) {
    SCOPED_TRACE(distance);
    const double voxel_size = 0.03, radius = kRadius + distance;
    const Remeshed made = grown(ball(), distance, voxel_size);
    EXPECT_NEAR(volume(made.mesh), 4.0 / 3.0 * pi * radius * radius * radius,
                0.004 * radius * radius * 4.0 * pi);
    for (std::size_t p = 0; p < made.mesh.points.size(); ++p)
      EXPECT_NEAR(made.mesh.world(p).norm(), radius, kTolerance * voxel_size + 6e-4);
  }
}

TEST(OffsetSolid, ACubeHasRoundedEdgesOutsideAndNoneInside) {
  const PolygonMesh cube = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  for (const double d : {0.15, 0.4}) {
    const Remeshed made = grown(cube, d, 0.025);
    EXPECT_NEAR(volume(made.mesh), 1.0 + 6.0 * d + 3.0 * pi * d * d + 4.0 / 3.0 * pi * d * d * d, 8e-3);
    EXPECT_LT(largest(*made.offset), 1.2 * kTolerance * 0.025);
  }
  const Remeshed less = grown(cube, -0.15, 0.025);
  EXPECT_NEAR(volume(less.mesh), 0.7 * 0.7 * 0.7, 1e-6);
  EXPECT_EQ(less.mesh.triangle_count(), 12u);
  EXPECT_LT(largest(*less.offset), 1e-6);
}

TEST(OffsetSolid, ATorusKeepsItsHole) {
  PolygonMesh torus;
  const int n = 120;
  const auto at = [&](int i, int j) {
    const double a = 2 * pi * (i % n) / n, b = 2 * pi * (j % n) / n, r = 1.0 + 0.4 * std::cos(b);
    return Vector3d(r * std::cos(a), r * std::sin(a), 0.4 * std::sin(b));
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      add_triangle(torus, at(i, j), at(i + 1, j), at(i + 1, j + 1));
      add_triangle(torus, at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  for (const double distance : {0.2, -0.2}) {
    const Remeshed made = grown(torus, distance, 0.03);
    const double r = 0.4 + distance;
    EXPECT_NEAR(volume(made.mesh), 2 * pi * pi * r * r, 0.012 * r * 4 * pi * pi);
    EXPECT_LT(largest(*made.offset), 1.5 * kTolerance * 0.03);
    const auto edges = 3 * made.mesh.triangle_count() / 2;
    EXPECT_EQ(made.mesh.points.size() + made.mesh.triangle_count(), edges) << "the genus is 1";
  }
}

/// Two boxes that overlap: their faces within the solid bound nothing. The solid is a plus of two bars.
TEST(OffsetSolid, FacesWithinTheSolidDoNotCount) {
  PolygonMesh bars = box(Vector3d(-2, -0.5, -0.5), Vector3d(2, 0.5, 0.5));
  append(bars, box(Vector3d(-0.5, -2, -0.5), Vector3d(0.5, 2, 0.5)));
  const Remeshed less = grown(bars, -0.2, 0.05);
  // Bars of 3.6 × 0.6 × 0.6, and where they meet reflex edges with arcs of radius 0.2.
  const double arcs = 4 * (0.2 * 0.2 - pi * 0.2 * 0.2 / 4) * 0.6;
  EXPECT_NEAR(volume(less.mesh), 0.6 * (2 * 3.6 * 0.6 - 0.36) + arcs, 5e-3);
  // Two bodies become one when they grow by more than half of their gap.
  PolygonMesh pair = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  append(pair, box(Vector3d(1.2, 0, 0), Vector3d(2.2, 1, 1)));
  const double d = 0.15, one = 1.0 + 6.0 * d + 3.0 * pi * d * d + 4.0 / 3.0 * pi * d * d * d;
  // Their overlap is a lens of thickness 0.1: a slab of sections of the rounded boxes.
  double lens = 0.0;
  for (int i = 0; i < 1000; ++i) {
    const double x = 0.05 * (i + 0.5) / 1000, reach = 0.1 + x, r = std::sqrt(d * d - reach * reach);
    lens += 2.0 * 0.05 / 1000 * (1.0 + 4.0 * r + pi * r * r);
  }
  const Remeshed more = grown(pair, d, 0.025);
  EXPECT_NEAR(volume(more.mesh), 2.0 * one - lens, 8e-3);
}

TEST(OffsetSolid, AnOpenSheetBecomesAWall) {
  PolygonMesh sheet;
  sheet.points = {{0, 0, 0}, {3, 0, 0}, {3, 2, 0}, {0, 2, 0}};
  sheet.quads.push_back({0, 1, 2, 3});
  const double t = 0.3, r = 0.5 * t;
  const Remeshed made = offset_of(sheet, {Offset::Kind::shell, t}, 0.03);
  EXPECT_NEAR(volume(made.mesh), 6.0 * t + 10.0 * pi * r * r / 2 + 4.0 / 3.0 * pi * r * r * r, 0.01);
  EXPECT_LT(largest(*made.offset), 0.2 * 0.03);
  EXPECT_THROW(offset_of(sheet, {Offset::Kind::shell, t}, t / 1.1), Error);
  EXPECT_THROW(grown(box(Vector3d(0, 0, 0), Vector3d(1, 1, 1)), -0.6, 0.03), Error);
}

TEST(OffsetSolid, TheSameBytesForEveryNumberOfThreads) {
  PolygonMesh first;
  for (const std::size_t threads : {1, 2, 5}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const PolygonMesh mesh = grown(ball(Vector3d(50, 0.1, 0)), 0.2, 0.06).mesh;
    if (first.empty()) first = mesh;
    EXPECT_EQ(mesh, first);
  }
}

/// A roof over a rectangle of 4 × 2: height 1 at the sides and 2 along the ridge.
PolygonMesh roof() {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 1}, {4, 0, 1}, {0, 1, 2}, {4, 1, 2}, {0, 2, 1}, {4, 2, 1}};
  mesh.quads = {{0, 1, 3, 2}, {2, 3, 5, 4}};
  return mesh;
}

TEST(FillBelow, AHeightFieldGetsWallsAndABase) {
  RunContext context;
  PolygonMesh field = roof();
  for (int turned = 0; turned < 2; ++turned) {
    const PolygonMesh solid = fill_below(field, -1.0, context);
    EXPECT_NEAR(volume(solid), 4 * 2 * (1 + 1.5), 1e-6);
    EXPECT_EQ(solid.triangle_count(), 4u + 4u + 2u * 6u);
    std::swap(field.quads[0][1], field.quads[0][3]);  // one polygon faces down
  }
  PolygonMesh cut = roof();
  cut.quads.pop_back();
  cut.points.push_back(cut.points[2]);  // a vertex twice, as in a file of single triangles
  cut.triangles.push_back({6, 3, 5});
  cut.triangles.push_back({6, 5, 4});
  EXPECT_NEAR(volume(fill_below(cut, 0.0, context)), 4 * 2 * 1.5, 1e-6);
}

TEST(FillBelow, OtherSurfacesAreRefused) {
  RunContext context;
  EXPECT_THROW(fill_below(roof(), 1.0, context), Error) << "the base touches the field";
  EXPECT_THROW(fill_below(box(Vector3d(0, 0, 0), Vector3d(1, 1, 1)), -1.0, context), Error)
      << "vertical faces";
  PolygonMesh layers = roof();
  append(layers, roof());
  for (std::size_t p = 6; p < 12; ++p) layers.points[p].z() += 1.0f;
  EXPECT_THROW(fill_below(layers, -1.0, context), Error);
}

}  // namespace offset_solid_test
}  // namespace hermesh
