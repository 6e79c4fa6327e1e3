// Procedural meshes: the formulas of the generated cases of cases.toml. They use basic arithmetic, square
// roots and their own sine, and nothing else of the mathematical library, so that the bytes are the same on
// every machine with IEEE arithmetic.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

using RecipeParameters = std::map<std::string, double>;

std::vector<std::string> recipe_names();
bool is_recipe(const std::string& name);

/// Makes a closed, consistently oriented triangle mesh around the origin; missing parameters take their
/// defaults.
/// @throws Error for an unknown recipe or parameter, and for a value out of its range.
PolygonMesh make_recipe(const std::string& name, RecipeParameters parameters, RunContext& context);

/// Returns the mesh without its isolated points and with each boundary loop filled by the triangles of
/// smallest area: closed and manifold if the mesh was manifold; free of self-intersections only if that area
/// is.
/// @throws Error if two boundary loops touch in a point, an edge has more than two polygons, or a loop more
/// than 1000 edges.
PolygonMesh close_holes(const PolygonMesh& mesh);

/// Returns the stand-in "scan", "fog" or "cube" for a volume.
LevelSet make_volume_stand_in(const std::string& name);

}  // namespace hermesh
