#include "algorithms/voxelization/inside/wall_walk.h"

#include <gtest/gtest.h>

#include "algorithms/core/run_context.h"

namespace hermesh {
namespace wall_walk_test {

using Eigen::Vector3d;

/// Twelve triangles around [-2.4, 2.4]³, the last two at the top.
PolygonMesh box() {
  PolygonMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.points.push_back({i & 1 ? 2.4f : -2.4f, i & 2 ? 2.4f : -2.4f, i & 4 ? 2.4f : -2.4f});
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

bool is_inside(const Vector3d& p) { return p.cwiseAbs().maxCoeff() < 2.4; }

/// Returns the points of a walk that begins where the segment intersects the mesh.
std::vector<Vector3d> walk(const PolygonMesh& mesh, const Vector3d& from, const Vector3d& way) {
  RunContext context;
  const IndexSoup soup(mesh, 1.0);
  const TriangleBins bins(soup, 3.0, context);
  CellObstacles obstacles(soup, bins);
  WallWalk walk(soup, obstacles);
  walk.begin(from, way);
  std::vector<Vector3d> places;
  while (const std::optional<Vector3d> at = walk.next()) places.push_back(*at);
  return places;
}

TEST(WallWalk, GoesOnceOverOneSideOfAllTriangles) {
  for (const bool inside : {false, true}) {
    const std::vector<Vector3d> places =
        walk(box(), {0.3, 0.2, inside ? 2.0 : 3.0}, {0, 0, inside ? 1.0 : -1.0});
    EXPECT_EQ(places.size(), 12u);
    for (const Vector3d& at : places) EXPECT_EQ(is_inside(at), inside) << at.transpose();
  }
}

TEST(WallWalk, DoesNotGoAroundTheBorderOfAHole) {
  PolygonMesh open = box();
  open.triangles.resize(10);
  const std::vector<Vector3d> places = walk(open, {0.3, 0.2, -3.0}, {0, 0, 1});
  EXPECT_EQ(places.size(), 10u);
  for (const Vector3d& at : places) EXPECT_FALSE(is_inside(at)) << at.transpose();
}

TEST(WallWalk, WindingCopiesAndTrianglesWithoutAreaDoNotMatter) {
  PolygonMesh mesh = box();
  for (std::size_t i = 0; i < 12; i += 2) std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
  mesh.triangles.push_back(mesh.triangles[5]);
  mesh.points.push_back({0, -2.4f, -2.4f});  // on the edge from 0 to 1
  mesh.triangles.push_back({0, 1, 8});
  mesh.triangles.push_back({0, 1, 1});
  const std::vector<Vector3d> places = walk(mesh, {0.3, 0.2, 3.0}, {0, 0, -1});
  EXPECT_GE(places.size(), 12u);
  EXPECT_LE(places.size(), 13u);  // a copy may be visited in addition to its original
  for (const Vector3d& at : places) EXPECT_FALSE(is_inside(at)) << at.transpose();
}

TEST(WallWalk, CrossesToTheOppositeWall) {
  PolygonMesh mesh = box();
  const PolygonMesh other = box();
  for (const Eigen::Vector3f& p : other.points) mesh.points.push_back(p + Eigen::Vector3f(4.9f, 0, 0));
  for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + 8, t[1] + 8, t[2] + 8});
  EXPECT_EQ(walk(mesh, {0.3, 0.2, 3.0}, {0, 0, -1}).size(), 24u);
}

}  // namespace wall_walk_test
}  // namespace hermesh
