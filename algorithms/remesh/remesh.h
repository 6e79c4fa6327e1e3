// Conversions at a voxel size: polygons to a volume or a solid, a volume to a mesh, and polygons to a mesh.
// A method is a table entry (core/variant.h) with its checked options.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "algorithms/core/variant.h"
#include "algorithms/extraction/volume_ends.h"
#include "algorithms/remesh/offset_solid.h"
#include "algorithms/remesh/thin_parts.h"

namespace hermesh {

using GivenOptions = std::map<std::string, std::string>;

struct ChosenVoxelizer {
  Voxelizer voxelizer;
  Options options;
};
struct ChosenExtractor {
  Extractor extractor;
  Options options;
};

/// Looks a method up. @throws Error for an unknown name, option or value.
ChosenVoxelizer choose(std::span<const Voxelizer> table, const std::string& name,
                       const GivenOptions& given = {});
ChosenExtractor choose(std::span<const Extractor> table, const std::string& name,
                       const GivenOptions& given = {});

/// Parameters of a voxelization.
struct VoxelizeRecipe {
  ChosenVoxelizer chosen = {};
  double resolution = 100.0;              ///< voxels along the longest side of the polygons' box
  std::optional<double> voxel_size = {};  ///< world units, instead of a resolution
  double exterior_band = 3.0;             ///< voxels
  double interior_band = 3.0;             ///< voxels
  ThinRule thin = ThinRule::drop;         ///< of make_solid() and remesh()
  std::optional<Offset> offset = {};      ///< of remesh(), where thin parts need no rule then
};

/// Parameters of an extraction.
struct ExtractRecipe {
  ChosenExtractor chosen = {};
  double isovalue = 0.0;  ///< in the units of the volume's values
  /// Treatment of a surface that runs into the end of the data; none for level sets of polygons, which have
  /// no ends.
  std::optional<Ends> ends = {};
  const AdaptivityField* field = nullptr;  ///< as in ExtractionInput, like the two below
  const SparseHermite<EdgeCrossing>* hermite = nullptr;
  bool written_in_single = false;
  /// File that the mesh is written to; its precision must suffice (io/written_precision.h). Empty: none.
  std::filesystem::path out = {};
};

/// Returns the voxel size in world units. 0 or not finite for a resolution of a mesh without extent, which
/// voxelizers reject.
double voxel_size_of(const VoxelizeRecipe& recipe, const PolygonMesh& mesh);
VoxelizationInput voxelization_input(const PolygonMesh& mesh, const VoxelizeRecipe& recipe,
                                     RunContext& context);

/// Returns the reason why a shell cannot preserve thin parts of polygons; null if it can.
const char* reason_to_drop_thin_parts(const ChosenVoxelizer& chosen, double isovalue = 0.0);
/// Returns the options of a voxelizer that preserve open sheets, unless they are determined by `given`.
GivenOptions with_open_sheets(const std::string& voxelizer, GivenOptions given);

/// Converts polygons to a level set, in which thin parts are lost. @throws as the voxelizer.
LevelSet voxelize(const PolygonMesh& mesh, const VoxelizeRecipe& recipe, RunContext& context);

/// Statistics of a voxelization.
struct VoxelizationFacts {
  std::size_t voxels = 0;   ///< active ones
  double voxel_size = 0.0;  ///< world units
  double seconds = 0.0;
};

struct MadeLevelSet : VoxelizationFacts {
  LevelSet level_set;
};
/// Converts polygons to a level set, as voxelize(), after a check that it fits in memory. A note states lost
/// thin parts if the recipe drops them.
/// @throws Error for more memory than is available; as the voxelizer; Cancelled
MadeLevelSet make_level_set(const PolygonMesh& mesh, const VoxelizeRecipe& recipe, RunContext& context);

struct MadeSolid : VoxelizationFacts, PolygonSolid {};
/// Converts polygons to a level set with Hermite data. Thin parts are treated by the rule of the recipe; a
/// note states their share.
/// @throws as make_level_set() and solid_of()
MadeSolid make_solid(const PolygonMesh& mesh, const VoxelizeRecipe& recipe, RunContext& context);

/// Converts a volume to a mesh. @param source the polygons that the volume was made from; null if unknown
/// @throws as the extractor; Error if the file's precision does not suffice
EndedMesh extract(const LevelSet& volume, const PolygonMesh* source, const ExtractRecipe& recipe,
                  RunContext& context);
/// Converts a volume to a mesh with polygons, as extract(). Adds a note if the surface runs into the end of
/// the data. @throws Error also for an empty mesh, with the reason
PolygonMesh extract_surface(const LevelSet& volume, const PolygonMesh* source, const ExtractRecipe& recipe,
                            RunContext& context);

struct Remeshed : VoxelizationFacts {
  PolygonMesh mesh;
  std::optional<ThinParts> thin;       ///< none if no part was thickened
  std::optional<OffsetErrors> offset;  ///< of the mesh, if the recipe has an offset
  double extract_seconds = 0.0;
};
/// Converts polygons to a level set and back to a mesh. Notes state thickened or lost thin parts, and that
/// the mesh has come apart.
/// @throws as make_solid() and extract_surface()
Remeshed remesh(const PolygonMesh& mesh, const VoxelizeRecipe& voxelizing, const ExtractRecipe& extracting,
                RunContext& context);

/// Adds a note if a mesh has many more components than the polygons that it was made from. Linear time and
/// memory.
void note_components(const PolygonMesh& polygons, const PolygonMesh& mesh, RunContext& context);

}  // namespace hermesh
