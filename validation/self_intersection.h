// All pairs of triangles that meet where they should not, by exact predicates.
#pragma once

#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// How two triangles of a mesh meet beyond what their shared corners explain.
enum class PairKind { none, disjoint, vertex_sharing, edge_sharing };

/// Tells how triangles `a` and `b` of the soup, which must not be degenerate, meet. Corners are shared by
/// number: two points at one position are two points, and triangles that touch there count.
///  - no shared corner: the closed triangles meet, if only in a point (disjoint);
///  - one: they meet anywhere but in that corner (vertex_sharing);
///  - two: they lie in one plane, on the same side of the edge (edge_sharing: a fold). Any other two
///    triangles meet in the edge alone;
///  - three: they are the same triangle (edge_sharing).
/// A triangle of exactly zero area meets nothing here: it is counted as degenerate, and the edges that it
/// consists of are those of its neighbours.
PairKind classify_pair(const TriangleSoup& soup, std::size_t a, std::size_t b);

/// Tests every pair of triangles whose boxes meet; `tree` is that of the soup. A quad's two halves are
/// triangles like any others. The places are those of the ten pairs that come first by triangle number: the
/// centre of the overlap of the two boxes.
SelfIntersections find_self_intersections(const TriangleSoup& soup, const TriangleTree& tree,
                                          RunContext& context);

}  // namespace hermesh::validation
