// Bands far wider than the few voxels around the surface, up to a filled interior: triangles that look for
// their voxels would each look through a ball of that radius, so here every voxel looks for its triangle.
// Heavy (OpenVDB): include it from .cpp files.
#pragma once

#include <openvdb/openvdb.h>

#include <vector>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// What bounds the solid.
struct BoundaryTriangles {
  std::vector<Eigen::Vector3f> points;  ///< world units relative to the mesh's origin
  std::vector<Triangle> triangles;
  std::vector<std::int32_t> ids;  ///< of the mesh's triangle that each is or is of, −1 where there is none
};

struct BandWidths {
  double exterior = 3.0, interior = 3.0;  ///< voxels
};

/// Widens the band of a level set whose values are right as far as `near` on either side, and whose leaves
/// hold all voxels nearer than that. The values beyond it become what they would have been had the band been
/// `wide` from the start; `nearest`, if not null, gets the numbers of the triangles. The grids' transforms
/// are not looked at. The same bytes at any thread count. @throws Cancelled.
void widen_band(const BoundaryTriangles& boundary, double voxel_size, const BandWidths& near,
                const BandWidths& wide, openvdb::FloatGrid& distance, openvdb::Int32Grid* nearest,
                RunContext& context);

}  // namespace hermesh
