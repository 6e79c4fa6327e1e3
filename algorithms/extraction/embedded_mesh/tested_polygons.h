// Polygons that the arguments of uniform_mesh.h do not cover, tested for contact with all others nearby:
// those of cells of several sheets or with ambiguous faces.
#pragma once

#include <vector>

#include "algorithms/extraction/embedded_mesh/edge_polygons.h"
#include "algorithms/extraction/embedded_mesh/file_points.h"
#include "algorithms/extraction/embedded_mesh/uniform_points.h"

namespace hermesh {

/// Appends the vertices of fanned edges to those of the cells: at their crossings or, if rounding forbids
/// that, as near to them as the tetrahedra of the fan allow (uniform_mesh.h).
void place_crossings(const CellBlocks& cells, const EdgePolygons& polygons, const FilePoints& file,
                     UniformPoints& points, RunContext& context);

/// Calls place_crossings(), and holds to their segments the cells of several sheets or at ambiguous faces
/// whose unconstrained polygons intersect others (triangle_contact.h) or leave an edge with four polygons.
/// The cells around the edges of intersecting polygons are held first, and cells farther away only if there
/// are none: in white noise this holds one cell in a hundred, where holding all that have many of their kind
/// around held two in five. Held cells that still intersect others, because their crossings are rounded, are
/// centred. Joints of several sheets are tested as well, but cannot be held.
///
/// Afterwards no two polygons intersect: for edges without a tested cell by the argument of uniform_mesh.h,
/// and any other polygon has been tested, in its final form, against all polygons nearby.
/// @param cells cells of the lattice
/// @param polygons forms of the edges; its cells are held
/// @param file rounds positions to the file's precision
/// @param points the cells' vertices, which move if a cell is centred; those of fanned edges are appended
/// @param farthest distance of any vertex from its cell along an axis, voxels
/// @param context receives the progress and the request to cancel
/// @returns the joints of several sheets near polygons that intersect although nothing else can be held, each
///   once; nearly always none
/// @throws Cancelled
std::vector<CellBlocks::Cell> hold_cells_that_meet(const CellBlocks& cells, EdgePolygons& polygons,
                                                   const FilePoints& file, UniformPoints& points,
                                                   double farthest, RunContext& context);

}  // namespace hermesh
