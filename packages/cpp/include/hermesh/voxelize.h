// hermesh::voxelizer: polygons to sparse volumes (chapter 5 of the thesis).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "hermesh/mesh.h"
#include "hermesh/options.h"
#include "hermesh/volume.h"

namespace hermesh::HERMESH_V1 {

/// Treatment of walls, wires and open sheets that are thinner than the voxels can show.
enum class Thin {
  keep,   ///< thickened until they show, with a note
  drop,   ///< lost, with a note
  refuse  ///< an error
};

/// Options of voxelize(), as of `hermesh voxelize`. Exactly one of resolution, voxel_size and like must be
/// given.
struct VoxelizeOptions {
  std::optional<std::int64_t> resolution = {};  ///< voxels along the longest side of the mesh, at least 1
  std::optional<double> voxel_size = {};        ///< world units, above 0
  Volume like = {};                             ///< the new volume shares its lattice
  double exterior_band = 3.0;                   ///< width of the band outside, voxels, at least 1
  double interior_band = 3.0;                   ///< width of the band inside, voxels, at least 1
  std::string voxelizer = "hermesh";            ///< one of voxelizers()
  Options options = {};                         ///< of the voxelizer, such as {"signs", "winding-number"}
  /// Of remesh(), combine() and fracture(); none: keep where possible, i.e. with the voxelizer hermesh, signs
  /// and the isovalue 0. voxelize() always drops thin parts.
  std::optional<Thin> thin = {};
};

/// Returns the available voxelizers.
HERMESH_API std::vector<MethodInfo> voxelizers();

/// Returns the level set "sdf" of any polygons, closed or not ("udf", without signs, if the option `signs` is
/// "unsigned"). Adds a note if surface is lost between the samples. The same bytes at any number of threads.
/// @snippet main.cpp volume
/// @throws Error for a mesh without polygons or extent, a size that does not fit in memory, and unknown
/// options; Cancelled.
HERMESH_API Volume voxelize(const Mesh& mesh, const VoxelizeOptions& options, Context& context);

/// Returns several volumes of one voxelization, by the voxelizers hermesh and thesis, in the order of the
/// program's file.
/// @param grids comma-separated names: sdf, udf, fog, closest-point, triangle-id, attributes, attribute:NAME
/// @param fog_exterior true if the fog's ramp covers both bands, not only the interior one
/// @throws Error as voxelize(), and for an unknown name; Cancelled.
HERMESH_API std::vector<Volume> voxelize_grids(const Mesh& mesh, const std::string& grids,
                                               const VoxelizeOptions& options, Context& context,
                                               bool fog_exterior = false);

}  // namespace hermesh::HERMESH_V1
