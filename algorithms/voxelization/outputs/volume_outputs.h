// Everything that a voxelization can put out (Aldén 2011, chapter 5): distances, closest points, fog,
// attributes, Hermite data. Heavy (OpenVDB): include it from .cpp files.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/openvdb_trees.h"
#include "algorithms/hermite/sparse_hermite.h"
#include "algorithms/voxelization/voxelize.h"

namespace hermesh {

/// Which volumes to make.
struct VolumeRequest {
  bool sdf = false;             ///< "sdf", or "udf" where there are no signs
  bool udf = false;             ///< "udf": distance without sign
  bool triangle_id = false;     ///< "triangle-id": number of the nearest triangle, see below
  bool closest_point = false;   ///< "closest-point", see surface_transfer.h
  bool fog = false;             ///< "fog": 1 inside, a ramp over the band, 0 outside
  bool fog_exterior = false;    ///< the ramp lies over both bands, not the interior one alone (§5.6)
  bool hermite = false;         ///< exact edge hits with the polygons' normals; brings "sdf" along
  bool all_attributes = false;  ///< see surface_transfer.h
  std::vector<std::string> attributes = {};  ///< names of single ones
  /// The number that "triangle-id" gives to each of triangulated()'s triangles, such as
  /// MeshFile::triangle_numbers; empty where that is its place there.
  std::vector<std::uint32_t> triangle_numbers = {};

  /// Whether a mesh must be read with its attributes.
  bool any_attributes() const { return all_attributes || !attributes.empty(); }
  /// Whether nothing but "sdf" is asked for, for which voxelize() checks the memory by itself.
  bool only_sdf() const;
};

/// Parses a list such as "sdf,closest-point,attribute:uv"; "attributes" stands for all of them.
/// @throws Error for a name that there is not; the sentence lists those that there are.
VolumeRequest parse_volume_request(const std::string& list);

/// The volumes that were asked for.
struct VolumeOutputs {
  /// Grids of standard types only, each with the voxel size and the mesh's origin as transform: float "sdf"
  /// (level set), "udf" and "fog" (fog volume, background 0, active where above 0), int32 "triangle-id" (−1
  /// where only the cap of a hole is near), vec3s "closest-point", attributes.
  std::vector<openvdb::GridBase::Ptr> grids;
  std::optional<FloatHermite> hermite;
  std::size_t active_voxels = 0;  ///< number of the band's active voxels
};

/// Makes the volumes that are asked for by one voxelization. `options.nearest` is set as the request needs
/// it. The bytes are the same at any thread count.
/// @throws Error as voxelize() does, for an attribute that the mesh does not have, for fog or Hermite data
/// where there are no signs, and for more memory than there is; Cancelled.
VolumeOutputs make_volume_outputs(const PolygonMesh& mesh, const VoxelizeOptions& options,
                                  const VolumeRequest& request, RunContext& context);

/// How a voxelization comes about: as the options say, with Voxelization::nearest where they ask for it.
using VoxelizeBy = std::function<Voxelization(const VoxelizeOptions&)>;
/// Makes those volumes from another voxelizer's distances and triangles. `options` are what it works by.
/// @throws Error and Cancelled also as `by` does.
VolumeOutputs make_volume_outputs(const PolygonMesh& mesh, const VoxelizeOptions& options,
                                  const VolumeRequest& request, const VoxelizeBy& by, RunContext& context);

/// The path of the Hermite data beside the other grids: OUT.hermite.vdb for OUT.vdb.
std::filesystem::path hermite_path(const std::filesystem::path& path);

/// Writes all grids into one file, Hermite data into hermite_path(): one grid of a type that OpenVDB's own
/// tools do not know would make them refuse the whole file. Both files are written aside and renamed, both or
/// neither.
/// @throws Error if a path cannot be written.
void write_volume_outputs(const std::filesystem::path& path, const VolumeOutputs& outputs,
                          RunContext& context);

}  // namespace hermesh
