// Our voxelizer as a library: distances with signs and, where asked for, which triangle is nearest to each
// voxel. Heavy (OpenVDB): include it from .cpp files. hermesh_voxelizer.h has the same as a variant.
#pragma once

#include <openvdb/openvdb.h>

#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// How a voxel's side is found.
enum class SignRule {
  automatic,   ///< flood fill, and winding numbers where the flood leaks in through a hole; says so in a note
  flood_fill,  ///< inside is what cannot be reached from infinity: any orientation, cavities filled (Aldén
               ///< §5.3)
  winding_number,  ///< inside is where the generalised winding number is above ½: keeps cavities, closes
                   ///< holes
  none             ///< no sign: distance alone
};

struct VoxelizeOptions {
  double voxel_size = 1.0;     ///< world units
  double exterior_band = 3.0;  ///< voxels, at least 1
  double interior_band = 3.0;  ///< voxels, at least 1
  SignRule signs = SignRule::automatic;
  bool nearest = false;  ///< also the nearest triangles
};

struct Voxelization {
  /// World units, negative inside; a grid named "sdf", or "udf" without signs. Its transform is the voxel
  /// size and the mesh's origin.
  openvdb::FloatGrid::Ptr distance;
  bool is_signed = true;
  /// For each voxel that is active in `distance` the number of the mesh's nearest triangle (as triangulated()
  /// numbers them), or −1 where only the cap of a hole is near; a grid named "triangle-id" with background
  /// −1.
  openvdb::Int32Grid::Ptr nearest;
};

/// A voxel on a polygon is on the side that sample_side.h gives it; inside, its distance is kLeastDepth voxels, so that it
/// carries a sign. Every voxel nearer to the surface than the band is wide is active, no other, and its value is the distance
/// to the nearest triangle that bounds the solid, right to 1e-5 voxel. Without signs the exterior band's width counts.
/// Polygons may come in any order and orientation, twice, degenerate, intersecting, open. The same bytes at any thread count
/// and any level of vector code.
/// @throws Error as check_voxelization_fits(); Cancelled.
Voxelization voxelize(const PolygonMesh& mesh, const VoxelizeOptions& options, RunContext& context);

}  // namespace hermesh
