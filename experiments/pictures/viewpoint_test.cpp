#include "experiments/pictures/viewpoint.h"

#include <gtest/gtest.h>

#include <array>

#include "experiments/pictures/ray_scene.h"

namespace hermesh {
namespace {

/// A wall in the plane x = 0 that faces +x, with ridges along y on its upper half, and behind it nothing.
PolygonMesh wall() {
  PolygonMesh mesh;
  mesh.origin = Eigen::Vector3d(5, 0, 0);
  constexpr int kSteps = 40;
  for (int j = 0; j <= kSteps; ++j)
    for (int i = 0; i <= kSteps; ++i)
      mesh.points.emplace_back(j > kSteps / 2 && i % 2 == 1 ? 0.1f : 0.0f, 0.1f * float(j), -0.1f * float(i));
  const auto at = [](int i, int j) { return std::uint32_t(j * (kSteps + 1) + i); };
  for (int j = 0; j < kSteps; ++j)
    for (int i = 0; i < kSteps; ++i)
      mesh.quads.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
  return mesh;
}

TEST(Viewpoint, LooksAtTheSideWithTheMostSurface) {
  PolygonMesh mesh;
  const auto board = [&](std::array<Eigen::Vector3f, 4> corners) {
    const auto first = static_cast<std::uint32_t>(mesh.points.size());
    mesh.points.insert(mesh.points.end(), corners.begin(), corners.end());
    mesh.quads.push_back({first, first + 1, first + 2, first + 3});
  };
  using V = Eigen::Vector3f;
  // Nine low boards in planes of x, which are edges if seen along z.
  for (int i = 0; i < 9; ++i) {
    const float x = 0.5f * float(i);
    board({V(x, 0, 0), V(x, 0, 0.2f), V(x, 1, 0.2f), V(x, 1, 0)});
  }
  // A tall board before them all, at z = 0.4, hides them from +z.
  board({V(-1, 0, 0.4f), V(5, 0, 0.4f), V(5, 4, 0.4f), V(-1, 4, 0.4f)});
  RunContext context;
  const Viewpoint viewpoint = open_viewpoint(mesh, context);
  const Camera camera = make_camera(viewpoint.azimuth, viewpoint.elevation);
  // From behind, where boards and the tall board are both seen.
  EXPECT_LT(camera.towards.z(), 0.0) << viewpoint.azimuth;
}

TEST(Viewpoint, OfAnEmptyMeshIsTheDefault) {
  RunContext context;
  EXPECT_EQ(open_viewpoint({}, context).azimuth, Viewpoint{}.azimuth);
}

TEST(CloseUp, IsWhereTheSurfaceTurns) {
  const PolygonMesh mesh = wall();
  RunContext context;
  const CloseUp close_up = busy_close_up(mesh, bounds(mesh), {.azimuth = 80, .elevation = 10}, 0.2, context);
  EXPECT_GT(close_up.centre[1], 0.5);
  EXPECT_LE(close_up.centre[1], 1.0);
  EXPECT_EQ(close_up.size, 0.2);
}

TEST(CloseUp, ShowsAFaceInTheShadowOfAnotherBrightly) {
  // Beneath a roof, where the key light from above does not come, a wall of fine polygons, drawn with edges.
  PolygonMesh mesh = wall();
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  for (const auto& [x, z] :
       {std::pair(-1.0f, 1.0f), std::pair(3.0f, 1.0f), std::pair(3.0f, -5.0f), std::pair(-1.0f, -5.0f)})
    mesh.points.emplace_back(x, 4.2f, z);
  mesh.quads.push_back({first, first + 1, first + 2, first + 3});
  RunContext context;
  const View view{.centre = {5, 1, -2},
                  .world_width = 3,
                  .width = 200,
                  .height = 80,
                  .edges = true,
                  .occlusion_radius = 0.5};
  const Image image = RayScene(mesh).render(make_camera(90, 0), view, context);
  double sum = 0.0;
  for (const std::uint32_t pixel : image.pixels)
    sum += (pixel >> 16 & 0xff) + (pixel >> 8 & 0xff) + (pixel & 0xff);
  EXPECT_GT(sum / (3.0 * double(image.pixels.size())), 110.0);
}

}  // namespace
}  // namespace hermesh
