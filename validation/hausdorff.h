// The one-sided Hausdorff distance between two surfaces, bracketed with certainty.
#pragma once

#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Brackets the one-sided Hausdorff distance, the maximum over points p of `from` of the distance from p to
/// `to`, by branch and bound.
///
/// Lower bound: the distance of points of `from` that were looked at. Upper bound of a triangle: for any
/// triangle R of `to`, the largest of its corners' distances to R, because the distance to a convex set is a
/// convex function; R runs over the triangles closest to its corners and its centre. The distance at its
/// centre plus the radius about it holds, too. Where neither is within `gap` (world units) of the lower
/// bound, parts of the triangle may each be near another R (triangle_cover.h). Where that fails, too, it is
/// cut into four, level by level. (Compare Tang, Lee and Kim, Interactive Hausdorff Distance Computation for
/// General Polygonal Models, 2009.)
///
/// The bracket holds always; it is wider than `gap` only where 65536 triangles of the mesh came to more than
/// four million pieces, or a piece to more than forty levels. For rounding it is widened on both sides by
/// 1e-7 of the larger diagonal and 1e-15 of the largest coordinate: the plane of a needle that is 1e8 times
/// as long as it is high, the thinnest that counts as having one, is known to some 1e-8, and so is the
/// distance to it.
/// @throws Cancelled.
HausdorffBound certified_distance(const TriangleSoup& from, const TriangleTree& to, double gap,
                                  RunContext& context);

}  // namespace hermesh::validation
