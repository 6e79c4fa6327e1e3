#include "algorithms/search/transfer_attributes.h"

#include <gtest/gtest.h>

#include "algorithms/remesh/remesh.h"
#include "algorithms/variants.h"
#include "algorithms/voxelization/voxelize_for_tests.h"

namespace hermesh {
namespace transfer_attributes_test {

using Eigen::Vector3d;
using voxelize_for_tests::box;
using voxelize_for_tests::sphere;

PolygonMesh remeshed(const PolygonMesh& mesh, double voxel_size) {
  RunContext context;
  PolygonMesh made = remesh(mesh, {.chosen = choose(our_voxelizers(), "hermesh"), .voxel_size = voxel_size},
                            {.chosen = choose(our_extractors(), "manifold-dual-contouring")}, context)
                         .mesh;
  SourceAttributes(mesh, voxel_size).add_to(made, context);
  return made;
}

TEST(TransferAttributes, ColoursOfASphereAreThoseOfThePosition) {
  PolygonMesh ball = sphere(Vector3d(3, 0, 0), 1.0, 64);
  std::vector<float> colours;
  const auto colour = [&](const Vector3d& p) {
    return Vector3d((0.5 * (p - Vector3d(2, -1, -1))).cwiseMax(0));
  };
  for (std::size_t p = 0; p < ball.points.size(); ++p)
    for (const double value : colour(ball.world(p))) colours.push_back(float(value));
  ball.attributes = {{"colour", AttributeDomain::point, 3, colours, {}}};
  const PolygonMesh made = remeshed(ball, 0.05);
  ASSERT_EQ(made.attributes.size(), 1u);
  const auto& values = std::get<0>(made.attributes[0].values);
  for (std::size_t p = 0; p < made.points.size(); ++p)
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(values[3 * p + k], colour(made.world(p))[k], 2.0 / 255.0);
}

/// Each face of the cube has the whole square of texture coordinates, so every edge is a seam.
TEST(TransferAttributes, TextureCoordinatesAreCutAtSeams) {
  PolygonMesh cube = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1));
  std::vector<float> uv;
  std::vector<std::int32_t> material;
  for (std::size_t q = 0; q < cube.quads.size(); ++q) {
    uv.insert(uv.end(), {0, 0, 1, 0, 1, 1, 0, 1});
    material.push_back(std::int32_t(q));
  }
  cube.attributes = {{"uv", AttributeDomain::corner, 2, uv, {}},
                     {"material", AttributeDomain::polygon, 1, material, {"a", "b", "c", "d", "e", "f"}}};
  const PolygonMesh made = remeshed(cube, 0.11);
  ASSERT_EQ(made.attributes.size(), 2u);
  EXPECT_EQ(made.attributes[1].labels, cube.attributes[1].labels);
  const auto& own = std::get<0>(made.attributes[0].values);
  const auto& faces = std::get<1>(made.attributes[1].values);
  for (std::size_t t = 0; t < made.triangles.size(); ++t) {
    const Quad& q = cube.quads[std::size_t(faces[t])];
    const Vector3d first = cube.world(q[0]), u = cube.world(q[1]) - first, v = cube.world(q[3]) - first;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vector3d p = made.world(made.triangles[t][c]) - first;
      EXPECT_NEAR(own[6 * t + 2 * c], p.dot(u), 1e-3);
      EXPECT_NEAR(own[6 * t + 2 * c + 1], p.dot(v), 1e-3);
      EXPECT_NEAR(p.dot(u.cross(v)), 0.0, 1e-3) << "a triangle of face " << faces[t];
    }
  }
}

TEST(TransferAttributes, JoinedMeshesHaveTheAttributesOfBoth) {
  PolygonMesh a = box(Vector3d(0, 0, 0), Vector3d(1, 1, 1)), b = box(Vector3d(2, 0, 0), Vector3d(3, 1, 1));
  b.triangles.push_back({0, 1, 2});
  a.attributes = {
      {"material", AttributeDomain::polygon, 1, std::vector<std::int32_t>{0, 0, 0, 1, 1, 1}, {"a", "b"}}};
  b.attributes = {
      {"material", AttributeDomain::polygon, 1, std::vector<std::int32_t>{0, 0, 0, 0, 0, 0, -1}, {"c"}},
      {"w", AttributeDomain::point, 1, std::vector<float>(8, 5.0f), {}}};
  const PolygonMesh both = joined(a, b);
  EXPECT_EQ(both.points.size(), 16u);
  EXPECT_EQ(both.triangles, (std::vector<Triangle>{{8, 9, 10}}));
  // The triangle of the second, the quads of the first, those of the second.
  EXPECT_EQ(std::get<1>(both.attributes[0].values),
            (std::vector<std::int32_t>{2, 0, 0, 0, 1, 1, 1, 2, 2, 2, 2, 2, -1}));
  EXPECT_EQ(both.attributes[0].labels, (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_EQ(std::get<0>(both.attributes[1].values)[7], 0.0f);
  EXPECT_EQ(std::get<0>(both.attributes[1].values)[8], 5.0f);
}

}  // namespace transfer_attributes_test
}  // namespace hermesh
