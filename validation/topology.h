// Counts over the polygons as they stand, with no repair and no data structure that would refuse any of them.
#pragma once

#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Fills the counts of the report, from `points` to `genus` without `degenerate_polygons`, and their places.
///
/// An edge is a pair of points that some polygon has as neighbouring corners; each time that a polygon has
/// them as such is one side of the edge. A polygon that repeats a corner has sides of one point: those are no
/// edges.
///  - boundary edge: one side;
///  - non-manifold edge: more than two sides;
///  - inconsistent edge: two sides that run the same way. Edges with more sides are not asked: no orientation
///    would do;
///  - non-manifold vertex: its polygons fall into more than one fan, where two polygons belong to one fan if
///    they share an edge at the vertex, however many sides it has. The ends of a non-manifold edge are
///    therefore not counted for that edge alone. Where there is no non-manifold edge this is the definition
///    of CGAL and of OpenMesh: the link of the vertex is one path or one cycle;
///  - duplicate polygon: has the same corners, in any order, as one before it, so that n copies count n − 1;
///  - isolated point: used by no polygon;
///  - component: polygons that hang together by shared points;
///  - Euler characteristic: used points − edges + polygons;
///  - genus: components − Euler characteristic / 2, summed over components; given only if the mesh is closed,
///    manifold and oriented, and no polygon repeats a corner.
///
/// One list of the polygon corners at each point serves for all counts: its neighbours in that list are the
/// point's edges and its link. Time and memory are linear in the mesh but for the sorting of each point's own
/// list.
/// @throws Cancelled; Error for more polygon corners than 32 bits can number.
void count_topology(const MeshFile& mesh, MeshReport& report, RunContext& context);

/// True if a polygon has one point at two of its corners.
bool repeats_corner(const Triangle& t);
bool repeats_corner(const Quad& q);

}  // namespace hermesh::validation
