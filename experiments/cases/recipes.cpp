#include "experiments/cases/recipes.h"

#include <algorithm>

#include "algorithms/core/error.h"
#include "experiments/cases/recipe_shapes.h"

namespace hermesh {

namespace {

constexpr double kMostTriangles = 1e8;  ///< triangles, about ten times the largest case

const RecipeParameter kCuts = {"cuts", "the sphere has 8 times its square triangles", 64, 1, 3000};
const RecipeParameter kAround = {"around", "points of a ring", 128, 3, 10000};
const RecipeParameter kRadius = {"radius", "world units", 1, 1e-6, 1e6};

}  // namespace

std::span<const Recipe> all_recipes() {
  static const std::vector<Recipe> table = {
      {"noise-sphere",
       "sphere, displaced along its rays by octaves of gradient noise, each half as high and twice as fine "
       "as the one before",
       {{"triangles", "met within 1 % from 20000 on", 1e6, 8, kMostTriangles},
        kRadius,
        {"octaves", "of noise", 7, 0, 20},
        {"amplitude", "of the first octave, share of the radius", 0.25, 0, 1},
        {"frequency", "of the first octave, lattice cells a radius", 2, 0.01, 1000},
        {"seed", "of the noise", 1, 0, 1e9}},
       recipes::noise_sphere},
      {"turned-cube",
       "cube, turned about x, then y, then z",
       {{"side", "world units", 1, 1e-6, 1e6},
        {"about_x", "degrees", 0, -360, 360},
        {"about_y", "degrees", 0, -360, 360},
        {"about_z", "degrees", 0, -360, 360}},
       recipes::turned_cube},
      {"torus",
       "torus about the z axis",
       {{"major_radius", "world units", 1, 1e-6, 1e6},
        {"minor_radius", "world units", 0.4, 1e-6, 1e6},
        kAround,
        {"across", "points of a cross-section", 64, 3, 10000}},
       recipes::torus},
      {"nested-spheres",
       "ball with a hollow shell's cavity in it and a smaller ball in the cavity",
       {{"outer", "radius", 1, 1e-6, 1e6},
        {"cavity", "radius", 0.7, 1e-6, 1e6},
        {"core", "radius", 0.4, 1e-6, 1e6},
        kCuts},
       recipes::nested_spheres},
      {"overlapping-spheres",
       "two spheres of the same radius that intersect each other",
       {kRadius, {"distance", "of the centres, along x", 1, 0, 1e6}, kCuts},
       recipes::overlapping_spheres},
      {"sphere-cluster",
       "spheres of the same radius about random centres, so that they overlap",
       {kRadius,
        {"spheres", "number of them", 8, 1, 1000},
        {"spread", "side of the cube that the centres lie in", 2, 0, 1e6},
        kCuts,
        {"copies", "of every triangle", 1, 1, 10},
        {"turned", "1 turns every triangle round with a chance of one half", 0, 0, 1},
        {"seed", "of the centres and turns", 1, 0, 1e9}},
       recipes::sphere_cluster},
      {"holed-sphere",
       "sphere of longitudes and latitudes with a round hole, open or covered, at a pole that points along "
       "no axis",
       {kRadius,
        {"hole", "diameter of the hole", 0.1, 0, 1e6},
        {"open", "1 leaves the hole open", 0, 0, 1},
        kAround},
       recipes::holed_sphere},
      {"sheets",
       "square plates, one above the other",
       {{"plates", "number of them", 1, 1, 1000},
        {"width", "world units", 1, 1e-6, 1e6},
        {"thickness", "world units", 0.1, 1e-9, 1e6},
        {"gap", "between one plate and the next", 0.1, 1e-9, 1e6},
        {"about_x", "degrees", 0, -360, 360},
        {"about_y", "degrees", 0, -360, 360},
        {"about_z", "degrees", 0, -360, 360}},
       recipes::sheets},
      {"splash",
       "water: a pool with waves, crowns thrown up from it, ligaments drawn from the crowns' rims and "
       "droplets, all of them "
       "closed and overlapping; 0.268 x 0.347 x 1 times the length",
       {{"length", "along z, world units", 10, 1e-6, 1e6},
        {"crowns", "thin sheets, thrown up in a ring", 14, 0, 1000},
        {"ligaments", "threads", 400, 0, 1e5},
        {"droplets", "most of them the smallest", 6000, 1, 1e6},
        {"detail", "1 gives some two million triangles", 1, 0.1, 10},
        {"part", "0 for all, or the pool (1), the crowns (2), the ligaments (3) or the droplets (4) alone", 0,
         0, 4},
        {"seed", "of all places and shapes", 1, 0, 1e9}},
       recipes::splash},
      {"uv-sphere",
       "sphere of longitudes and latitudes, slender triangles at its poles",
       {kRadius, kAround, {"upward", "strips from pole to pole", 64, 2, 10000}},
       recipes::uv_sphere},
      {"cylinder",
       "cylinder along the z axis, its caps fans",
       {kRadius, {"height", "world units", 2, 1e-6, 1e6}, kAround},
       recipes::cylinder},
      {"cad-part",
       "prism with sharp edges, a notch, a chamfer, and two edges that are blends",
       {{"triangles", "at least", 20000, 100, kMostTriangles}},
       recipes::cad_part}};
  return table;
}

PolygonMesh make_recipe(const std::string& name, RecipeParameters parameters, RunContext& context) {
  const auto recipe = std::ranges::find(all_recipes(), name, &Recipe::name);
  if (recipe == all_recipes().end()) {
    std::string names;
    for (const Recipe& each : all_recipes()) names += (names.empty() ? "" : ", ") + each.name;
    throw Error("there is no recipe '" + name + "'; there are " + names);
  }
  for (const auto& [key, value] : parameters) {
    const auto parameter = std::ranges::find(recipe->parameters, key, &RecipeParameter::name);
    if (parameter == recipe->parameters.end())
      throw Error("recipe " + name + " has no parameter '" + key + "'");
    if (!(value >= parameter->minimum && value <= parameter->maximum))
      throw Error("parameter '" + key + "' of recipe " + name + " is out of its range");
  }
  for (const RecipeParameter& parameter : recipe->parameters)
    parameters.emplace(parameter.name, parameter.fallback);
  const Stage stage(context, "generate");
  return recipe->make(parameters, context);
}

}  // namespace hermesh
