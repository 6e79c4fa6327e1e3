// What the commands share that make volumes of polygons.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/variant.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/remesh/thin_parts.h"
#include "experiments/cli/session.h"
#include "experiments/pipeline.h"

namespace hermesh::cli {

struct Paths {
  std::string in, out;
};

struct VoxelizeArguments {
  std::optional<double> voxel_size;  ///< world units
  std::optional<std::int64_t> resolution;
  std::optional<std::string> like;                  ///< file of a volume whose lattice is taken
  bool any_size = false;                            ///< whether the mesh may be smaller than a voxel
  double exterior_band = 3.0, interior_band = 3.0;  ///< voxels
  std::string voxelizer = "hermesh";
  std::optional<std::string> signs;  ///< value of the voxelizer's option `signs`, which it is a shorthand for
  std::vector<std::string> options;  ///< key=value
  std::optional<std::string> thin;   ///< keep, drop or refuse; none: keep where that is possible
};

/// Adds the input and the output, and registers them as files of these kinds (session.h); `many` lets the
/// command run on many inputs.
void add_paths(CLI::App& command, Session& session, Paths& paths, const std::string& in, FileKind in_kind,
               const std::string& out, FileKind out_kind, bool many = false);
/// Adds the options of VoxelizeArguments, with `with_like` also `--like`, which takes the lattice of a
/// volume. Returns the group of those that say how large a voxel is, of which exactly one has to be given.
CLI::App* add_voxelize_options(CLI::App& command, VoxelizeArguments& arguments, bool with_like = false);

/// Options from texts key=value, checked against `declared`. @throws Error also for an option that is given
/// twice.
Options parse_options(const std::string& variant, const std::vector<OptionSpec>& declared,
                      const std::vector<std::string>& texts);
/// Looks the voxelizer up and checks its options. @throws UsageError for a name or an option that there is
/// not.
ChosenVoxelizer choose_voxelizer(const VoxelizeArguments& arguments);

/// Reads a mesh to voxelize, in world units (session.scale): its quads are cut along the better diagonal.
/// @throws Error if it cannot be read.
PolygonMesh read_polygons(const std::string& path, Session& session, const ReadOptions& options = {});

/// Multiplies all points, in double precision, so that nothing is rounded twice.
void scale_points(MeshFile& file, double factor);

/// What the chosen voxelizer gets, with the voxel size in world units that the arguments ask for.
/// @throws Error if a resolution is asked of a mesh without extent, or if the mesh is smaller than a voxel.
VoxelizeRecipe recipe_of(const PolygonMesh& mesh, const std::string& file, const VoxelizeArguments& arguments,
                         const ChosenVoxelizer& chosen);

/// Voxelizes the mesh of `file` and prints a line of summary. @throws Error as
/// voxelization_input() and the voxelizer do.
LevelSet voxelize(const PolygonMesh& mesh, const std::string& file, const VoxelizeArguments& arguments,
                  const ChosenVoxelizer& chosen, Session& session);

/// Returns what becomes of thin parts: what was asked for, or else to keep them where that is possible.
/// @throws UsageError if thin parts cannot be kept but that was asked for
ThinRule thin_rule(const VoxelizeArguments& arguments, const ChosenVoxelizer& chosen, double isovalue = 0.0);

/// Voxelizes the mesh of `file` as voxelize() does and samples its polygons, with thin parts as thin_rule()
/// says, and notes what was thickened.
PolygonSolid sample_polygons(const PolygonMesh& mesh, const std::string& file,
                             const VoxelizeArguments& arguments, const ChosenVoxelizer& chosen,
                             Session& session);

/// Notes what of the polygons was thickened; nothing if `thin` is empty.
void note_thin_parts(const std::optional<ThinParts>& thin, double voxel_size, Session& session);

/// Notes what of the polygons passes between the samples.
void note_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set, const ChosenVoxelizer& chosen,
                       Session& session);

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

void print_summary(const Session& session, const std::string& line);
void print_voxelized(Session& session, const std::string& file, const VoxelizationInput& input,
                     std::size_t active_voxels, const std::string& voxelizer, double seconds);

inline constexpr const char* kMeshIn =
    "Mesh: .ply .obj .off .stl .glb .gltf .3mf, also with .gz, or - for the standard input";
inline constexpr const char* kMeshOut =
    "Mesh: .ply .obj .off .stl .glb .gltf .3mf, also with .gz, or - for the standard output";

}  // namespace hermesh::cli
