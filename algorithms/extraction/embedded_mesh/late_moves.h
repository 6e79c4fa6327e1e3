// Points of the finest mesh that could not leave their cells by the rule of tetrahedra (uniform_mesh.h), moved one by one
// where the mesh as it is shows that nothing meets.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// Where the point of a cell of one sheet, or of a joint, would rather be, outside of its cell; index space relative to
/// the placement's base.
struct PointTarget {
  int cell;
  Eigen::Vector3d place;
  Eigen::Vector3d nearer;  ///< as near to the planes, but nearer to where the point is within its cell
};

/// Moves points to the places aimed at, or part of the way. The rule of tetrahedra suffices for an embedded mesh, but
/// is not necessary: here a point moves if its polygons as they would be meet no other polygon nearby and not one
/// another (triangle_contact.h), so a mesh free of self-intersection stays so. `targets` are by block; places that are
/// fulfilled already, and targets in crowded cells (EdgePolygons::is_crowded()), are passed over. The result is the same
/// for every number of threads. @throws Cancelled
void move_points(const CellBlocks& cells, const EdgePolygons& polygons,
                 const std::vector<std::vector<PointTarget>>& targets, const FilePoints& file,
                 UniformPoints& points, RunContext& context);

}  // namespace hermesh
