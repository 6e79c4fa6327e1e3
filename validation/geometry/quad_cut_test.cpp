#include "validation/geometry/quad_cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "validation/geometry/test_meshes.h"
#include "validation/geometry/triangle_soup.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {
namespace quad_cut_test {

using namespace test;

constexpr QuadRule kRules[] = {QuadRule::as_given, QuadRule::better};

/// A prism of height 1 over the quad (2,0), (1/2,1/2), (0,2), (0,0), which is concave at its second corner:
/// base 1, walls √(5/2) twice and 2 twice. Every polygon starts `turn` corners later.
MeshFile dart_prism(int turn) {
  MeshFile mesh;
  for (const double z : {0.0, 1.0})
    for (const Eigen::Vector2d& p : {Eigen::Vector2d(2, 0), {0.5, 0.5}, {0, 2}, {0, 0}})
      mesh.points.emplace_back(p.x(), p.y(), z);
  mesh.quads = {{3, 2, 1, 0}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  for (Quad& q : mesh.quads) std::rotate(q.begin(), q.begin() + turn, q.end());
  return mesh;
}

TEST(QuadCut, VerdictOnAConcaveQuadDoesNotDependOnWhereItStarts) {
  for (int turn = 0; turn < 4; ++turn) {
    RunContext context;
    const MeshReport r = check_mesh(dart_prism(turn), {}, context);
    EXPECT_NEAR(r.area, 2.0 + 2.0 * std::sqrt(2.5) + 4.0, 1e-12) << turn;
    EXPECT_NEAR(r.volume, 1.0, 1e-12) << turn;
    EXPECT_EQ(r.self_intersections->pairs, 0) << turn;
    EXPECT_TRUE(r.watertight()) << turn;
    for (const LibraryCounts& l : r.libraries) {
      EXPECT_TRUE(l.disagreements.empty()) << l.library << turn;
      EXPECT_NEAR(l.area, r.area, 1e-12) << l.library << turn;
      EXPECT_NEAR(l.volume, 1.0, 1e-12) << l.library << turn;
    }
  }
}

TEST(QuadCut, ACornerInLineWithItsNeighboursMakesNoDegenerateTriangle) {
  for (int turn = 0; turn < 4; ++turn) {
    MeshFile mesh;
    mesh.points = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 2, 0}};
    mesh.quads = {{0, 1, 2, 3}};
    std::rotate(mesh.quads[0].begin(), mesh.quads[0].begin() + turn, mesh.quads[0].end());
    RunContext context;
    const MeshReport r = check_mesh(mesh, {}, context);
    EXPECT_EQ(r.degenerate_polygons, 0) << turn;
    EXPECT_NEAR(r.area, 2.0, 1e-12) << turn;
  }
}

TEST(QuadCut, OfABentQuadTheJudgedMeshSaysWhichSurfaceItIs) {
  // Two opposite corners are raised: along one diagonal a ridge, along the other one a valley.
  const std::vector<Eigen::Vector3d> points = {{0, 0, 0.25}, {1, 0, 0}, {1, 1, 0.25}, {0, 1, 0}};
  EXPECT_FALSE(cut_along_other(points, {0, 1, 2, 3}, QuadRule::as_given));
  EXPECT_FALSE(cut_along_other(points, {1, 2, 3, 0}, QuadRule::as_given));
}

TEST(QuadCut, ABentConcaveQuadIsCutAsItsMakerSays) {
  // Folded by a tenth: its two cuts are two surfaces, of which a proof may have looked at one.
  const std::vector<Eigen::Vector3d> points = {{2, 0, 0.1}, {0.5, 0.5, 0}, {0, 2, 0.1}, {0, 0, 0}};
  for (const Quad& q : {Quad{0, 1, 2, 3}, Quad{1, 2, 3, 0}})
    EXPECT_FALSE(cut_along_other(points, q, QuadRule::as_given));
  EXPECT_TRUE(cut_along_other(points, {0, 1, 2, 3}, QuadRule::better));
  std::vector<Eigen::Vector3d> rounded = points;
  for (Eigen::Vector3d& p : rounded) p.z() *= 1e-4;
  EXPECT_TRUE(cut_along_other(rounded, {0, 1, 2, 3}, QuadRule::as_given));
  EXPECT_FALSE(cut_along_other(rounded, {1, 2, 3, 0}, QuadRule::as_given));
}

TEST(QuadCut, OfAReferenceTheOrderOfCornersMeansNothing) {
  const std::vector<Eigen::Vector3d> lists[] = {
      {{0, 0, 0.25}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}},   // bends less across one diagonal
      {{0, 0, 0}, {2, 0, 0}, {2.5, 1, 0}, {0.5, 1, 0}},  // plane: the shorter one
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};     // a square: the lowest number
  for (const auto& points : lists) {
    const auto ends = [&](const Quad& q) {
      const Quad cut = cut_from_first(points, q, QuadRule::better);
      return std::pair(std::min(cut[0], cut[2]), std::max(cut[0], cut[2]));
    };
    const auto first = ends({0, 1, 2, 3});
    for (const Quad& q : {Quad{1, 2, 3, 0}, Quad{2, 3, 0, 1}, Quad{3, 0, 1, 2}, Quad{3, 2, 1, 0}})
      EXPECT_EQ(ends(q), first);
  }
}

TEST(QuadCut, TheHalvesAreThoseOfTheWhole) {
  const MeshFile mesh = dart_prism(0);
  for (const QuadRule rule : kRules) {
    const TriangleSoup soup(mesh, rule);
    ASSERT_EQ(soup.triangles.size(), 12u);
    for (std::size_t t = 0; t < 12; ++t) EXPECT_EQ(soup.polygon(t), std::int64_t(t / 2));
  }
}

}  // namespace quad_cut_test
}  // namespace hermesh::validation
