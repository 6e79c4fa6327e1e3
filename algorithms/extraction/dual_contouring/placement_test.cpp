// Positions of vertices: volumes within curved surfaces, and polyhedra, whose planes vertices must lie on
// (qef.h).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/hermite/samplers.h"

namespace hermesh {
namespace placement_test {

using Eigen::Vector3d;
using Placement = DualContouringOptions::Placement;

/// Six times the volume that a closed mesh encloses.
double six_volumes(const PolygonMesh& mesh) {
  double sum = 0;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    sum +=
        mesh.points[a].cast<double>().dot(mesh.points[b].cast<double>().cross(mesh.points[c].cast<double>()));
  };
  for (const Quad& q : mesh.quads) add(q[0], q[1], q[2]), add(q[0], q[2], q[3]);
  return sum;
}

struct Shape {
  AnalyticSurface surface;
  double volume;
};

Shape sphere(double radius, const Vector3d& centre) {
  return {{.value = [=](const Vector3d& x) { return (x - centre).norm() - radius; },
           .gradient = [=](const Vector3d& x) -> Vector3d { return x - centre; }},
          4.0 / 3.0 * M_PI * std::pow(radius, 3)};
}

/// About the z axis.
Shape torus(double major, double minor, const Vector3d& centre) {
  const auto from_circle = [=](const Vector3d& x) -> Vector3d {
    const Vector3d d = x - centre;
    return d - major * Vector3d(d.x(), d.y(), 0).normalized();
  };
  return {
      {.value = [=](const Vector3d& x) { return from_circle(x).norm() - minor; }, .gradient = from_circle},
      2 * M_PI * M_PI * major * minor * minor};
}

/// Returns the relative error of a mesh's volume, for exact Hermite data.
double volume_error(const Shape& shape, int size, Placement placement) {
  RunContext context;
  const FloatHermite hermite =
      sample_function(shape.surface, {}, {-size, -size, -size}, {size, size, size}, 1e-9, context);
  const auto view = view_of(hermite, context);
  const PolygonMesh mesh = dual_contouring(view, {.placement = placement}, context);
  return six_volumes(mesh) / 6.0 / shape.volume - 1.0;
}

TEST(Placement, AVolumeIsAtLeastSixTimesNearerThanThatOfTheMinimisers) {
  for (const Vector3d& centre : {Vector3d(0.13, 0.41, 0.77), Vector3d(0.5, 0.02, 0.31)})
    for (const Shape& shape : {sphere(20, centre), sphere(33, centre), torus(40, 16, centre)}) {
      const int size = shape.volume > 2e5 ? 60 : 40;
      const double average = volume_error(shape, size, Placement::average);
      const double optimal = volume_error(shape, size, Placement::optimal);
      const double unbiased = volume_error(shape, size, Placement::unbiased);
      EXPECT_LT(average, -0.5 * std::abs(optimal));
      EXPECT_GT(optimal, 0.0);
      EXPECT_LT(std::abs(unbiased), optimal / 6) << average << " " << optimal << " " << unbiased;
    }
}

/// The polyhedron within planes of unit normals and distances from the centre.
AnalyticSurface polyhedron(std::vector<std::pair<Vector3d, double>> planes, const Vector3d& centre) {
  const auto farthest = [=](const Vector3d& x) {
    return std::ranges::max_element(
        planes, {}, [&](const auto& plane) { return plane.first.dot(x - centre) - plane.second; });
  };
  return {
      .value = [=](const Vector3d& x) { return farthest(x)->first.dot(x - centre) - farthest(x)->second; },
      .gradient = [=](const Vector3d& x) -> Vector3d { return farthest(x)->first; }};
}

std::vector<AnalyticSurface> polyhedra(double size, const Vector3d& centre) {
  const Eigen::Matrix3d turn =
      (Eigen::AngleAxisd(0.7, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.5, Vector3d::UnitY()) *
       Eigen::AngleAxisd(0.35, Vector3d::UnitX()))
          .toRotationMatrix();
  std::vector<std::pair<Vector3d, double>> cube, prism, octahedron;
  for (const double side : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis) cube.push_back({turn * Vector3d(side * Vector3d::Unit(axis)), size});
    prism.push_back({turn * Vector3d(0, 0, side), 1.4 * size});
    for (int k = 0; k < 4; ++k)
      octahedron.push_back({turn * Vector3d(side, k & 1 ? 1 : -1, k & 2 ? 1 : -1).normalized(), size});
  }
  for (int k = 0; k < 6; ++k)
    prism.push_back({turn * Vector3d(std::cos(k * M_PI / 3), std::sin(k * M_PI / 3), 0), size});
  return {polyhedron(cube, centre), polyhedron(prism, centre), polyhedron(octahedron, centre)};
}

TEST(Placement, PolyhedraAreReproducedButForSpursBesideCorners) {
  RunContext context;
  for (const double size : {7.3, 12.1, 20.6})
    for (const Vector3d& centre : {Vector3d(0.317, 0.211, 0.113), Vector3d(0.841, 0.457, 0.673)})
      for (const AnalyticSurface& shape : polyhedra(size, centre)) {
        const int half = static_cast<int>(2.5 * size);
        const FloatHermite hermite =
            sample_function(shape, {}, {-half, -half, -half}, {half, half, half}, 1e-9, context);
        const auto view = view_of(hermite, context);
        const PolygonMesh mesh = dual_contouring(view, {}, context);
        ASSERT_GT(mesh.points.size(), 100u);
        std::size_t spurs = 0;
        for (std::size_t i = 0; i < mesh.points.size(); ++i) {
          const double off = shape.value(mesh.world(i));
          EXPECT_LT(std::abs(off), 0.2);
          spurs += std::abs(off) > 1e-5;
        }
        // If a cell's edges miss the third plane of a corner, its vertex lies on the crease of the other two,
        // beyond the corner.
        EXPECT_LE(spurs, 4u) << size;
      }
}

TEST(Placement, FacesOnTheLatticesPlanesComeOutOnThem) {
  RunContext context;
  const auto box = polyhedron({{Vector3d(1, 0, 0), 5},
                               {Vector3d(-1, 0, 0), 3},
                               {Vector3d(0, 1, 0), 6},
                               {Vector3d(0, -1, 0), 2},
                               {Vector3d(0, 0, 1), 4},
                               {Vector3d(0, 0, -1), 4}},
                              Vector3d::Zero());
  const FloatHermite hermite = sample_function(box, {}, {-12, -12, -12}, {12, 12, 12}, 1e-9, context);
  const auto view = view_of(hermite, context);
  const PolygonMesh mesh = dual_contouring(view, {}, context);
  ASSERT_FALSE(mesh.points.empty());
  Eigen::AlignedBox3d bounds;
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    EXPECT_EQ(box.value(mesh.world(i)), 0.0);
    bounds.extend(mesh.world(i));
  }
  EXPECT_EQ(bounds.min(), Vector3d(-3, -2, -4));
  EXPECT_EQ(bounds.max(), Vector3d(5, 6, 4));
  EXPECT_DOUBLE_EQ(six_volumes(mesh) / 6.0, 8.0 * 8.0 * 8.0);
}

}  // namespace placement_test
}  // namespace hermesh
