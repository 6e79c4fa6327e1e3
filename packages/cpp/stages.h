// Voxelization by the public options, as several public functions have it.
#pragma once

#include "hermesh/voxelize.h"
#include "packages/cpp/inside.h"

namespace hermesh::v1 {

/// A voxelizer that was looked up, with its options checked.
struct HERMESH_INNER ChosenVoxelizer {
  const Voxelizer& voxelizer;
  hermesh::Options options;
};
/// @throws hermesh::Error for a name, option or value that there is not.
HERMESH_INNER ChosenVoxelizer choose(const VoxelizeOptions& options);

/// Edge of a voxel in world units. @throws hermesh::Error unless exactly one of resolution and voxel size is
/// given, within its range, and for a resolution of a mesh without extent.
HERMESH_INNER double voxel_size_of(const PolygonMesh& mesh, const VoxelizeOptions& options);

/// Voxelizes polygons as they are, checks first that they fit in memory, and notes what the level set cannot
/// show.
/// @throws hermesh::Error, hermesh::Cancelled
HERMESH_INNER LevelSet level_set_of(const PolygonMesh& mesh, double voxel_size,
                                    const VoxelizeOptions& options, const ChosenVoxelizer& chosen,
                                    RunContext& context);

/// Notes what of the polygons passes between the samples.
HERMESH_INNER void note_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set,
                                     const Voxelizer& voxelizer, RunContext& context);

}  // namespace hermesh::v1
