// The pipeline of commands, experiments and tests: source → level set → mesh → the mesh as its file holds it
// → validation report → guarantees. Run it whole with run() or stage by stage.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/io/mesh_file.h"
#include "algorithms/remesh/remesh.h"
#include "validation/mesh_report.h"

namespace hermesh {

/// Returns the mesh as a temporary file of that format (".ply") holds it, since guarantees apply to files:
/// with the rounding of the writer and the welding of the reader. A mesh without polygons gives an empty
/// file.
MeshFile as_written(const PolygonMesh& mesh, const std::string& format, RunContext& context);

// ---- Guarantees.

/// Returns "closed", "manifold", "oriented", "no self-intersection".
std::vector<std::string> promise_words(const Promises& promises);

/// Facts about a mesh, in addition to the report, that the guarantees depend on.
struct Circumstances {
  /// The mesh was cut off at the end of the data (Ends::open) and has a boundary, which touches itself where
  /// the surface only touches the plane of the cut.
  bool cut_open = false;
  /// The volume counts as inside beyond its samples, so that the surface encloses the outside.
  bool encloses_the_outside = false;
  /// Bound of the distance of a mesh to its uniform mesh, the report's reference.
  struct Bound {
    double tolerance;                                 ///< voxels
    double voxel_size;                                ///< world units
    const validation::MeshReport* uniform = nullptr;  ///< of the required topology; null: any
  };
  std::optional<Bound> bound = {};
};

struct PromiseCheck {
  std::vector<std::string> broken;     ///< "closed (5 boundary edges)"
  std::vector<std::string> unchecked;  ///< guaranteed, but not validated
};

/// Checks the guarantees: closed, manifold and oriented by the counts of the report, where a closed mesh that
/// is inside out is not oriented. A mesh without self-intersections has no intersecting pair of polygons,
/// none without area (which the search for pairs leaves out) and no duplicate. A bound holds if it is
/// certified.
PromiseCheck check_promises(const Promises& promises, const validation::MeshReport& report,
                            const Circumstances& circumstances = {});

/// Returns "promises closed, oriented: kept" or "BROKEN: closed (5 boundary edges)".
std::string promise_verdict(const Promises& promises, const PromiseCheck& check);
/// Returns a letter for each guarantee (c, m, o, i) and the result: "co kept", "co BROKEN", "coi unchecked",
/// "none".
std::string promise_letters(const Promises& promises, const PromiseCheck& check);

struct Judgement {
  validation::MeshReport report;
  PromiseCheck promises;
};

/// Counts, sufficient for all guarantees except self-intersections.
inline constexpr validation::CheckOptions kCounts = {.self_intersections = false, .libraries = false};
/// Sufficient for all guarantees.
inline constexpr validation::CheckOptions kPromisesAlone = {.libraries = false};

/// @throws as validation::check_mesh().
Judgement judge(const MeshFile& mesh, const Promises& promises, const validation::CheckOptions& options,
                RunContext& context, const Circumstances& circumstances = {});

// ---- All stages.

/// Input of a job: polygons, a function that loads them, or a volume.
struct Source {
  std::function<PolygonMesh(RunContext&)> load = {};
  const PolygonMesh* polygons = nullptr;
  const LevelSet* volume = nullptr;  ///< null: it is made from the polygons
};

struct Job {
  Source source = {};
  VoxelizeRecipe voxelize = {};  ///< unused if the source is a volume
  ExtractRecipe extract = {};
  std::string format = {};  ///< of the file to validate (as_written()); empty: the mesh itself
  std::optional<validation::CheckOptions> judge = {};  ///< none: no validation
  Circumstances circumstances = {};
};

/// The results of a job.
struct Outcome {
  PolygonMesh polygons;  ///< that were loaded
  LevelSet volume;
  EndedMesh made;
  double extract_seconds = 0.0;
  MeshFile written;     ///< as validated
  Judgement judgement;  ///< empty for a mesh without polygons
};

/// Runs all stages. @throws as they do; Error if the format could not hold the mesh
/// (check_written_precision()).
Outcome run(const Job& job, RunContext& context);

}  // namespace hermesh
