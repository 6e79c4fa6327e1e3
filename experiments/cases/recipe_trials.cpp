// Shapes that try a voxelizer's signs: overlaps, holes, narrow gaps and thin plates.
#include <algorithm>
#include <cmath>

#include "experiments/cases/recipe_random.h"
#include "experiments/cases/recipe_shapes.h"

namespace hermesh::recipes {

using Eigen::Vector3d;

PolygonMesh sphere_cluster(const RecipeParameters& parameters, RunContext&) {
  const PolygonMesh sphere = octahedral_sphere(static_cast<std::uint32_t>(parameters.at("cuts")));
  Random random(parameters.at("seed"));
  PolygonMesh mesh;
  for (int i = 0; i < parameters.at("spheres"); ++i) {
    Vector3d centre;
    for (int axis = 0; axis < 3; ++axis) centre[axis] = parameters.at("spread") * (random.uniform() - 0.5);
    add_sphere(mesh, sphere, parameters.at("radius"), centre, false);
  }
  const std::vector<Triangle> once = mesh.triangles;
  for (int copy = 1; copy < parameters.at("copies"); ++copy)
    mesh.triangles.insert(mesh.triangles.end(), once.begin(), once.end());
  if (parameters.at("turned") > 0.0)
    for (Triangle& triangle : mesh.triangles)
      if (random.bits() & 1) std::swap(triangle[1], triangle[2]);
  return mesh;
}

/// A sphere with a ring of points about one of its poles, which bounds a hole if `open`. The poles are
/// those of a uv-sphere that is turned, so that the hole faces no axis of the grid; the ring about the
/// hole has the hole's diameter.
PolygonMesh holed_sphere(const RecipeParameters& parameters, RunContext&) {
  const auto around = static_cast<std::uint32_t>(parameters.at("around"));
  const double radius = parameters.at("radius"), hole = parameters.at("hole") / 2.0;
  const RecipeParameters turn = {{"about_x", 25.0}, {"about_y", 40.0}, {"about_z", 10.0}};
  PolygonMesh mesh;
  const auto add = [&](double x, double y, double z) { add_point(mesh, turned({x, y, z}, turn)); };
  add(0, 0, -radius);
  const auto ring = [&](double out, double height) {
    for (std::uint32_t i = 0; i < around; ++i) {
      const auto [x, y] = on_circle(double(i) / around);
      add(out * x, out * y, height);
    }
  };
  const std::uint32_t strips = around / 2;
  for (std::uint32_t i = 1; i < strips; ++i) {
    const auto [height, out] = on_circle(0.5 - 0.5 * i / strips);
    // The rings within one and a half times the hole make way for its own.
    if (height > 0.0 && out * radius < 1.5 * hole) break;
    ring(radius * out, radius * height);
  }
  if (hole > 0.0) ring(hole, std::sqrt(radius * radius - hole * hole));
  add(0, 0, radius);
  connect_rings(mesh, around);
  if (hole > 0.0 && parameters.at("open") > 0.0) {
    const std::uint32_t pole = next_index(mesh) - 1;
    std::erase_if(mesh.triangles, [&](const Triangle& t) { return std::ranges::find(t, pole) != t.end(); });
    mesh.points.pop_back();
  }
  return mesh;
}

PolygonMesh sheets(const RecipeParameters& parameters, RunContext&) {
  const double width = parameters.at("width"), thickness = parameters.at("thickness");
  const double step = thickness + parameters.at("gap"), plates = parameters.at("plates");
  PolygonMesh mesh;
  for (int plate = 0; plate < plates; ++plate) {
    const std::uint32_t first = next_index(mesh);
    const double bottom = step * plate - 0.5 * (step * (plates - 1) + thickness);
    for (int corner = 0; corner < 8; ++corner)
      add_point(mesh, turned({width * ((corner & 1) - 0.5), width * ((corner >> 1 & 1) - 0.5),
                              bottom + thickness * (corner >> 2 & 1)},
                             parameters));
    for (const Quad& q :
         {Quad{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}})
      add_quad(mesh, first + q[0], first + q[1], first + q[2], first + q[3]);
  }
  return mesh;
}

}  // namespace hermesh::recipes
