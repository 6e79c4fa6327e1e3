// The formulas of recipes.h and what they share.
#pragma once

#include <utility>

#include "experiments/cases/recipes.h"

namespace hermesh::recipes {

/// Cosine and sine of an angle in turns, the same bits on every machine.
std::pair<double, double> on_circle(double turns);

inline void add_point(PolygonMesh& mesh, const Eigen::Vector3d& point) {
  mesh.points.push_back(point.cast<float>());
}

inline std::uint32_t next_index(const PolygonMesh& mesh) {
  return static_cast<std::uint32_t>(mesh.points.size());
}

/// The triangles abc and acd.
void add_quad(PolygonMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);

/// Triangles over the points that are there already: point 0, then rings of `around` points each,
/// counter-clockwise seen from where the last point is, then that last point.
void connect_rings(PolygonMesh& mesh, std::uint32_t around);

/// Unit sphere of 8 n² triangles of about the same area.
PolygonMesh octahedral_sphere(std::uint32_t n);

/// Adds a sphere; one that faces inwards bounds a cavity.
void add_sphere(PolygonMesh& mesh, const PolygonMesh& unit_sphere, double radius,
                const Eigen::Vector3d& centre, bool inwards);

/// The point turned about x, then y, then z, by the parameters about_x, about_y and about_z in degrees.
Eigen::Vector3d turned(const Eigen::Vector3d& point, const RecipeParameters& parameters);

PolygonMesh noise_sphere(const RecipeParameters& parameters, RunContext& context);
PolygonMesh nested_spheres(const RecipeParameters& parameters, RunContext& context);
PolygonMesh overlapping_spheres(const RecipeParameters& parameters, RunContext& context);
PolygonMesh turned_cube(const RecipeParameters& parameters, RunContext& context);
PolygonMesh torus(const RecipeParameters& parameters, RunContext& context);
PolygonMesh uv_sphere(const RecipeParameters& parameters, RunContext& context);
PolygonMesh cylinder(const RecipeParameters& parameters, RunContext& context);
PolygonMesh cad_part(const RecipeParameters& parameters, RunContext& context);
PolygonMesh sphere_cluster(const RecipeParameters& parameters, RunContext& context);
PolygonMesh holed_sphere(const RecipeParameters& parameters, RunContext& context);
PolygonMesh sheets(const RecipeParameters& parameters, RunContext& context);
PolygonMesh splash(const RecipeParameters& parameters, RunContext& context);

}  // namespace hermesh::recipes
