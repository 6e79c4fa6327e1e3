// Bands far wider than the few voxels around the surface, up to a filled interior: triangles that look for
// their voxels would each look through a ball of that radius, so here every voxel looks for its triangle.
// Heavy (OpenVDB): include it from .cpp files.
#pragma once

#include <vector>

#include "algorithms/core/openvdb_trees.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// The triangles that bound the solid: those of the mesh, pieces of them, and caps of holes.
struct BoundaryTriangles {
  std::vector<Eigen::Vector3f> points;  ///< world units relative to the mesh's origin
  std::vector<Triangle> triangles;
  std::vector<std::int32_t> ids;  ///< the mesh's triangle that each is a part of, or −1
};

/// How far the band reaches on either side of the surface.
struct BandWidths {
  double exterior = 3.0, interior = 3.0;  ///< voxels
};

/// Widens the band of a level set whose values are right as far as `near` on either side, and whose leaves
/// hold all voxels nearer than that. The values beyond it become what they would have been had the band been
/// `wide` from the start; `nearest`, if not null, gets the numbers of the triangles. Index space has to be
/// voxels relative to the mesh's origin, whatever the grids' transforms say. The bytes are the same at any
/// thread count.
/// @throws Cancelled.
void widen_band(const BoundaryTriangles& boundary, double voxel_size, const BandWidths& near,
                const BandWidths& wide, openvdb::FloatGrid& distance, openvdb::Int32Grid* nearest,
                RunContext& context);

}  // namespace hermesh
