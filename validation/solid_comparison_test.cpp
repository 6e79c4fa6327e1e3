#include "validation/solid_comparison.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "validation/geometry/test_meshes.h"
#include "validation/outer_boundary.h"

namespace hermesh::validation {
namespace solid_comparison_test {

using namespace test;
using Eigen::Vector3d;
using Verdict = SolidComparison::Verdict;

MeshFile box(const Vector3d& lower, const Vector3d& upper) {
  MeshFile mesh = cube_of_quads();
  for (Vector3d& p : mesh.points) p = lower + p.cwiseProduct(upper - lower);
  return mesh;
}

/// A sphere of n rings of 2n triangles or quads each, its points on a sphere of radius r.
MeshFile globe(double r, const Vector3d& centre, int n) {
  MeshFile mesh;
  mesh.points.push_back(centre + Vector3d(0, 0, r));
  for (int i = 1; i < n; ++i)
    for (int j = 0; j < 2 * n; ++j) {
      const double u = std::numbers::pi * i / n, v = std::numbers::pi * j / n;
      mesh.points.push_back(centre +
                            r * Vector3d(std::sin(u) * std::cos(v), std::sin(u) * std::sin(v), std::cos(u)));
    }
  mesh.points.push_back(centre - Vector3d(0, 0, r));
  const std::uint32_t last = std::uint32_t(mesh.points.size() - 1);
  const auto at = [&](int i, int j) { return std::uint32_t(1 + (i - 1) * 2 * n + j % (2 * n)); };
  for (int j = 0; j < 2 * n; ++j) {
    mesh.triangles.push_back({0, at(1, j), at(1, j + 1)});
    mesh.triangles.push_back({last, at(n - 1, j + 1), at(n - 1, j)});
    for (int i = 1; i + 1 < n; ++i)
      mesh.quads.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
  }
  return mesh;
}

/// Unit cubes of an integer lattice, and their union's boundary as unit squares, each cut into n × n.
struct Bricks {
  MeshFile soup, boundary;
};

Bricks random_bricks(std::mt19937& random, int n) {
  constexpr int kSize = 8;
  std::vector<std::uint8_t> full(kSize * kSize * kSize, 0);
  const auto inside = [&](const Eigen::Vector3i& p) {
    return p.minCoeff() >= 0 && p.maxCoeff() < kSize &&
           full[std::size_t((p.x() * kSize + p.y()) * kSize + p.z())];
  };
  Bricks bricks;
  const int boxes = 1 + int(random() % 5);
  for (int i = 0; i < boxes; ++i) {
    Eigen::Vector3i lower, upper;
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = int(random() % (kSize - 2));
      upper[axis] = lower[axis] + 1 + int(random() % std::uint32_t(kSize - lower[axis]));
      upper[axis] = std::min(upper[axis], kSize);
    }
    bricks.soup = together(bricks.soup, box(lower.cast<double>(), upper.cast<double>()));
    for (int x = lower.x(); x < upper.x(); ++x)
      for (int y = lower.y(); y < upper.y(); ++y)
        for (int z = lower.z(); z < upper.z(); ++z) full[std::size_t((x * kSize + y) * kSize + z)] = 1;
  }
  for (int x = 0; x < kSize; ++x)
    for (int y = 0; y < kSize; ++y)
      for (int z = 0; z < kSize; ++z)
        for (int axis = 0; axis < 3; ++axis)
          for (int side : {0, 1}) {
            const Eigen::Vector3i at(x, y, z);
            Eigen::Vector3i beyond = at;
            beyond[axis] += side ? 1 : -1;
            if (!inside(at) || inside(beyond)) continue;
            for (int i = 0; i < n; ++i)
              for (int j = 0; j < n; ++j) {
                const std::uint32_t first = std::uint32_t(bricks.boundary.points.size());
                for (const auto& [u, v] :
                     {std::pair<int, int>{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}) {
                  Vector3d p = at.cast<double>();
                  p[axis] += side;
                  p[(axis + 1) % 3] += double(u) / n;
                  p[(axis + 2) % 3] += double(v) / n;
                  bricks.boundary.points.push_back(p);
                }
                bricks.boundary.quads.push_back(side ? Quad{first, first + 1, first + 2, first + 3}
                                                     : Quad{first, first + 3, first + 2, first + 1});
              }
          }
  bricks.boundary = welded(bricks.boundary);
  return bricks;
}

void turn_about(MeshFile& mesh, const Eigen::Matrix3d& by) {
  for (Vector3d& p : mesh.points) p = by * p;
}

SolidComparison compared(const MeshFile& mesh, const MeshFile& reference, double voxel_size = 0.0,
                         std::int64_t samples = 10'000) {
  RunContext context;
  return compare_solids(mesh, reference, {samples, voxel_size}, context);
}

OuterBoundary boundary_of(const MeshFile& mesh) {
  const MeshFile welded = welded_triangles(TriangleSoup(mesh));
  const TriangleSoup soup(welded);
  const TriangleTree tree(soup);
  const RunContext context;
  const Solid solid(soup, tree, Solid::Reading::by_any_rule, context);
  return outer_boundary(soup, tree, solid, context);
}

/// Two boxes that overlap by 10: one solid 10 × 10 × 60 of area 2600 and volume 6000, with two walls inside
/// and with sides that lie upon one another.
MeshFile overlapping_boxes() { return together(box({0, 0, 0}, {10, 10, 30}), box({0, 0, 20}, {10, 10, 60})); }

TEST(SolidComparison, ThreeSolidsAreNotTheOneThatTheirWallsLieIn) {
  const double gap = 0.005;
  const MeshFile three =
      together(together(box({0, 0, 0}, {10, 10, 20 - gap}), box({0, 0, 20 + gap}, {10, 10, 30 - gap})),
               box({0, 0, 30 + gap}, {10, 10, 60}));
  const MeshFile reference = overlapping_boxes();
  CheckOptions options;
  options.reference = &reference;
  RunContext context;
  const MeshReport r = check_mesh(three, options, context);
  EXPECT_TRUE(r.watertight());
  EXPECT_LE(r.to_reference->max, gap + 1e-12);  // which is why distances are blind to it
  ASSERT_TRUE(r.solid);
  EXPECT_EQ(r.solid->verdict, Verdict::differs);
  EXPECT_EQ(r.solid->mesh_components, 3);
  EXPECT_EQ(r.solid->reference_components, 1);
  EXPECT_NEAR(r.solid->mesh_area, 2600 + 400 - 160 * gap, 1e-6);
  EXPECT_NEAR(r.solid->reference_area, 2600, 1e-3 * 2600);
  // The four walls without a boundary strip of the width that is explained.
  EXPECT_GT(r.solid->false_area.value, 300);
  EXPECT_LE(r.solid->false_area.lower, 400);
  EXPECT_LE(r.solid->difference.lower, 200 * 2 * gap);
  EXPECT_GE(r.solid->difference.upper, 200 * 2 * gap);
  const auto sentences = r.sentences();
  EXPECT_TRUE(std::ranges::any_of(sentences, [](const std::string& s) {
    return s.find("does not bound the reference's solid") != std::string::npos &&
           s.find("3 components") != std::string::npos;
  }));
}

TEST(SolidComparison, TheOneSolidIsTheSame) {
  const SolidComparison c = compared(box({0, 0, 0}, {10, 10, 60}), overlapping_boxes());
  EXPECT_EQ(c.verdict, Verdict::same);
  EXPECT_EQ(c.difference.value, 0.0);
  EXPECT_EQ(c.unknown_volume.value, 0.0);
}

/// A box of two open halves and a wall between them, three polygons at each edge of the wall.
MeshFile turned_wall_in_two_halves() {
  MeshFile lower = box({0, 0, 0}, {10, 10, 10}), upper = box({0, 0, 10}, {10, 10, 20});
  const Quad wall = lower.quads[5];
  lower.quads.pop_back();
  upper.quads.erase(upper.quads.begin() + 4);
  lower.quads.push_back({wall[3], wall[2], wall[1], wall[0]});
  return welded(together(lower, upper));
}

TEST(OuterBoundary, OfSoupsThatHideWalls) {
  const auto expect = [](const MeshFile& soup, double area, std::int64_t components) {
    const OuterBoundary b = boundary_of(soup);
    EXPECT_NEAR(b.area, area, 2e-3 * area);
    EXPECT_LE(b.possible_area, 2e-3 * area);
    EXPECT_EQ(b.components, components);
  };
  expect(overlapping_boxes(), 2600, 1);
  expect(together(box({0, 0, 0}, {10, 10, 20}), box({0, 0, 20}, {10, 10, 60})), 2600, 1);  // stacked
  expect(together(box({0, 0, 0}, {10, 10, 20}), box({2, 2, 20}, {5, 5, 30})), 1000 + 4 * 30, 1);
  expect(together(box({0, 0, 0}, {10, 10, 20}), box({0, 0, 30}, {10, 10, 60})), 1000 + 1400, 2);
  expect(together(box({0, 0, 0}, {10, 10, 10}), box({2, 2, 2}, {5, 5, 5})), 600, 1);     // buried
  expect(together(box({0, 0, 0}, {10, 10, 10}), box({0, 0, 0}, {10, 10, 10})), 600, 1);  // twice
  expect(reversed(box({0, 0, 0}, {10, 10, 10})), 600, 1);
  expect(together(box({0, 0, 0}, {10, 10, 10}), reversed(box({20, 0, 0}, {30, 10, 10}))), 1200, 2);
  // A cross of two bars, 36 above and below and 40 long around.
  expect(together(box({0, 4, 4}, {10, 6, 6}), box({4, 0, 4}, {6, 10, 6})), 2 * 36 + 2 * 40, 1);
  // One wall across without a second side, on points of its own and on the box's.
  MeshFile wall = box({0, 0, 0}, {10, 10, 20});
  wall.points.insert(wall.points.end(), {{0, 0, 10}, {10, 0, 10}, {10, 10, 10}, {0, 10, 10}});
  wall.quads.push_back({8, 9, 10, 11});
  expect(wall, 1000, 1);
  expect(turned_wall_in_two_halves(), 1000, 1);
}

TEST(OuterBoundary, OfBricksIsTheirUnionsHoweverTheyAreTurned) {
  // In a rotated solid, coincident faces coincide only up to rounding.
  for (int seed = 0; seed < 16; ++seed) {
    std::mt19937 random{std::uint32_t(seed)};
    Bricks bricks = random_bricks(random, 1);
    const double exact = double(bricks.boundary.quads.size());
    if (seed % 2) {
      const Vector3d axis = Vector3d(1.0, 0.3 * seed, 2.0).normalized();
      turn_about(bricks.soup, Eigen::AngleAxisd(0.7 * seed, axis).toRotationMatrix());
    }
    const OuterBoundary b = boundary_of(bricks.soup);
    EXPECT_LE(b.area, exact * 1.004) << seed;
    EXPECT_GE(b.area + b.possible_area, exact * 0.996) << seed;
  }
}

TEST(OuterBoundary, AVoidsWallIsPossible) {
  const OuterBoundary b =
      boundary_of(together(box({0, 0, 0}, {10, 10, 10}), reversed(box({2, 2, 2}, {5, 5, 5}))));
  EXPECT_NEAR(b.area, 600, 1e-9);
  EXPECT_NEAR(b.possible_area, 54, 1e-9);
}

TEST(SolidComparison, AVoidMayBeKeptOrFilled) {
  const MeshFile soup = together(box({0, 0, 0}, {10, 10, 10}), reversed(box({2, 2, 2}, {8, 8, 8})));
  EXPECT_NE(compared(soup, soup).verdict, Verdict::differs);
  EXPECT_NE(compared(box({0, 0, 0}, {10, 10, 10}), soup).verdict, Verdict::differs);
  EXPECT_NEAR(compared(soup, soup).unknown_volume.value, 216, 15);
  EXPECT_EQ(compared(box({0, 0, 0}, {10, 10, 5}), soup, 0.1).verdict, Verdict::differs);
}

TEST(SolidComparison, SymmetricDifferenceOfAnalyticPairs) {
  const double ball = 4.0 / 3.0 * std::numbers::pi;
  const Vector3d o = Vector3d::Zero();
  // The facets of a globe of 48 rings leave out 3e-3 of the ball.
  const MeshFile sphere = globe(1.0, o, 48), half = globe(0.5, o, 48), cube = box({0, 0, 0}, {1, 1, 1});
  const auto expect = [](const MeshFile& a, const MeshFile& b, double exact, double facets = 0.0) {
    for (const SolidComparison& c : {compared(a, b), compared(b, a)}) {
      EXPECT_LE(c.difference.lower, exact + facets);
      EXPECT_GE(c.difference.upper, exact - facets);
      // Some six standard deviations of 10,000 samples.
      EXPECT_LE(c.difference.upper - c.difference.lower, 0.15 + 0.15 * exact);
      EXPECT_EQ(c.unknown_volume.value, 0.0);
    }
  };
  expect(cube, cube, 0.0);
  expect(cube, box({0.25, 0, 0}, {1.25, 1, 1}), 0.5);
  expect(cube, box({0.5, 0.5, 0.5}, {1.5, 1.5, 1.5}), 2.0 - 0.25);
  expect(cube, box({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}), 0.875);
  expect(cube, box({2, 0, 0}, {3, 1, 1}), 2.0);
  expect(sphere, half, ball * 0.875, 0.015);
  // The lens of two unit balls at distance 1 has volume 5π/12.
  expect(sphere, globe(1.0, {1, 0, 0}, 48), 2.0 * ball - 2.0 * 5.0 * std::numbers::pi / 12.0, 0.03);
  expect(sphere, box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}), ball - 1.0, 0.015);
  expect(sphere, box({-1, -1, -1}, {1, 1, 1}), 8.0 - ball, 0.015);
  // Half of the ball lies in a box that ends at its middle.
  expect(sphere, box({-1, -1, -1}, {1, 1, 0}), ball / 2.0 + (4.0 - ball / 2.0), 0.015);
  expect(overlapping_boxes(), box({0, 0, 0}, {10, 10, 50}), 1000);
}

TEST(SolidComparison, LostAndAddedPartsAreFound) {
  const MeshFile body = box({0, 0, 0}, {20, 10, 10});
  const MeshFile with_fin = together(body, box({1, 4.5, 10}, {18, 5.5, 18}));
  EXPECT_EQ(compared(body, with_fin).verdict, Verdict::differs);
  EXPECT_GT(compared(body, with_fin, 1.0).lost_area.lower, 0.0);
  EXPECT_EQ(compared(with_fin, body, 0.5).verdict, Verdict::differs);
  // A bubble that the reference does not have.
  const MeshFile bubble = together(body, reversed(box({4, 4, 4}, {6, 6, 6})));
  EXPECT_EQ(compared(bubble, body, 0.25).verdict, Verdict::differs);
  EXPECT_EQ(compared(body, body).verdict, Verdict::same);
}

TEST(SolidComparison, OneInOtherUnitsDiffers) {
  // Of the samples in space, none is in the smaller one.
  const MeshFile body = globe(1.0, {0, 0, 0}, 8);
  for (const double factor : {25.4, 1000.0})
    for (const double voxel : {0.0, 0.01}) {
      EXPECT_EQ(compared(globe(factor, {0, 0, 0}, 8), body, voxel).verdict, Verdict::differs);
      EXPECT_EQ(compared(body, globe(factor, {0, 0, 0}, 8), voxel).verdict, Verdict::differs);
    }
}

TEST(SolidComparison, WhatACoarseVolumeCutsOffIsExplained) {
  // A box whose edges are cut at 0.4 voxels of 0.5, as marching cubes cuts them.
  const double c = 0.2;
  MeshFile cut;
  std::vector<Eigen::Vector2d> profile = {{c, 0},       {10 - c, 0}, {10, c},     {10, 10 - c},
                                          {10 - c, 10}, {c, 10},     {0, 10 - c}, {0, c}};
  cut = extrusion(profile, 20.0);
  EXPECT_EQ(compared(cut, box({0, 0, 0}, {10, 10, 20})).verdict, Verdict::same);
  EXPECT_EQ(compared(cut, box({0, 0, 0}, {10, 10, 20}), 0.5).verdict, Verdict::same);
}

TEST(SolidComparison, NeverAFalseVerdictOnOpenOrUnorientedReferences) {
  const MeshFile cube = box({0, 0, 0}, {1, 1, 1});
  MeshFile open = cube, flipped = cube, both = cube;
  open.quads.pop_back();
  std::swap(flipped.quads[2][1], flipped.quads[2][3]);
  both.quads.pop_back();
  std::swap(both.quads[2][1], both.quads[2][3]);
  for (const MeshFile& reference : {open, flipped, both, reversed(cube), reversed(open)}) {
    EXPECT_NE(compared(cube, reference, 0.0, 4'000).verdict, Verdict::differs);
    EXPECT_NE(compared(cube, soup_of_triangles(reference), 0.0, 4'000).verdict, Verdict::differs);
  }
  // The mesh is closed, so parity determines the inside everywhere.
  EXPECT_EQ(compared(cube, flipped).verdict, Verdict::same);
  EXPECT_EQ(compared(cube, flipped).unknown_volume.value, 0.0);
  EXPECT_EQ(compared(box({0, 0, 0}, {1, 1, 0.5}), flipped, 0.02).verdict, Verdict::differs);
  // A sheet encloses nothing.
  MeshFile sheet;
  sheet.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0.1}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(compared(cube, sheet).verdict, Verdict::unknown);
  EXPECT_EQ(compared(cube, MeshFile{}).verdict, Verdict::unknown);
}

TEST(SolidComparison, AVoidBetweenPartsMayBeFilled) {
  // Six boards that enclose a room: its winding number is 0, but a flood fill counts it as inside.
  MeshFile boards = box({0, 0, 0}, {10, 10, 1});
  for (const auto& [lower, upper] : {std::pair<Vector3d, Vector3d>{{0, 0, 9}, {10, 10, 10}},
                                     {{0, 0, 1}, {1, 10, 9}},
                                     {{9, 0, 1}, {10, 10, 9}},
                                     {{1, 0, 1}, {9, 1, 9}},
                                     {{1, 9, 1}, {9, 10, 9}}})
    boards = together(boards, box(lower, upper));
  const MeshFile filled = box({0, 0, 0}, {10, 10, 10});
  const MeshFile room = together(filled, reversed(box({1, 1, 1}, {9, 9, 9})));
  EXPECT_NE(compared(filled, boards, 0.0, 4'000).verdict, Verdict::differs);
  EXPECT_NE(compared(room, boards, 0.0, 4'000).verdict, Verdict::differs);
}

TEST(FreeCells, TheFloodComesAroundAndNotInside) {
  const MeshFile mesh = together(box({0, 0, 0}, {10, 10, 10}), box({2, 2, 10}, {5, 5, 30}));
  const MeshFile welded = welded_triangles(TriangleSoup(mesh));
  const TriangleSoup soup(welded);
  const FreeCells cells{TriangleTree(soup)};
  for (const Vector3d& p : {Vector3d(-1, 5, 5), {5, 5, 31}, {8, 8, 20}, {6, 3, 29}, {1, 1, 12}}) {
    EXPECT_TRUE(cells.free(p)) << p.transpose();
    EXPECT_FALSE(cells.enclosed(p)) << p.transpose();
  }
  for (const Vector3d& p : {Vector3d(5, 5, 5), {3, 3, 20}, {1, 9, 1}}) {
    EXPECT_FALSE(cells.free(p)) << p.transpose();
    EXPECT_TRUE(cells.enclosed(p)) << p.transpose();
  }
  for (const Vector3d& p : {Vector3d(0, 5, 5), {5, 5, 10}, {2, 3, 29.9}}) {
    EXPECT_FALSE(cells.free(p)) << p.transpose();
    EXPECT_FALSE(cells.enclosed(p)) << p.transpose();
  }
}

TEST(SolidComparison, PiecesAreComparedWithoutTheirSeams) {
  // Two halves that share a seam, each point of it twice.
  const MeshFile halves = together(box({0, 0, 0}, {10, 10, 10}), box({0, 0, 10}, {10, 10, 20}));
  const MeshFile whole = box({0, 0, 0}, {10, 10, 20});
  RunContext context;
  const SolidOptions heap = {.samples = 10'000, .voxel_size = 0.5, .pieces = true};
  const SolidComparison c = compare_solids(halves, whole, heap, context);
  EXPECT_EQ(c.verdict, Verdict::same);
  EXPECT_NEAR(c.mesh_area, 1000, 2);
  EXPECT_EQ(c.difference.value, 0.0);
  EXPECT_EQ(compare_solids(box({0, 0, 0}, {10, 10, 10}), whole, heap, context).verdict, Verdict::differs);
}

TEST(SolidComparison, OfAThinPlateNoMoreSamplesAreTakenThanAskedFor) {
  const MeshFile plate = box({0, 0, 0}, {10, 10, 1e-3}), half = box({0, 0, 0}, {5, 10, 1e-3});
  const SolidComparison c = compared(half, plate);
  EXPECT_LE(c.difference.lower, 0.05);
  EXPECT_GE(c.difference.upper, 0.05);
  EXPECT_LE(c.difference.upper - c.difference.lower, 0.01);
  EXPECT_EQ(c.verdict, Verdict::differs);
}

TEST(SolidComparison, IsDeterministic) {
  const MeshFile a = globe(1.0, {0, 0, 0}, 12), b = globe(1.0, {0.3, 0, 0}, 12);
  const SolidComparison c = compared(a, b), d = compared(a, b);
  EXPECT_EQ(c.difference.value, d.difference.value);
  EXPECT_EQ(c.false_area.value, d.false_area.value);
  EXPECT_EQ(*c.unexplained_place, *d.unexplained_place);
}

/// A correct mesh of a reference: finer than the reference or coarser, with points off by a little,
/// of a soup or of a smooth surface, turned.
std::pair<MeshFile, MeshFile> good_pair(int number) {
  std::mt19937 random{std::uint32_t(number)};
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const auto less_than = [&](int n) { return int(random() % std::uint32_t(n)); };
  MeshFile mesh, reference;
  double off = 0.0;  // how far points of the mesh are moved
  if (number % 4 < 2) {
    Bricks bricks = random_bricks(random, 1 + less_than(3));
    mesh = std::move(bricks.boundary), reference = std::move(bricks.soup);
    off = number % 4 == 0 ? 0.0 : 0.02 * unit(random);
  } else if (number % 4 == 2) {
    mesh = globe(1.0, {0, 0, 0}, 8 + less_than(40));
    reference = globe(1.0, {0, 0, 0}, 8 + less_than(40));
    off = 0.002 * unit(random);
  } else {
    const int around = 12 + less_than(40), across = 8 + less_than(20);
    mesh = torus(around, across), reference = torus(around * (1 + less_than(3)), across * (1 + less_than(3)));
    off = 0.002 * unit(random);
  }
  for (Vector3d& p : mesh.points)
    p += off * Vector3d(unit(random) - 0.5, unit(random) - 0.5, unit(random) - 0.5);
  if (less_than(2)) {
    const Vector3d axis = Vector3d(unit(random) + 0.1, unit(random), unit(random)).normalized();
    const Eigen::Matrix3d by = Eigen::AngleAxisd(6.0 * unit(random), axis).toRotationMatrix();
    turn_about(mesh, by), turn_about(reference, by);
  }
  return {std::move(mesh), std::move(reference)};
}

void expect_no_alarm(int first, int last) {
  for (int number = first; number < last; ++number) {
    const auto [mesh, reference] = good_pair(number);
    EXPECT_EQ(compared(mesh, reference).verdict, Verdict::same) << number;
  }
}

TEST(SolidComparison, NoAlarmOnGoodMeshes) { expect_no_alarm(0, 8); }

TEST(Slow, NoFalseAlarmInFiveHundredGoodMeshes) {
  std::vector<int> alarms;
  for (int number = 0; number < 500; ++number) {
    const auto [mesh, reference] = good_pair(number);
    if (compared(mesh, reference).verdict != Verdict::same) alarms.push_back(number);
  }
  EXPECT_LE(alarms.size(), 1u) << testing::PrintToString(alarms);
}

}  // namespace solid_comparison_test
}  // namespace hermesh::validation
