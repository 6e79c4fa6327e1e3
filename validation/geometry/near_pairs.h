// Pairs of triangles that meet, or all but meet, although they are no neighbours.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "algorithms/core/run_context.h"
#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"

namespace hermesh::validation {

/// Finds pairs of triangles that meet or nearly meet, by their numbers, the smaller one first, in increasing
/// order. A pair is listed if
///  - the two share no corner and come within `reach` of one another;
///  - they share one corner, and a side opposite to it comes within `reach` of the other triangle;
///  - they share two, and a corner opposite to their edge comes within `reach` of the other triangle;
///  - they share all three.
/// Corners are shared by number. Faces that lie upon one another but for rounding are such pairs, which exact
/// predicates (self_intersection.h) would tell apart; a triangle smaller than `reach` may be one with its
/// neighbours. @throws Cancelled.
std::vector<std::array<std::uint32_t, 2>> near_pairs(const TriangleSoup& soup, const TriangleTree& tree,
                                                     double reach, const RunContext& context);

}  // namespace hermesh::validation
