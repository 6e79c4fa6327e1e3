// Bands much wider than a few voxels around the surface, up to a filled interior. Here every voxel searches
// for its nearest triangle, because a search from the triangles would cover a ball of the band's radius for
// each. Heavy (OpenVDB): include it from .cpp files.
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
  std::vector<std::int32_t> ids;  ///< the mesh's triangle that each is part of; −1: part of a cap
};

/// Widths of the band on either side of the surface.
struct BandWidths {
  double exterior = 3.0, interior = 3.0;  ///< voxels
};

/// Widens the band of a level set to `wide`. Its values must be correct as far as `near` on either side, and
/// its leaves must contain all voxels within that distance. `nearest`, if not null, is set to the numbers of
/// the nearest triangles. Index space must be voxels relative to the mesh's origin, whatever the grids'
/// transforms. The bytes are the same at any thread count.
/// @throws Cancelled.
void widen_band(const BoundaryTriangles& boundary, double voxel_size, const BandWidths& near,
                const BandWidths& wide, openvdb::FloatGrid& distance, openvdb::Int32Grid* nearest,
                RunContext& context);

}  // namespace hermesh
