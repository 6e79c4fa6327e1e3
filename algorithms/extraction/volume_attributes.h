// Attributes of a volume, sampled at the vertices of a mesh: the grids of `hermesh voxelize --grids
// attributes,closest-point`, or any other program's grids in the same file.
//
// - float and double: one number, trilinear.
// - vec3s and vec3d: three numbers, trilinear; of "uv" the first two; with a float grid "NAME-alpha" in the
//   file a fourth. Normals ("normal", or ending in "-normal") get unit length.
// - int32, int64 and bool: an integer, that of the nearest sample, never mixed; with the grid's labels.
//
// Only active samples count: a trilinear value is the weighted mean of the active ones among the eight around
// the vertex, and the nearest is the active one of largest weight. A vertex without any gets 0, or −1 for
// integers, and a note has their number. Values are single precision: closest points in world coordinates far
// from the origin are rounded.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Adds the attributes of these grids to the mesh; "all" means every grid of a type above except distances
/// and fog (sdf, udf, fog, and grids of the class level set). Grids are sampled in world space, so their
/// lattices may differ from the surface's. The same values for any number of threads. @returns the
/// attributes' names
/// @throws Error as read_level_set() does, for an unknown name, for a grid of another type, and if "all"
/// finds none; Cancelled
std::vector<std::string> sample_attributes(PolygonMesh& mesh, const std::filesystem::path& vdb,
                                           const std::vector<std::string>& names, RunContext& context);

}  // namespace hermesh
