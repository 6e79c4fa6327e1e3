// The part of a soup's polygons that bounds its solid, without inner walls, buried parts and second copies.
#pragma once

#include "validation/solid.h"

namespace hermesh::validation {

/// The triangles of a mesh, or parts of them, that bound its solid.
struct OuterBoundary {
  /// Triangles with the solid on their back and its outside in front, for certain.
  MeshFile bounding;
  /// Triangles that bound the solid by one rule and do not by another, such as the wall of a void, or near a
  /// hole.
  MeshFile possible;
  double area = 0.0, possible_area = 0.0;  ///< world units
  /// Groups of triangles with a part in `bounding` that share points or meet one another.
  std::int64_t components = 0;
  double finest = 0.0;  ///< how far the cut of a triangle that dives into the solid may be off, world units
};

/// Finds, triangle by triangle, what lies between inside and outside, each asked for a millionth of the box's
/// diagonal off the triangle. Where triangles that meet nothing but their neighbours hang together over edges
/// with two sides, the largest one decides for all. Others are cut in four until a part's middle and corners
/// agree and its edges are below 1/32 of the diagonal, or its edges are below 1/256 of it: then the middle
/// decides. Of triangles that lie upon one another the one with the lowest number stands for all. @throws
/// Cancelled.
OuterBoundary outer_boundary(const TriangleSoup& welded, const TriangleTree& tree, const Solid& solid,
                             const RunContext& context);

}  // namespace hermesh::validation
