#include "algorithms/extraction/certified_octree/loose_polygons.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace hermesh {
namespace loose_polygons_test {

using Eigen::Vector3d;
using Indices = std::vector<std::size_t>;

/// A polygon of a mesh by its index: quads and triangles are numbered separately.
struct Which {
  std::size_t number;
  bool is_quad;
};
const Which kFirstTriangle{0, false}, kSecondTriangle{1, false}, kFirstQuad{0, true};

struct Mesh {
  std::vector<Vector3d> points;
  std::vector<Quad> quads;
  std::vector<Triangle> triangles;

  NamedPolygon polygon(const Which& which, const std::vector<std::uint32_t>& settled) const {
    NamedPolygon result{2 * which.number + which.is_quad, which.is_quad ? 4 : 3, {}, {}, 0};
    if (which.is_quad)
      result.names = quads[which.number];
    else
      std::ranges::copy(triangles[which.number], result.names.begin());
    for (std::size_t i = 0; i < static_cast<std::size_t>(result.corners); ++i) {
      result.points[i] = points[result.names[i]];
      if (std::ranges::count(settled, result.names[i])) result.settled |= 1u << i;
    }
    return result;
  }
  Indices that_meet(const std::vector<Which>& tested, const std::vector<std::uint32_t>& settled = {}) const {
    LargeArray<NamedPolygon> polygons;
    for (const Which& which : tested) polygons.push_back(polygon(which, settled));
    LoosePolygons loose(polygons, RunContext{});
    std::vector<NamedPolygon> all;
    for (std::size_t i = 0; i < quads.size(); ++i) all.push_back(polygon({i, true}, settled));
    for (std::size_t i = 0; i < triangles.size(); ++i) all.push_back(polygon({i, false}, settled));
    loose.test_against(all);
    return loose.that_meet();
  }
};

Mesh two_triangles(double second_is_raised_by) {
  const Vector3d up(0, 0, second_is_raised_by);
  return {{{0, 0, 0},
           {4, 0, 0},
           {0, 4, 0},
           Vector3d(1, 1, -1) + up,
           Vector3d(1, 1, 1) + up,
           Vector3d(9, 9, 1) + up},
          {},
          {{0, 1, 2}, {3, 4, 5}}};
}

TEST(LoosePolygons, MeetWhatPassesThroughThem) {
  EXPECT_EQ(two_triangles(0).that_meet({kFirstTriangle}), Indices{0});
  EXPECT_EQ(two_triangles(0).that_meet({kSecondTriangle}), Indices{0});
  EXPECT_EQ(two_triangles(0).that_meet({kFirstTriangle, kSecondTriangle}), (Indices{0, 1}));
  EXPECT_EQ(two_triangles(0).that_meet({}), Indices{});
  EXPECT_EQ(two_triangles(1.5).that_meet({kFirstTriangle, kSecondTriangle}), Indices{});
}

/// Polygons whose boxes share only one cube of the lattice that the search uses.
TEST(LoosePolygons, MeetAcrossTheLattice) {
  Mesh mesh{{{-30, 0.5, 0.5}, {30, 0.5, 0.5}, {30, 1, 0.5}, {20.5, -20, 0}, {20.5, 20, 0}, {20.5, 0, 3}},
            {},
            {{0, 1, 2}, {3, 4, 5}}};
  EXPECT_EQ(mesh.that_meet({kFirstTriangle}), Indices{0});
  mesh.points[5].z() = 0.2;
  EXPECT_EQ(mesh.that_meet({kFirstTriangle}), Indices{});
}

TEST(LoosePolygons, MayShareAnEdgeOrACorner) {
  Mesh mesh{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {4, 4, 0}, {-4, -1, 0}, {-1, -4, 0}},
            {},
            {{0, 1, 2}, {1, 3, 2}, {0, 4, 5}}};
  EXPECT_EQ(mesh.that_meet({kFirstTriangle}), Indices{});
  mesh.points[3] = {0.5, 0.5, 0};  // folded back
  EXPECT_EQ(mesh.that_meet({kFirstTriangle}), Indices{0});
}

TEST(LoosePolygons, MeetWhatHasTheSameCorners) {
  Mesh mesh{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {}, {{0, 1, 2}, {0, 1, 2}}};
  EXPECT_EQ(mesh.that_meet({kSecondTriangle}), Indices{0});
}

TEST(LoosePolygons, MeetThemselvesWhereTheyAreFolded) {
  Mesh mesh{{{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}}, {{0, 1, 2, 3}}, {}};
  EXPECT_EQ(mesh.that_meet({kFirstQuad}), Indices{});
  mesh.points[3] = {3, 1, 0};  // on the same side of the diagonal as the second corner
  EXPECT_EQ(mesh.that_meet({kFirstQuad}), Indices{0});
}

/// Two quads, tilted against one another, with a common diagonal: four triangles at one edge, no two of which
/// intersect.
TEST(LoosePolygons, HaveDiagonalsOfTheirOwn) {
  Mesh mesh{{{0, 0, 0}, {4, 0, 1}, {4, 4, 0}, {0, 4, 1}, {4, 0, -3}, {0, 4, -3}}, {{0, 1, 2, 3}}, {}};
  EXPECT_EQ(mesh.that_meet({kFirstQuad}), Indices{});
  mesh.quads.push_back({2, 5, 0, 4});
  EXPECT_EQ(mesh.that_meet({kFirstQuad}), Indices{0});
  mesh.quads.back() = {5, 0, 4,
                       2};  // cut along the other diagonal, which the sides of the first quad do not touch
  EXPECT_EQ(mesh.that_meet({kFirstQuad}), Indices{});
  mesh.triangles.push_back({0, 2, 5});
  EXPECT_EQ(mesh.that_meet({kFirstQuad}), Indices{0});
}

/// Nothing is tested around a settled corner, but all other positions are.
TEST(LoosePolygons, NeedNoTestAroundSettledCorners) {
  Mesh mesh{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {4, 4, 0}, {1, 1, 0}},
            {{0, 1, 3, 2}},
            {{0, 1, 4}, {1, 4, 3}}};  // both within the quad
  EXPECT_EQ(mesh.that_meet({kFirstQuad}, {0}), Indices{0});
  EXPECT_EQ(mesh.that_meet({kFirstQuad}, {0, 3}), Indices{});
  mesh.points[4] = {1, 1, 5};
  mesh.triangles[0] = {4, 2, 1};  // passes through both
  EXPECT_EQ(mesh.that_meet({kFirstQuad}, {0}), Indices{0});
}

}  // namespace loose_polygons_test
}  // namespace hermesh
