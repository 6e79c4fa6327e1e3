// Moves of vertices to their targets that the arguments of uniform_mesh.h do not cover, each with a test for
// contact with all polygons nearby.
#pragma once

#include <vector>

#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/point_target.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// Largest distance of any vertex from its cell along an axis, in voxels. It bounds where the polygons near a
/// position may start, so that they are found through the lattice.
inline constexpr double kFarthestFromCell = 1.0;

/// Vertices of cells fewer than this many cells from the faces of their tile do not move (move_points()).
inline constexpr int kStillCells = 8;

/// Moves vertices to their targets, or part of the way. The rule of tetrahedra (uniform_mesh.h) is sufficient
/// for an embedded mesh, but not necessary: here a vertex moves if its polygons would intersect neither each
/// other nor any polygon nearby (triangle_contact.h), so an embedded mesh remains embedded. `targets` are by
/// block; those already reached, and those in crowded cells (EdgePolygons::is_crowded()), are skipped. The
/// result does not depend on the number of threads.
///
/// **Orientation.** A vertex moves in one step, so a mesh that is embedded before and after it may have
/// passed through itself: a small body, or a small piece of a fracture, is inverted if its vertex leaves it
/// through the opposite side. The polygons around the vertex before the move, reversed, and those after it
/// bound a closed surface. Let q be a point on a polygon of the same closed component that does not have the
/// vertex, and k the winding number of that surface about q. Before the move the winding number of the
/// component is 1 on one side of q and 0 on the other; afterwards both differ by k. As the mesh is embedded
/// after the move, too, its orientation is unchanged if and only if k is 0. A vertex moves only if k is 0 for
/// each piece whose boundary it is on.
///
/// **Tiles.** With tiles (UniformTiling) no vertex of a cell within kStillCells of the faces of its tile
/// moves. What a move depends on lies in cells up to seven away, so moves in one tile do not depend on those
/// in another, and a tile is the same whether the lattice around it is complete or ends a little beyond it.
/// @param tile side of the tiles in cells, a multiple of 8; 0 if there are none
/// @param polygons quads with a triangle that a move would leave without area are cut along the other
/// diagonal
/// @throws Cancelled
void move_points(const CellBlocks& cells, EdgePolygons& polygons,
                 const std::vector<std::vector<PointTarget>>& targets, const FilePoints& file,
                 UniformPoints& points, int tile, RunContext& context);

}  // namespace hermesh
