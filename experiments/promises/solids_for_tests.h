// Solids for tests of their meshes in world coordinates.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "algorithms/io/mesh_file.h"
#include "experiments/cases/recipe_shapes.h"
#include "experiments/cases/recipes.h"

namespace hermesh::test_solids {

/// Returns the mesh rotated, scaled and translated in double precision, and then read as from a file: in
/// single precision about an origin of its own.
inline PolygonMesh placed(const PolygonMesh& mesh, const Eigen::Matrix3d& linear, const Eigen::Vector3d& at) {
  MeshFile file = to_mesh_file(mesh);
  for (Eigen::Vector3d& point : file.points) point = linear * point + at;
  file.origin.reset();
  return to_polygon_mesh(file);
}

/// Returns a cuboid with its lower corner and sizes in world units, twelve triangles.
inline PolygonMesh cuboid(const Eigen::Vector3d& lower, const Eigen::Vector3d& size) {
  RunContext context;
  return placed(make_recipe("turned-cube", {}, context), size.asDiagonal(), lower + 0.5 * size);
}

/// Returns a prism over a star of `teeth` points, from z = −0.4 to 0.4, radius 1.
inline PolygonMesh gear(int teeth) {
  MeshFile file;
  const int n = 2 * teeth;
  for (const double z : {-0.4, 0.4})
    for (int i = 0; i < n; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / n, radius = i % 2 ? 0.7 : 1.0;
      file.points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  file.points.emplace_back(0, 0, -0.4);
  file.points.emplace_back(0, 0, 0.4);
  for (int i = 0; i < n; ++i) {
    const auto a = std::uint32_t(i), b = std::uint32_t((i + 1) % n), m = std::uint32_t(n);
    file.triangles.insert(file.triangles.end(),
                          {{a, b, b + m}, {a, b + m, a + m}, {b, a, 2 * m}, {a + m, b + m, 2 * m + 1}});
  }
  return to_polygon_mesh(file);
}

inline Eigen::Matrix3d random_turn(recipes::Random& random) {
  return Eigen::Quaterniond(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1),
                            random.uniform(-1, 1) + 1e-3)
      .normalized()
      .toRotationMatrix();
}

inline Eigen::Vector3d random_vector(recipes::Random& random, double most) {
  const double x = random.uniform(-most, most), y = random.uniform(-most, most);
  return {x, y, random.uniform(-most, most)};
}

/// Returns a ball, box, gear, torus, cylinder or part, by number; sizes of about 2, about the origin.
inline PolygonMesh solid(std::uint64_t number) {
  RunContext context;
  switch (number % 6) {
    case 0:
      return make_recipe("uv-sphere", {{"around", 24.0}, {"upward", 12.0}}, context);
    case 1:
      return cuboid({-0.9, -0.7, -0.6}, {1.8, 1.4, 1.2});
    case 2:
      return gear(int(5 + number / 6 % 7));
    case 3:
      return make_recipe("torus", {{"minor_radius", 0.45}, {"around", 32.0}, {"across", 16.0}}, context);
    case 4:
      return make_recipe("cylinder", {{"around", 24.0}, {"height", 1.6}}, context);
    default:
      return make_recipe("cad-part", {{"triangles", 400.0}}, context);
  }
}

}  // namespace hermesh::test_solids
