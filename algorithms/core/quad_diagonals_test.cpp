#include "algorithms/core/quad_diagonals.h"

#include <gtest/gtest.h>

namespace hermesh {
namespace quad_diagonals_test {

/// Returns a mesh with the single quad 0 1 2 3.
PolygonMesh quad(const std::vector<Eigen::Vector3f>& points) {
  PolygonMesh mesh;
  mesh.points = points;
  mesh.quads = {{0, 1, 2, 3}};
  return mesh;
}

Quad chosen(const std::vector<Eigen::Vector3f>& points) {
  PolygonMesh mesh = quad(points);
  choose_diagonals(mesh);
  return mesh.quads[0];
}

const Quad kAlong02{0, 1, 2, 3}, kAlong13{1, 2, 3, 0};

TEST(QuadDiagonals, ConcaveQuadIsCutInside) {
  // An arrow head with its notch at corner 2: the diagonal 1–3 lies outside of it.
  EXPECT_EQ(chosen({{0, 0, 0}, {4, -1, 0}, {1, 1, 0}, {-1, 4, 0}}), kAlong02);
  // The notch at corner 1, and the inner diagonal the longer one.
  EXPECT_EQ(chosen({{-1, 4, 0}, {3, 3, 0}, {4, -1, 0}, {9, 9, 0}}), kAlong13);
  // Seen from behind.
  EXPECT_EQ(chosen({{9, 9, 0}, {4, -1, 0}, {3, 3, 0}, {-1, 4, 0}}), kAlong02);
}

TEST(QuadDiagonals, PlanarConvexQuadIsCutAlongTheShorterDiagonal) {
  EXPECT_EQ(chosen({{0, 0, 0}, {2, -1, 0}, {4, 0, 0}, {2, 1, 0}}), kAlong13);
  EXPECT_EQ(chosen({{2, 1, 0}, {0, 0, 0}, {2, -1, 0}, {4, 0, 0}}), kAlong02);
}

TEST(QuadDiagonals, BentQuadIsCutWhereItBendsLess) {
  // Two halves in the planes of a roof whose ridge is 0–2, the longer diagonal: along 1–3 it would be a
  // valley that bends more. Along the ridge the normals are (0, ∓1, 3), cosine (9 − 1) / 10 = 0.8; across it
  // they are (∓1, 0, 1) · 3 / 2 and so on, cosine 0.
  const std::vector<Eigen::Vector3f> roof = {{-1, 0, 1}, {0, -3, 0}, {1, 0, 1}, {0, 3, 0}};
  EXPECT_EQ(chosen(roof), kAlong02);
  EXPECT_EQ(chosen({roof[1], roof[2], roof[3], roof[0]}), kAlong13);
}

TEST(QuadDiagonals, ATieGoesToTheLowestPointWhereverTheFileStarts) {
  PolygonMesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.quads = {{0, 1, 2, 3}, {1, 2, 3, 0}, {2, 3, 0, 1}, {3, 0, 1, 2}};
  choose_diagonals(mesh);
  EXPECT_EQ(mesh.quads, (LargeArray<Quad>{{0, 1, 2, 3}, {2, 3, 0, 1}, {2, 3, 0, 1}, {0, 1, 2, 3}}));
}

TEST(QuadDiagonals, HalfWithoutAreaIsAvoided) {
  // Corner 1 lies on the side from 0 to 2: cut along 0–2, one half would be a line.
  EXPECT_EQ(chosen({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 5, 0}}), kAlong13);
}

TEST(QuadDiagonals, AttributesOfCornersTurnAlong) {
  PolygonMesh mesh = quad({{0, 0, 0}, {2, -1, 0}, {4, 0, 0}, {2, 1, 0}});
  mesh.points.push_back({0, 0, 9});
  mesh.triangles = {{0, 1, 4}};
  mesh.attributes.resize(2);
  mesh.attributes[0].name = "uv";
  mesh.attributes[0].domain = AttributeDomain::corner;
  mesh.attributes[0].components = 2;
  mesh.attributes[0].values = std::vector<float>{90, 91, 92, 93, 94, 95, 0, 0.5f, 1, 1.5f, 2, 2.5f, 3, 3.5f};
  mesh.attributes[1].name = "part";
  mesh.attributes[1].domain = AttributeDomain::polygon;
  mesh.attributes[1].values = std::vector<std::int32_t>{7, 8};
  choose_diagonals(mesh);
  EXPECT_EQ(mesh.quads[0], kAlong13);
  EXPECT_EQ(std::get<std::vector<float>>(mesh.attributes[0].values),
            (std::vector<float>{90, 91, 92, 93, 94, 95, 1, 1.5f, 2, 2.5f, 3, 3.5f, 0, 0.5f}));
  EXPECT_EQ(std::get<std::vector<std::int32_t>>(mesh.attributes[1].values),
            (std::vector<std::int32_t>{7, 8}));
}

}  // namespace quad_diagonals_test
}  // namespace hermesh
