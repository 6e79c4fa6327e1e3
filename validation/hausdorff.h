// The one-sided Hausdorff distance between two surfaces, bracketed with certainty.
#pragma once

#include "validation/geometry/triangle_soup.h"
#include "validation/geometry/triangle_tree.h"
#include "validation/mesh_report.h"

namespace hermesh::validation {

/// Brackets the one-sided Hausdorff distance, the maximum over points p of `from` of the distance from p to
/// `to`, by branch and bound.
///
/// Lower bound: the distances of the visited points of `from`. Upper bound of a triangle: for any triangle R
/// of `to`, the largest of its corners' distances to R, because the distance to a convex set is a convex
/// function; R runs over the triangles closest to its corners and its centre. The distance at its centre plus
/// the radius about it is another bound. If neither is within `gap` (world units) of the lower bound, parts
/// of the triangle may each be near another R (cover_bound()). If that fails, too, the triangle is cut into
/// four, level by level. (Compare Tang, Lee and Kim, Interactive Hausdorff Distance Computation for General
/// Polygonal Models, 2009.)
///
/// The bracket is always valid; it is wider than `gap` only if 65536 triangles of the mesh led to more than
/// four million pieces, or a piece to more than forty levels. To cover rounding it is widened on both sides
/// by 1e-7 of the larger diagonal and 1e-15 of the largest coordinate: the plane of a needle that is 1e8
/// times as long as it is high, the thinnest that is treated as having one, is known to some 1e-8, and so is
/// the distance to it. @throws Cancelled.
HausdorffBound certified_distance(const TriangleSoup& from, const TriangleTree& to, double gap,
                                  RunContext& context);

/// Returns an upper bound, at most `limit`, of the distance from any point of `piece` to the triangles of
/// `to`; infinity if no such bound is found.
///
/// No single triangle of a fine flat surface is near all of a large triangle, and repeated halving of the
/// latter ends only at pieces as small as `limit` along all sides of the fine ones. So the piece is cut along
/// the sides of the triangles within `reach` of it, into convex parts that each lie within `limit` of one
/// triangle: the distance to a triangle is a convex function, so the corners of a part decide. The position
/// of the cuts affects only if a bound is found, never its validity.
///
/// No bound is found if more than a few triangles are near; the caller then has to cut the piece. The closest
/// triangle of each point of `piece` must be within `reach` of it.
double cover_bound(const Corners& piece, const TriangleTree& to, double reach, double limit);

}  // namespace hermesh::validation
