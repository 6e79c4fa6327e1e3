// Options and steps of the commands that convert polygons to volumes and volumes to meshes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "experiments/cli/session.h"
#include "experiments/pipeline.h"

namespace hermesh::cli {

inline constexpr const char* kMeshIn =
    "Mesh: .ply .obj .off .stl .glb .gltf .3mf, also with .gz, or - for the standard input";
inline constexpr const char* kMeshOut =
    "Mesh: .ply .obj .off .stl .glb .gltf .3mf, also with .gz, or - for the standard output";

struct VoxelizeArguments {
  std::optional<double> voxel_size;                 ///< world units
  std::optional<std::int64_t> resolution;           ///< voxels along the longest side of the mesh; 0: auto
  std::optional<std::string> like;                  ///< .vdb file whose lattice the volume shares
  bool any_size = false;                            ///< true if the mesh may be smaller than a voxel
  double exterior_band = 3.0, interior_band = 3.0;  ///< voxels
  std::string voxelizer = "hermesh";
  std::optional<std::string> signs;  ///< short for the voxelizer's option `signs`
  std::vector<std::string> options;  ///< key=value
  std::optional<std::string> thin;   ///< keep, drop or refuse; none: keep if possible
  ChosenVoxelizer chosen = {};       ///< set by choose()

  /// Looks up the voxelizer and checks its options. @throws UsageError for an unknown name, option or value.
  void choose();
  /// Returns the requested treatment of thin parts, or to keep them if possible. @throws UsageError if they
  /// cannot be preserved although that was requested.
  ThinRule thin_rule(double isovalue = 0.0) const;
  /// Returns the parameters of the voxelizer, with the voxel size in world units.
  /// @throws Error if the mesh of `file` is smaller than a voxel, or if it has no extent and a resolution was
  /// requested.
  VoxelizeRecipe recipe(const PolygonMesh& mesh, const std::string& file, double isovalue = 0.0) const;
};

struct ExtractorArguments {
  std::string extractor;             ///< set by add_extractor_options()
  std::vector<std::string> options;  ///< key=value
  ChosenExtractor chosen = {};       ///< set by choose()

  /// Looks up the extractor and checks its options. @throws UsageError for an unknown name, option or value.
  void choose();
};

/// Adds the options of VoxelizeArguments, --like only if `with_like`, and `auto` as a resolution, which is
/// then the default, only if `with_auto`. Returns the group of those that determine the voxel size, exactly
/// one of which is required unless there is a default.
CLI::App* add_voxelize_options(CLI::App& command, VoxelizeArguments& arguments, bool with_like = false,
                               bool with_auto = false);
void add_extractor_options(CLI::App& command, ExtractorArguments& arguments, const std::string& fallback);

/// Scales the points of a file to world units: by session.scale, and from the unit that the file states to
/// that of the session, which becomes the file's if it is unknown.
void to_world_units(MeshFile& file, Session& session);
/// Reads a mesh to voxelize, in world units, with quads cut along the better diagonal.
/// @throws Error if it cannot be read.
PolygonMesh read_polygons(const std::string& path, Session& session, const ReadOptions& options = {});
/// Returns the polygons of a file that was read from `path`, as read_polygons() does.
PolygonMesh polygons_of(MeshFile&& file, const std::string& path, Session& session);

/// Converts polygons to a solid (make_solid()), with a line of summary. @param name of the mesh
MadeSolid make_solid(const PolygonMesh& mesh, const std::string& name, const VoxelizeArguments& arguments,
                     Session& session);

/// Returns the length that an option gives in world units.
/// @param text a number, with % or a unit behind it
/// @param metres length of the world unit; 0 if it is unknown
/// @param diagonal of the bounding box of the polygons, world units
/// @throws UsageError
double length_in_world_units(const std::string& option, const std::string& text, double metres,
                             double diagonal);
/// As length_in_world_units(), for lengths greater than 0.
double positive_length(const std::string& option, const std::string& text, double metres, double diagonal);

void print_voxelized(Session& session, const std::string& file, const PolygonMesh& mesh,
                     const VoxelizationFacts& facts, const std::string& voxelizer);
void print_extracted(Session& session, const PolygonMesh& mesh, const std::string& extractor, double seconds);
/// Adds statistics of thickened parts to the JSON document; they are 0 if no part was thickened.
void report_thin_parts(const std::optional<ThinParts>& thin, Session& session);

/// Adds --attributes of commands that make meshes from polygons.
void add_attributes_option(CLI::App& command, std::string& attributes);
/// Transfers the attributes of polygons to a mesh that was made from them. Linear time.
void carry_attributes(const PolygonMesh& polygons, PolygonMesh& mesh, Session& session);

/// Adds the command join.
void add_join(CLI::App& app, Session& session);

/// Writes the mesh with the unit of its coordinates. Adds a note if the unit of the input is not the
/// millimetre and the format stores none.
void write_output(const std::string& path, const PolygonMesh& mesh, Session& session);

}  // namespace hermesh::cli
