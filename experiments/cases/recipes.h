// Procedural meshes: the formulas behind the generated cases of cases.toml. They use basic arithmetic, square
// roots and a sine of their own, and nothing else of the mathematical library, so that the bytes are the same
// on every machine with IEEE arithmetic.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

using RecipeParameters = std::map<std::string, double>;

struct RecipeParameter {
  std::string name, meaning;
  double fallback, minimum, maximum;
};

/// One formula. All of them give closed, consistently oriented triangle meshes around the origin.
struct Recipe {
  std::string name, summary;
  std::vector<RecipeParameter> parameters;
  PolygonMesh (*make)(const RecipeParameters& parameters, RunContext& context);
};

std::span<const Recipe> all_recipes();

/// Makes a mesh; parameters that are not given take their fallback.
/// @throws Error for an unknown recipe or parameter, and for a value out of its range.
PolygonMesh make_recipe(const std::string& name, RecipeParameters parameters, RunContext& context);

/// The mesh without the points that no polygon uses, every boundary loop filled with the triangles of
/// smallest area. Shape of the fill: closed and manifold if the mesh was manifold; free of self-intersections
/// only where that area is.
/// @throws Error where two boundary loops touch in a point, an edge has more than two polygons, or a loop
/// more than 1000 edges.
PolygonMesh close_holes(const PolygonMesh& mesh);

}  // namespace hermesh
