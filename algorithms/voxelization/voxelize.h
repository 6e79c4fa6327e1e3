// Our voxelizer as a library: distances with signs and, on request, the nearest triangle of each voxel. Heavy
// (OpenVDB): include it from .cpp files. hermesh_voxelizer.h has the same as a variant.
#pragma once

#include "algorithms/core/openvdb_trees.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"
#include "algorithms/voxelization/distance/wide_band.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"

namespace hermesh {

/// Options of voxelize().
struct VoxelizeOptions {
  double voxel_size = 1.0;     ///< world units
  double exterior_band = 3.0;  ///< voxels, at least 1
  double interior_band = 3.0;  ///< voxels, at least 1
  SignRule signs = SignRule::automatic;
  bool nearest = false;   ///< adds `Voxelization::nearest`
  bool boundary = false;  ///< adds `Voxelization::boundary`
};

/// The grids that voxelize() makes, on one lattice.
struct Voxelization {
  /// Distance in world units, negative inside, in a grid named "sdf", or "udf" without signs. Its transform
  /// scales by the voxel size and moves by the mesh's origin.
  openvdb::FloatGrid::Ptr distance;
  /// False without signs: none were requested, or the polygons have no inside.
  bool is_signed = true;
  /// The number of the mesh's nearest triangle (as triangulated() numbers them) for each voxel that is active
  /// in `distance`, or −1 if only the cap of a hole is near, in a grid named "triangle-id" with background
  /// −1. Null unless requested.
  openvdb::Int32Grid::Ptr nearest;
  /// The triangles that distances inside are measured to: the mesh's, numbered as triangulated() does,
  /// without those that are inner for certain, the outer pieces of those that are inner in part, and the caps
  /// of holes. Empty unless requested, and without signs.
  BoundaryTriangles boundary = {};
};

/// Computes the narrow band of distances to any polygons: in any order and orientation, twice, degenerate,
/// intersecting, open. Every voxel nearer to the surface than the band is wide is active, no other, and its
/// value is the distance to the nearest triangle that bounds the solid, right to 1e-5 voxel. A voxel on a
/// polygon is on the side that sample_side.h gives it; inside, its distance is kLeastDepth voxels, so that it
/// carries a sign. Without signs the exterior band's width counts. The bytes are the same at any thread count
/// and any level of vector code.
/// @throws Error as check_voxelization_fits(); Cancelled.
Voxelization voxelize(const PolygonMesh& mesh, const VoxelizeOptions& options, RunContext& context);

}  // namespace hermesh
