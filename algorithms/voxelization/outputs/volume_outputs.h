// All outputs of a voxelization (Aldén 2011, chapter 5): distances, closest points, fog, attributes, Hermite
// data. Heavy (OpenVDB): include it from .cpp files.
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

/// The requested volumes.
struct VolumeRequest {
  bool sdf = false;             ///< "sdf", or "udf" without signs
  bool udf = false;             ///< "udf": distance without sign
  bool triangle_id = false;     ///< "triangle-id": number of the nearest triangle, see below
  bool closest_point = false;   ///< "closest-point", see VolumeOutputs::grids
  bool fog = false;             ///< "fog": 1 inside, a ramp over the band, 0 outside
  bool fog_exterior = false;    ///< the ramp covers both bands, not only the interior one (§5.6)
  bool hermite = false;         ///< exact edge hits with the polygons' normals; implies "sdf"
  bool all_attributes = false;  ///< see VolumeOutputs::grids
  std::vector<std::string> attributes = {};  ///< names of single ones
  /// The number in "triangle-id" of each of triangulated()'s triangles, such as MeshFile::triangle_numbers;
  /// empty if that is its index.
  std::vector<std::uint32_t> triangle_numbers = {};

  /// Returns true if a mesh must be read with its attributes.
  bool any_attributes() const { return all_attributes || !attributes.empty(); }
  /// Returns true if only "sdf" is requested, for which voxelize() checks the memory itself.
  bool only_sdf() const;
};

/// Parses a list such as "sdf,closest-point,attribute:uv"; "attributes" means all of them.
/// @throws Error for an unknown name; the message lists the known ones.
VolumeRequest parse_volume_request(const std::string& list);

/// The requested volumes.
struct VolumeOutputs {
  /// Grids of standard types only, each with the voxel size and the mesh's origin as transform:
  /// - float "sdf" (level set), "udf" and "fog" (fog volume, background 0, active where above 0);
  /// - int32 "triangle-id" (−1 if only the cap of a hole is near);
  /// - vec3s "closest-point", relative to the mesh's origin, which is the grid's metadata "hermesh_origin"
  /// (vec3d), so
  ///   that far from the world's origin no more is lost than the mesh lost;
  /// - each attribute under its name ("attribute-NAME" if an output of the voxelizer is called NAME): floats
  ///   of points and corners with the closest point's barycentric weights, integers from the corner with the
  ///   largest weight, those of polygons unchanged. One component becomes a float or int32 grid, two a vec3s
  ///   grid whose z is 0, three a vec3s grid, and four a vec3s grid and a float grid "NAME-alpha". Normals (3
  ///   components, name "normal" or ending in "-normal") get unit length; if they cancel, the triangle's own
  ///   is used. Labels become metadata "label_0", …. Backgrounds are 0, and −1 for integers.
  std::vector<openvdb::GridBase::Ptr> grids;
  std::optional<FloatHermite> hermite;
  std::size_t active_voxels = 0;  ///< number of the band's active voxels
};

/// Makes the requested volumes by one voxelization; `options.nearest` is ignored. The bytes are the same at
/// any thread count.
/// @throws Error as voxelize() does, for an attribute that the mesh does not have or that has a wrong number
/// of values or one that is not finite, for fog or Hermite data without signs, and for more memory than is
/// available; Cancelled.
VolumeOutputs make_volume_outputs(const PolygonMesh& mesh, const VoxelizeOptions& options,
                                  const VolumeRequest& request, RunContext& context);

/// A voxelizer: a function of the options, which include Voxelization::nearest.
using VoxelizeBy = std::function<Voxelization(const VoxelizeOptions&)>;
/// Makes these volumes from another voxelizer's distances and triangles, with its options.
/// @throws Error and Cancelled also as `by` does.
VolumeOutputs make_volume_outputs(const PolygonMesh& mesh, const VoxelizeOptions& options,
                                  const VolumeRequest& request, const VoxelizeBy& by, RunContext& context);

/// Returns the path of the Hermite data: OUT.hermite.vdb for OUT.vdb.
std::filesystem::path hermite_path(const std::filesystem::path& path);

/// Writes all grids into one file, Hermite data into hermite_path(): OpenVDB's own tools would refuse the
/// whole file for one grid of an unknown type. Both files are written completely, or neither.
/// @throws Error if a path cannot be written.
void write_volume_outputs(const std::filesystem::path& path, const VolumeOutputs& outputs,
                          RunContext& context);

}  // namespace hermesh
