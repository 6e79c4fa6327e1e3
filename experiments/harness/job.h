// Groups of cells: an input at one voxel size, for all variants that an experiment compares.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/core/variant.h"
#include "experiments/cases/cases.h"
#include "experiments/cases/recipes.h"
#include "experiments/harness/json_values.h"
#include "experiments/harness/measurement.h"
#include "experiments/pictures/render.h"

namespace hermesh {

struct VariantEntry {
  std::string name;                                 ///< of an entry in a table of extractors or voxelizers
  std::string label;                                ///< unique in the job
  std::map<std::string, std::string> options = {};  ///< as given
  std::string uniform =
      {};  ///< label of an extractor above, whose mesh this one's is compared with; or empty
  std::string command =
      {};  ///< of an outside program (command_extractor.h), which `name` then stands for; or empty
};

/// A parameter of a generated case that takes another value.
struct ChangedParameter {
  std::string parameter;
  double value;
};

/// The reference that the level sets of voxelizers are checked against.
struct JudgedBy {
  enum class Signs { kNone, kParity, kUnanimousParity, kWinding };
  static constexpr std::int64_t kAll = 0;
  std::optional<std::int64_t> distances;  ///< kAll voxels of the band, or this number; absent: not checked
  bool to_boundary = false;  ///< the distances are those to the solid's boundary, not to all polygons
  Signs signs = Signs::kNone;
  std::int64_t sign_samples = kAll;
  std::string solid;  ///< case whose surface bounds the solid if the input's does not; empty: the input
};

/// A group of cells: an input at one voxel size, for all variants, whose runs are interleaved for timing.
struct GroupJob {
  bool extraction = true;  ///< extractors compete, or else voxelizers
  Json head;               ///< the first keys of all rows
  std::string input;       ///< name of the case, or a mesh file
  std::optional<ChangedParameter> sweep;
  std::optional<int> resolution;     ///< voxels along the longest side of the input's box
  std::optional<double> voxel_size;  ///< instead of a resolution
  std::optional<double> length;      ///< of the longest side in the units of voxel_size; absent: world units
  std::optional<double> published_seconds;
  std::vector<VariantEntry> variants;
  VariantEntry voxelizer;                           ///< of an extraction
  double exterior_band = 3.0, interior_band = 3.0;  ///< voxels
  JudgedBy judged;
  std::optional<double> features;  ///< dihedral angle in degrees above which an edge is a sharp feature
  CloseUp close_up;
  Viewpoint viewpoint;
  int repetitions = 5;  ///< timed runs of a variant, at most
  double seconds_per_variant =
      5.0;  ///< no further repetition of a variant starts once its own have used this up
  std::int64_t samples = 100'000;  ///< of the distances, on each surface
  int pixels = 400;                ///< width of one picture on the sheet; 0 draws none
  bool self_intersections = true;  ///< false leaves them uncounted, and a guarantee about them unchecked
  bool components = false;         ///< count those of the surface in each voxelizer's level set
  std::filesystem::path out;       ///< directory for meshes and pictures
  std::string files;               ///< name of the files: NAME.png and meshes/EXPERIMENT-NAME/
};

/// The keys that all jobs of the laboratory have (cells/serve.h).
struct AnyJob {
  Json json;
  std::string kind;
  std::size_t threads = 1;
  bool require_data = false;
  std::filesystem::path out;
};

/// Reads the keys of any job. @throws Error for text that is not a JSON object, or is nested too deeply to be
/// copied, and as read_group_job().
AnyJob read_job(std::string_view line);

/// Reads the key "sweep" of a job. @throws as read_group_job().
std::optional<ChangedParameter> read_change(const Json& job);

/// Reads a job of the kinds extraction and voxelization. @throws Error that names the key if it is missing,
/// or if its value has a wrong type or is out of range.
GroupJob read_group_job(const Json& job);

/// The variants, cases and measurements that a job may name. Tests put toys here.
struct Tables {
  std::vector<Extractor> extractors;
  std::vector<Voxelizer> voxelizers;
  std::vector<std::string> cases;
  std::function<LoadedCase(const std::string& name, RunContext& context)> load;
  /// Loads a case with some parameters of its recipe changed.
  std::function<LoadedCase(const std::string& name, const RecipeParameters& changes, RunContext& context)>
      load_changed;
  std::vector<Measurement> measurements = {};
};

/// A case whose mesh cannot be read: its file is missing, torn or has no polygons. The cells of other cases
/// go on.
class CaseUnreadable : public Error {
  using Error::Error;
};

/// Receives the progress of the cells of a group, in case the process does not live to return their rows.
struct CellWatch {
  std::function<void(const Json& row)> planned = {};  ///< gets the keys of each row that are known in advance
  std::function<void(const std::string& label)> at = {};  ///< is called before each step of a cell's work
  void plan(const Json& row) const {
    if (planned) planned(row);
  }
  void step(const Json& row) const {
    if (at) at(text_at(row, "/variant/label"));
  }
};

/// Loads an input, with another value of a parameter of its recipe if `change` has one. @throws
/// CaseUnreadable; DataMissing.
LoadedCase load_input(const std::string& name, const std::optional<ChangedParameter>& change,
                      const Tables& tables, RunContext& context);

/// Runs a group; returns a row for each variant, failed ones included. @throws Cancelled; DataMissing;
/// CaseUnreadable; Error if a mesh or a picture cannot be written.
std::vector<Json> run_job(const GroupJob& job, Tables tables, const CellWatch& watch, RunContext& context);

}  // namespace hermesh
