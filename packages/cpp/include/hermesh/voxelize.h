// hermesh::voxelizer: polygons to sparse volumes (chapter 5 of the thesis).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hermesh/context.h"
#include "hermesh/export.h"
#include "hermesh/mesh.h"
#include "hermesh/options.h"
#include "hermesh/volume.h"

namespace hermesh::HERMESH_V1 {

/// How polygons become a volume; what `hermesh voxelize` takes. One of resolution, voxel_size and like must
/// be given.
struct VoxelizeOptions {
  std::optional<std::int64_t> resolution = {};  ///< voxels along the longest side of the mesh, at least 1
  std::optional<double> voxel_size = {};        ///< world units, above 0
  Volume like = {};                             ///< whose lattice the new volume shares
  double exterior_band = 3.0;                   ///< voxels outside that have their distance, at least 1
  double interior_band = 3.0;                   ///< voxels inside
  std::string voxelizer = "hermesh";            ///< one of voxelizers()
  Options options = {};                         ///< of the voxelizer, such as {"signs", "winding-number"}
};

/// The voxelizers that there are.
HERMESH_API std::vector<MethodInfo> voxelizers();

/// The level set "sdf" of any polygons, closed or not ("udf", without signs, where the option `signs` is
/// "unsigned"). What of the surface passes between the samples is a note. The same bytes at any number of
/// threads.
/// @snippet main.cpp volume
/// @throws Error for a mesh without polygons or extent, a size that does not fit in memory, and options that
/// there are not; Cancelled.
HERMESH_API Volume voxelize(const Mesh& mesh, const VoxelizeOptions& options, Context& context);

/// Several volumes of one voxelization, by the voxelizers hermesh and thesis, in the order of the program's
/// file: `grids` are names with commas between them, of sdf, udf, fog, closest-point, triangle-id,
/// attributes, attribute:NAME. With `fog_exterior` the fog's ramp lies over both bands, not the interior one
/// alone.
/// @throws Error as voxelize(), and for a name that there is not; Cancelled.
HERMESH_API std::vector<Volume> voxelize_grids(const Mesh& mesh, const std::string& grids,
                                               const VoxelizeOptions& options, Context& context,
                                               bool fog_exterior = false);

}  // namespace hermesh::HERMESH_V1
