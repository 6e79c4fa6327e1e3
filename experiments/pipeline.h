// The one way through the house: a source → its level set → a mesh → the mesh as its file holds it → the
// judges' report → the promises that it keeps. The program's commands, the harness, the measurements and the
// tests take it, whole with run() or stage by stage.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/variant.h"
#include "algorithms/extraction/volume_ends.h"
#include "algorithms/io/mesh_file.h"
#include "validation/mesh_report.h"

namespace hermesh {

using GivenOptions = std::map<std::string, std::string>;

/// A variant that was looked up, with its options checked.
struct ChosenVoxelizer {
  Voxelizer voxelizer;
  Options options;
};
struct ChosenExtractor {
  Extractor extractor;
  Options options;
};

/// @throws Error for a name that the table does not have, and for an option or value that the variant does
/// not take.
ChosenVoxelizer choose(std::span<const Voxelizer> table, const std::string& name,
                       const GivenOptions& given = {});
ChosenExtractor choose(std::span<const Extractor> table, const std::string& name,
                       const GivenOptions& given = {});

/// How polygons become a level set.
struct VoxelizeRecipe {
  ChosenVoxelizer chosen = {};
  double resolution = 100.0;              ///< voxels along the longest side of the polygons' box
  std::optional<double> voxel_size = {};  ///< world units, in place of a resolution
  double exterior_band = 3.0;             ///< voxels
  double interior_band = 3.0;             ///< voxels
};

/// How a volume becomes a mesh.
struct ExtractRecipe {
  ChosenExtractor chosen = {};
  double isovalue = 0.0;  ///< in the units of the volume's values
  /// What becomes of a surface that runs into the end of the data; none: nobody looks for ends, which level
  /// sets of polygons do not have.
  std::optional<Ends> ends = {};
  const AdaptivityField* field = nullptr;  ///< as in ExtractionInput, like the two below
  const SparseHermite<EdgeCrossing>* hermite = nullptr;
  bool written_in_single = false;
};

/// World units. Not finite or 0 where a resolution is asked of a mesh without extent, which voxelizers
/// refuse.
double voxel_size_of(const VoxelizeRecipe& recipe, const PolygonMesh& mesh);
VoxelizationInput voxelization_input(const PolygonMesh& mesh, const VoxelizeRecipe& recipe,
                                     RunContext& context);

/// @throws what the voxelizer throws.
LevelSet voxelize(const PolygonMesh& mesh, const VoxelizeRecipe& recipe, RunContext& context);

/// `source`: the polygons that the volume was made from; null where they are not at hand.
/// @throws what the extractor throws.
EndedMesh extract(const LevelSet& volume, const PolygonMesh* source, const ExtractRecipe& recipe,
                  RunContext& context);

/// The mesh as a file of that format (".ply") holds it, for a promise is about what is in the file: rounding
/// on the way and the reader's welding are part of it. The file is a temporary one. A mesh without polygons,
/// which no file holds, is returned as it is.
MeshFile as_written(const PolygonMesh& mesh, const std::string& format, RunContext& context);

// ---- Promises.

/// The promises as words: "closed", "manifold", "oriented", "no self-intersection".
std::vector<std::string> promise_words(const Promises& promises);

/// What has to be known of a mesh besides the judges' report to tell whether a promise is kept.
struct Circumstances {
  /// The mesh was cut off at the end of the data (Ends::open), and so has a boundary. Where the surface only
  /// touches the plane of the cut, that boundary touches itself.
  bool cut_open = false;
  /// The volume counts as inside beyond its samples, so that the surface encloses what is outside.
  bool encloses_the_outside = false;
  /// The bound of a mesh that is to be within a tolerance of its uniform mesh, the report's reference.
  struct Bound {
    double tolerance;                                 ///< voxels
    double voxel_size;                                ///< world units
    const validation::MeshReport* uniform = nullptr;  ///< whose topology it should have; null: any
  };
  std::optional<Bound> bound = {};
};

struct PromiseCheck {
  std::vector<std::string> broken;     ///< "closed (5 boundary edges)"
  std::vector<std::string> unchecked;  ///< promised, but not judged in this run
};

/// The one rule. Closed, manifold and oriented are what the report counts, and a closed mesh that is inside
/// out is not oriented. A mesh that is free of self-intersection has no pair of polygons that meet, none
/// without area (which the judge of pairs leaves out) and none twice. A bound holds where it is certified.
PromiseCheck check_promises(const Promises& promises, const validation::MeshReport& report,
                            const Circumstances& circumstances = {});

/// For a picture's caption: "promises closed, oriented: kept", or "BROKEN: closed (5 boundary edges)".
std::string promise_verdict(const Promises& promises, const PromiseCheck& check);
/// For a narrow column, a letter for each promise (c, m, o, i): "co kept", "co BROKEN", "coi unchecked",
/// "none".
std::string promise_letters(const Promises& promises, const PromiseCheck& check);

struct Judgement {
  validation::MeshReport report;
  PromiseCheck promises;
};

/// Counts alone, which is all that promises but the one of self-intersection need.
inline constexpr validation::JudgeOptions kCounts = {.self_intersections = false, .libraries = false};
/// What tells whether all promises are kept, and no more.
inline constexpr validation::JudgeOptions kPromisesAlone = {.libraries = false};

/// @throws what validation::judge() throws.
Judgement judge(const MeshFile& mesh, const Promises& promises, const validation::JudgeOptions& options,
                RunContext& context, const Circumstances& circumstances = {});

// ---- All of it.

/// Where a volume comes from.
struct Source {
  std::function<PolygonMesh(RunContext&)> load =
      {};  ///< makes or reads polygons; none: they are at hand, or not needed
  const PolygonMesh* polygons = nullptr;
  const LevelSet* volume =
      nullptr;  ///< what need not be voxelized any more; null: it is made of the polygons
};

struct Job {
  Source source = {};
  VoxelizeRecipe voxelize = {};  ///< of no use where the source is a volume
  ExtractRecipe extract = {};
  std::string format = {};  ///< of the file through which the mesh goes (as_written()); empty: through none
  std::optional<validation::JudgeOptions> judge = {};  ///< none: the mesh is not judged
  Circumstances circumstances = {};
};

/// What came of a job.
struct Outcome {
  PolygonMesh polygons;  ///< that were loaded
  LevelSet volume;
  EndedMesh made;
  double extract_seconds = 0.0;
  MeshFile written;     ///< as judged
  Judgement judgement;  ///< of a mesh without polygons: nothing counted, nothing broken
};

/// All stages, one after the other. @throws what they throw; Error where the format could not hold the mesh
/// (check_written_precision()).
Outcome run(const Job& job, RunContext& context);

}  // namespace hermesh
