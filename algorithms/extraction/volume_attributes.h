// Attributes of a volume carried over to the points of a mesh: what `hermesh voxelize --grids
// attributes,closest-point` wrote, or any other program's grids in the same file.
//
// | grid                    | attribute of points | | ----------------------- |
// --------------------------------------------------------------------------------------- | | float, double
// | one number, trilinear                                                                   | | vec3s, vec3d
// | three numbers, trilinear; of "uv" the first two; with a float grid "NAME-alpha" beside   | | | it four.
// Normals ("normal", or ending in "-normal") get unit length                     | | int32, int64, bool | a
// whole number, that of the nearest sample, never mixed; with the grid's labels         |
//
// Only active samples count: a trilinear value is the mean of the active ones among the eight around the
// point, by their weights, and the nearest is the active one of largest weight. A point without any gets 0,
// or −1 where the values are whole numbers, and a note says how many there are. Values are single precision:
// closest points in world coordinates far from the origin are rounded.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Adds the attributes of these grids to the mesh; "all" means every grid of a type above but distances and
/// fog (sdf, udf, fog, and grids of the class level set). Grids are found in world space, so their lattices
/// may differ from the surface's. The same values at any thread count. @returns the attributes' names
/// @throws Error as read_level_set() does, for a name that there is not, for a grid of another type, and
/// where "all" finds none; Cancelled
std::vector<std::string> sample_attributes(PolygonMesh& mesh, const std::filesystem::path& vdb,
                                           const std::vector<std::string>& names, RunContext& context);

}  // namespace hermesh
