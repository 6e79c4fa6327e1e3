// A bound of the distance from one triangle to many, by cutting it along their sides.
#pragma once

#include "validation/geometry/triangle_tree.h"

namespace hermesh::validation {

/// An upper bound, no more than `limit`, of the distance from any point of `piece` to the triangles of `to`;
/// infinity if no such bound is found.
///
/// No one triangle of a fine flat surface is near the whole of a large triangle, and halving that again and
/// again ends only at pieces as small as `limit` along all sides of the fine ones. So the piece is cut along
/// the sides of the triangles within `reach` of it, into convex parts that each lie within `limit` of one
/// triangle: the distance to a triangle is a convex function, so that is known from a part's corners. Where
/// the cuts run decides only whether a bound is found, never whether it holds.
///
/// No bound is found where more than a few triangles are near; the caller has to cut the piece then. The
/// closest triangle of each point of `piece` must be within `reach` of it.
double cover_bound(const Corners& piece, const TriangleTree& to, double reach, double limit);

}  // namespace hermesh::validation
