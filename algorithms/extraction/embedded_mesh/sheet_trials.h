// Cells of several sheets, and ambiguous faces, tried without the last resort of uniform_mesh.h.
#pragma once

#include <vector>

#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// Appends the points of fanned edges to those of the cells: at their crossings, or where rounding forbids
/// that, as near to them as the tetrahedra of the fan allow (uniform_mesh.h).
void place_crossings(const CellBlocks& cells, const EdgePolygons& polygons, const FilePoints& file,
                     UniformPoints& points, RunContext& context);

/// Places the points of fanned edges, and holds to their segments the cells of several sheets and beside
/// ambiguous faces whose polygons, as they would be without, meet others (triangle_contact.h) or leave an
/// edge with four polygons. Where polygons meet, the cells around their edges are held, and only if there are
/// none cells farther away: in white noise one cell in a hundred is held, where to hold all that lie among
/// many of their kind took two in five. Held cells that still meet others, because their crossings are
/// rounded, are centred.
///
/// Afterwards no two polygons meet: where no cell of an edge is tried, its polygons are those of
/// uniform_mesh.h and the proof there holds for any two; a polygon of another edge has been tested against
/// all polygons nearby, as they are at the end.
///
/// Joints of several sheets are tried, too, but cannot be held.
/// @param cells cells of the lattice
/// @param polygons what the edges become; cells are held in it
/// @param file rounds places to the file's precision
/// @param points places of the cells' points, which move where a cell is centred; those on fanned edges are
/// put
///   behind them
/// @param farthest from its cell along an axis that any point is, voxels
/// @param context told of progress, and asked whether to stop
/// @returns the joints of several sheets near polygons that still meet when nothing is left to be held, each
/// once;
///   nearly always none
/// @throws Cancelled
std::vector<CellBlocks::Cell> hold_cells_that_meet(const CellBlocks& cells, EdgePolygons& polygons,
                                                   const FilePoints& file, UniformPoints& points,
                                                   double farthest, RunContext& context);

}  // namespace hermesh
