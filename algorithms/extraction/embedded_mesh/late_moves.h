// Points of the finest mesh that could not leave their cells by the rule of tetrahedra (uniform_mesh.h),
// moved one by one where the mesh as it is shows that nothing meets.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// Where the point of a cell of one sheet, or of a joint, would rather be, outside of its cell; index space
/// relative to the placement's base.
struct PointTarget {
  int cell;
  Eigen::Vector3d place;
  Eigen::Vector3d nearer;  ///< as near to the planes, but nearer to where the point is within its cell
};

/// Moves points to the places aimed at, or part of the way. The rule of tetrahedra suffices for an embedded
/// mesh, but is not necessary: here a point moves if its polygons as they would be meet no other polygon
/// nearby and not one another (triangle_contact.h), so a mesh free of self-intersection stays so. `targets`
/// are by block; places that are fulfilled already, and targets in crowded cells
/// (EdgePolygons::is_crowded()), are passed over. The result is the same for every number of threads.
///
/// **Orientation.** A point moves in one step, so a mesh that is embedded before and after it may have passed
/// through itself: a small body, or a small piece of a fracture, is inside out if its point leaves it through
/// the opposite side. The polygons around the point before the move, reversed, and those after it bound a
/// closed surface. Let q be a place on a polygon of the same closed component that does not have the point.
/// The winding number of the component is 1 on one side of q and 0 on the other before the move, and differs
/// by the winding number k of that surface about q afterwards. As the mesh is embedded afterwards, too, it is
/// oriented as before if and only if k is 0. A point moves only if k is 0 for each piece whose boundary it is
/// on.
/// @throws Cancelled
void move_points(const CellBlocks& cells, const EdgePolygons& polygons,
                 const std::vector<std::vector<PointTarget>>& targets, const FilePoints& file,
                 UniformPoints& points, RunContext& context);

}  // namespace hermesh
