// The part of a soup's polygons that bounds its solid, without inner walls, buried parts and second copies.
#pragma once

#include "validation/solid.h"

namespace hermesh::validation {

struct OuterBoundary {
  /// Triangles with the solid on their back and its outside in front, for certain.
  MeshFile bounding;
  /// Those that bound it by one rule and do not by another, such as the wall of a void, or near a hole.
  MeshFile possible;
  double area = 0.0, possible_area = 0.0;  ///< world units
  /// Groups of triangles with a part in `bounding` that share points or meet one another.
  std::int64_t components = 0;
  double finest = 0.0;  ///< world units; how far the cut of a triangle that dives into the solid may be off
};

/// What triangle by triangle lies between inside and outside, a millionth of the box's diagonal off on both
/// sides. Where triangles that meet nothing but their neighbours hang together over edges with two sides, the
/// largest one speaks for all. Others are cut in four until the parts' middles and corners are of one mind
/// and their edges are below 1/32 of the diagonal, or below 1/256 of it: then the middle decides. Of
/// triangles that lie upon one another the one with the lowest number stands for all. @throws Cancelled.
OuterBoundary outer_boundary(const TriangleSoup& welded, const TriangleTree& tree, const Solid& solid,
                             const RunContext& context);

}  // namespace hermesh::validation
