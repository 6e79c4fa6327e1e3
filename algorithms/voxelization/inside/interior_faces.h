// Parts of the mesh that do not bound the solid because the solid is on both of their sides: where parts of a
// model intersect, and walls of a cavity that was filled. Distances to them would be wrong, and voxels near
// them stray. (Aldén 2011, §5.4, deletes the voxels instead.)
#pragma once

#include <vector>

#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/inside/signs.h"

namespace hermesh {

/// What of the mesh does not bound the solid.
struct InteriorFaces {
  /// Triangles that are inner, in part or altogether, ascending.
  std::vector<std::uint32_t> triangles;
  /// The outer pieces of those that are inner in part, in world units, and for each the triangle that it is a
  /// piece of.
  PolygonMesh pieces;
  std::vector<std::uint32_t> parents;
  /// Blocks with a voxel that may be near one of them, by number, ascending.
  std::vector<std::uint32_t> blocks;
};

/// Finds the triangles, or parts of them, with the solid on both sides. Triangles near places where some may
/// be inner are cut along the lines in which others, or caps, cross them. What is left between these lines
/// counts as inner only where that is certain: from just off either of its sides a straight way leads to a
/// voxel inside without meeting a triangle. Everything else stays. The work grows with the number of samples
/// and triangles: where triangles cross one another more densely than once a sample, not all are cut along
/// every line, what may be on both sides of one stays, and a note says so. `reach` is how far distances
/// matter, in voxels; `voxel_size` is in world units.
/// @throws Cancelled.
InteriorFaces find_interior_faces(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                                  const Signs& signs, double reach, double voxel_size, RunContext& context);

}  // namespace hermesh
