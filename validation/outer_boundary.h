// The part of a soup's polygons that bounds its solid, without inner walls, buried parts and duplicates.
#pragma once

#include "validation/solid.h"

namespace hermesh::validation {

/// The triangles of a mesh, or parts of them, that bound its solid.
struct OuterBoundary {
  MeshFile bounding;  ///< triangles that certainly have the solid behind and its outside in front of them
  /// Triangles that bound the solid by one rule but not by another, such as the wall of a void, or near a
  /// hole.
  MeshFile possible;
  double area = 0.0, possible_area = 0.0;  ///< world units
  /// Groups of triangles with a part in `bounding` that share points or intersect.
  std::int64_t components = 0;
  double finest = 0.0;  ///< largest error of the cut of a triangle that enters the solid, world units
};

/// Finds the triangles between inside and outside, both evaluated at a millionth of the box's diagonal off
/// the triangle. If triangles that intersect only their neighbours are connected by edges with two sides, the
/// largest one decides for all. Others are cut in four until a part's middle and corners agree and its edges
/// are below 1/32 of the diagonal, or its edges are below 1/256 of it: then the middle decides. Of coincident
/// triangles the one with the lowest number is used. @throws Cancelled.
OuterBoundary outer_boundary(const TriangleSoup& welded, const TriangleTree& tree, const Solid& solid,
                             const RunContext& context);

}  // namespace hermesh::validation
