#include "validation/geometry/triangle_cover.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "validation/geometry/test_meshes.h"
#include "validation/hausdorff.h"

namespace hermesh::validation {
namespace {

using namespace test;

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

void expect_brackets(const MeshFile& from, const MeshFile& to, double truth, double gap) {
  RunContext context;
  const HausdorffBound b =
      certified_distance(TriangleSoup(from), TriangleTree(TriangleSoup(to)), gap, context);
  EXPECT_LE(b.lower, truth);
  EXPECT_GE(b.upper, truth);
  EXPECT_LE(b.upper - b.lower, gap + 4e-7);  // widened by 1e-7 of a diagonal of √2 on both sides
}

// Two large triangles over 7442 small ones, at most a thousandth of a cell's width away. Halving alone goes
// down to that size along all sides of the cells, which takes half a minute. The greatest distance is that of
// the raised side of the tilted square, whose foot is the side of the flat one. (The number of cells is odd,
// or halving would run along their sides.)
TEST(TriangleCover, LargeTrianglesOverSmallOnes) {
  const double height = 1.0 / 65536, gap = 1.0 / 524288;
  const MeshFile flat = sheet(61, [](double, double) { return 0.0; });
  const MeshFile tilted = sheet(1, [&](double x, double) { return height * x; });
  expect_brackets(tilted, flat, height, gap);
  // The other way it is that of the same place to the tilted plane, and its foot is within the square.
  expect_brackets(flat, tilted, height / std::sqrt(1.0 + height * height), gap);
}

// The plane z = 0 over a roof with the ridge at x = 1/2: at u from the ridge the distance to the plane z =
// −u/8 is u/8 / √(1 + 1/64), and greatest at u = 1/2.
TEST(TriangleCover, OverARidge) {
  const MeshFile plane = sheet(1, [](double, double) { return 0.0; });
  const MeshFile roof = sheet(46, [](double x, double) { return -0.125 * std::abs(x - 0.5); });
  expect_brackets(plane, roof, 0.0625 / std::sqrt(1.0 + 1.0 / 64), 1e-5);
}

// A hole in the fine sheet has to be found: 2 × 2 of its cells are missing, and the middle of the hole is as
// far from the others as a cell is wide.
TEST(TriangleCover, OverAHole) {
  MeshFile fine = sheet(40, [](double, double) { return 0.0; });
  const std::size_t corner = 20 * 40 + 20;
  for (const std::size_t cell : {corner + 41, corner + 40, corner + 1, corner})
    fine.quads.erase(fine.quads.begin() + std::ptrdiff_t(cell));
  expect_brackets(sheet(1, [](double, double) { return 0.0; }), fine, 1.0 / 40, 1e-5);
}

// Whatever is found, no point of the piece is farther from the surface.
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

}  // namespace
}  // namespace hermesh::validation
