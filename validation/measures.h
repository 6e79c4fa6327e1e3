// What is measured on the triangles of a mesh: area, volume, shape, and triangles of no area.
#pragma once

#include "validation/geometry/triangle_soup.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Fills volume, area, smallest_angle, worst_aspect, degenerate_polygons and its places. Sums are in a fixed
/// order.
///  - volume: by the divergence theorem about the centre of the box of the used points; the volume of a mesh
///    that is not closed depends on that point;
///  - degenerate polygon: one that repeats a corner or of which a triangle has exactly zero area (an exact
///    predicate, no tolerance); for a quad, either of its two triangles;
///  - with a degenerate triangle smallest_angle is 0 and worst_aspect infinite.
void measure_triangles(const MeshFile& mesh, const TriangleSoup& soup, MeshReport& report,
                       RunContext& context);

}  // namespace hermesh::validation
