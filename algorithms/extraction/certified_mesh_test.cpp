#include "algorithms/extraction/certified_mesh.h"

#include <gtest/gtest.h>

namespace hermesh {
namespace certified_mesh_test {

PolygonMesh finished_quad(const std::vector<Eigen::Vector3d>& points) {
  RunContext context;
  const IndexToWorld placement;
  CertifiedPolygons polygons{points, {}, {}, {}};
  polygons.quads.push_back({0, 1, 2, 3});
  return finished(std::move(polygons), FieldAtPoints(nullptr, placement), FilePoints(placement), context);
}

// The corner d lies within abc: cut along a–c, as was proved, the quad covers all of abc and, folded back,
// acd; a reader that treats it as a plane polygon omits acd.
TEST(CertifiedMesh, AQuadThatOthersCutOtherwiseIsWrittenAsItsTriangles) {
  for (const double bend : {0.0, 1e-7, -1e-7, 1e-6}) {
    const PolygonMesh mesh = finished_quad({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.3, bend}});
    EXPECT_TRUE(mesh.quads.empty()) << bend;
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}})) << bend;
  }
}

TEST(CertifiedMesh, AQuadThatMeansOneSurfaceStaysAQuad) {
  const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0), within(0.3, 0.3, 0);
  const std::vector<std::vector<Eigen::Vector3d>> quads = {
      {a, b, c, {-0.5, 0.5, 0}},    // convex
      {within, a, b, c},            // concave, and cut within itself
      {a, b, c, {0, 0.5, 0}},       // of three corners in a row
      {a, b, c, {0.3, 0.3, 0.1}}};  // folded, but not plane for any reader
  for (const std::vector<Eigen::Vector3d>& points : quads) {
    const PolygonMesh mesh = finished_quad(points);
    EXPECT_EQ(mesh.quads.size(), 1u) << points[3].transpose();
    EXPECT_TRUE(mesh.triangles.empty()) << points[3].transpose();
  }
}

}  // namespace certified_mesh_test
}  // namespace hermesh
