// Solids below height fields, such as terrains.
#pragma once

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Closes a height field: adds vertical walls below its boundary and a flat base at height `base` (world
/// units). The result is closed and oriented, and its volume is that between the field and the base. Its
/// triangles are those of the field, turned upwards, those of the base in the same order, and the walls.
/// Points that differ by nothing but their number are joined first. Attributes are dropped.
/// @throws Error with a position if a polygon is vertical, lies over another one, or is not above the base,
///   or if an edge has more than two polygons
PolygonMesh fill_below(const PolygonMesh& field, double base, RunContext& context);

}  // namespace hermesh
