// Parts of the mesh that do not bound the solid because the solid is on both of their sides: where parts of a
// model intersect, and walls of a cavity that was filled. Distances to them would be wrong. (Aldén 2011,
// §5.4, deletes the voxels near them instead.)
#pragma once

#include <vector>

#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/inside/signs.h"

namespace hermesh {

/// The parts of the mesh that do not bound the solid.
struct InteriorFaces {
  /// Triangles that are inner, in part or as a whole, ascending.
  std::vector<std::uint32_t> triangles;
  /// The outer pieces of those that are inner in part, in world units, and the triangle of each.
  PolygonMesh pieces;
  std::vector<std::uint32_t> parents;
  /// Blocks with a voxel that may be near one of them, by number, ascending.
  std::vector<std::uint32_t> blocks;
};

/// Finds the triangles, or parts of them, with the solid on both sides. Triangles near suspicious voxels are
/// cut along the lines in which others, or caps, cross them. A part between these lines counts as inner only
/// if that is certain: from just off either of its sides a free segment leads to a voxel inside, or, where no
/// voxel is seen, the winding number decides so. All other parts stay. The work grows with the number of
/// samples and triangles: where triangles cross one another more densely than once a sample, not all are cut
/// along every line, their uncertain parts stay, and a note reports that.
/// @param reach how far distances matter, in voxels
/// @param voxel_size in world units
/// @param winding the winding number if `soup` is part of a mesh; null if it is the whole mesh
/// @throws Cancelled.
InteriorFaces find_interior_faces(const IndexSoup& soup, const TriangleBins& bins, const Band& band,
                                  const Signs& signs, double reach, double voxel_size, RunContext& context,
                                  const WindingNumber* winding = nullptr);

}  // namespace hermesh
