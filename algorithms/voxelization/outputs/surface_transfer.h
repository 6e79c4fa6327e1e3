// What the nearest triangle knows of each voxel's closest point: where it is, and the mesh's attributes
// there. Heavy (OpenVDB): include it from .cpp files.
#pragma once

#include <vector>

#include "algorithms/core/openvdb_trees.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// Which grids to make.
struct TransferRequest {
  bool closest_point = false;
  std::vector<const MeshAttribute*> attributes;
};

/// Makes grids over the voxels of `nearest` (the triangle of each, as triangulated() numbers them; voxels
/// that have none, −1, stay inactive), in the order of the request and with its transform, which is the voxel
/// size and the mesh's origin:
///
/// - "closest-point" (vec3s): relative to the mesh's origin, which is the grid's metadata "hermesh_origin"
/// (vec3d), so that far from the world's origin as little is lost as the mesh lost.
/// - Each attribute under its name ("attribute-NAME" where an output of the voxelizer is called NAME): floats
/// of points and corners with the closest point's barycentric weights, whole numbers from the corner with the
/// largest weight, those of polygons as they are. One component becomes a float or int32 grid, two a vec3s
/// grid whose z is 0, three a vec3s grid, and four a vec3s grid and a float grid "NAME-alpha". Normals (3
/// components, name "normal" or ending in "-normal") get unit length; where they cancel out, the triangle's
/// own is taken. Labels are kept as metadata "label_0", ….
///
/// Backgrounds are 0, and −1 for whole numbers. The bytes are the same at any thread count.
/// @throws Error for an attribute whose values are not finite or not as many as the mesh has elements;
/// Cancelled.
std::vector<openvdb::GridBase::Ptr> transfer_from_surface(const PolygonMesh& mesh,
                                                          const openvdb::Int32Grid& nearest,
                                                          double voxel_size, const TransferRequest& request,
                                                          RunContext& context);

/// Bytes that a voxel of the attribute's grids takes, all of them together.
std::size_t bytes_per_voxel(const MeshAttribute& attribute);

}  // namespace hermesh
