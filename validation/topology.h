// Counts and measures of the unmodified polygons, without a data structure that would refuse any of them.
#pragma once

#include "algorithms/core/run_context.h"
#include "validation/geometry/triangle_soup.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Fills the counts of the report, from `points` to `genus` without `degenerate_polygons`, and their
/// locations.
///
/// An edge is a pair of vertices that are adjacent corners of some polygon; each such adjacency is one side
/// of the edge. A polygon that repeats a corner has sides of one vertex: these are not edges.
///  - boundary edge: one side;
///  - non-manifold edge: more than two sides;
///  - inconsistent edge: two sides with the same direction. Edges with more sides are not tested, because no
///    orientation would be consistent;
///  - non-manifold vertex: its polygons form more than one fan, where two polygons belong to one fan if they
///    share an edge at the vertex, regardless of its number of sides. The ends of a non-manifold edge are
///    therefore not counted for that edge only. Without non-manifold edges this is the definition of CGAL and
///    of OpenMesh: the link of the vertex is one path or one cycle;
///  - duplicate polygon: has the same corners, in any order, as an earlier one, so n copies count n − 1;
///  - isolated point: used by no polygon;
///  - component: polygons connected by shared vertices;
///  - Euler characteristic: used points − edges + polygons;
///  - genus: components − Euler characteristic / 2, summed over components; only if the mesh is closed,
///    manifold and oriented, and no polygon repeats a corner.
///
/// All counts use one list of the polygon corners at each vertex: the neighbours in that list are the
/// vertex's edges and its link. Time and memory are linear in the mesh except for sorting each vertex's own
/// list.
/// @throws Cancelled; Error for more polygon corners than 32 bits can number.
void count_topology(const MeshFile& mesh, MeshReport& report, RunContext& context);

/// Fills volume, area, smallest_angle, worst_aspect, degenerate_polygons and its locations, with sums in a
/// fixed order.
///  - volume: by the divergence theorem about the centre of the box of the used points; the volume of a mesh
///    that is not closed depends on that centre;
///  - degenerate polygon: one that repeats a corner or has a triangle of exactly zero area (an exact
///    predicate, no tolerance); for a quad, either of its two triangles;
///  - with a degenerate triangle smallest_angle is 0 and worst_aspect infinite.
void measure_triangles(const MeshFile& mesh, const TriangleSoup& soup, MeshReport& report,
                       RunContext& context);

/// Returns true if a polygon has one point at two of its corners.
bool repeats_corner(const Triangle& t);
bool repeats_corner(const Quad& q);

}  // namespace hermesh::validation
