// All pairs of triangles that intersect beyond their shared corners, by exact predicates.
#pragma once

#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Tests every pair of triangles whose boxes overlap; `tree` must be built from `soup`. The halves of a quad
/// are triangles like any others. A corner is shared if its index is the same: two vertices at one position
/// are distinct, so triangles that touch there count as intersecting. Two triangles intersect if they share
///  - no corner, and have any point in common (disjoint);
///  - one, and have a point other than that corner in common (vertex_sharing);
///  - two, and lie in one plane on the same side of their edge (edge_sharing: a fold). Any other two such
///    triangles have only the edge in common;
///  - three: they are the same triangle (edge_sharing).
/// A triangle of exactly zero area is counted as degenerate and intersects nothing here; its edges are also
/// those of its neighbours. The reported locations are the centres of the overlap of the two boxes, for the
/// first ten pairs by triangle number. @throws Cancelled.
SelfIntersections find_self_intersections(const TriangleSoup& soup, const TriangleTree& tree,
                                          RunContext& context);

}  // namespace hermesh::validation
