// The part of a soup's polygons that bounds its solid, without inner walls, buried parts and duplicates.
#pragma once

#include "validation/solid.h"

namespace hermesh::validation {

/// The triangles of a mesh, or parts of them, that bound its solid.
struct OuterBoundary {
  MeshFile bounding;  ///< triangles that certainly have the solid behind them and the outside in front
  /// Triangles that bound the solid by one rule but not by another, such as the wall of a void, or near a
  /// hole.
  MeshFile possible;
  double area = 0.0, possible_area = 0.0;  ///< world units
  /// Number of groups, connected by shared vertices or intersections, of triangles with a part in `bounding`.
  std::int64_t components = 0;
  double finest = 0.0;  ///< resolution at which triangles that cross the boundary are cut, world units
};

/// Finds the triangles that separate inside from outside, both evaluated at a millionth of the box's diagonal
/// in front of and behind the triangle. Triangles that intersect only their neighbours are grouped across
/// edges of two triangles, and the largest one decides for its group. Every other triangle is subdivided into
/// four until the centroid and the corners of a part agree and its edges are at most 1/32 of the diagonal, or
/// until its edges are at most 1/256 of it; then the centroid decides. Of coincident triangles the one with
/// the lowest index is used. @throws Cancelled.
OuterBoundary outer_boundary(const TriangleSoup& welded, const TriangleTree& tree, const Solid& solid,
                             const RunContext& context);

}  // namespace hermesh::validation
