// Distances to the boundary of the solid instead of to all polygons.
#pragma once

#include <cstdint>

#include "algorithms/voxelization/distance/band.h"
#include "algorithms/voxelization/inside/interior_faces.h"
#include "algorithms/voxelization/inside/signs.h"

namespace hermesh {

/// Lowers the leaf's distances to `values`, and activates the voxels in `active`. Inactive voxels have the
/// reach, which is never less than an active voxel's distance.
void lower_distances(FloatLeaf& leaf, const float* values, const std::uint64_t* active);

/// Computes the distances of the voxels inside again without the faces that do not bound the solid. Works
/// leaf by leaf, since all new ones at once could take more memory than a small volume.
/// @param winding as for find_interior_faces()
/// @throws Cancelled
InteriorFaces leave_out_interior_faces(const IndexSoup& soup, TriangleBins& bins, const Signs& signs,
                                       BandWork work, Band& band, RunContext& context,
                                       const WindingNumber* winding = nullptr);

}  // namespace hermesh
