// Experiment files: a question, and the matrix of cells that answers it. README of the format: the comment at
// the head of headline.toml, and for voxelizers that of voxelization_speed.toml. Read strictly, because a
// misspelt key that is ignored turns into a wrong figure in a paper.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/core/variant.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pictures/plot.h"
#include "experiments/pictures/render.h"

namespace hermesh {

/// Who competes: extractors on the grids of the voxelizers, or the voxelizers themselves; or nobody, where a
/// function measures something else.
enum class ExperimentKind { kExtraction, kVoxelization, kMeasurement };

/// A parameter of a generated case that takes several values.
struct Sweep {
  std::string parameter;  ///< of the case's recipe
  std::vector<double> values;
};

/// Against what the voxelizers' level sets of a case are judged.
struct JudgedBy {
  enum class Signs { kNone, kParity, kUnanimousParity, kWinding };
  static constexpr std::int64_t kAll = 0;
  std::optional<std::int64_t> distances;  ///< kAll voxels of the band or so many; absent: not judged
  bool to_boundary = false;  ///< the distances are those to the solid's boundary instead of to all polygons
  Signs signs = Signs::kNone;
  std::int64_t sign_samples = kAll;
  std::string
      solid;  ///< case whose surface bounds the solid, where the input's own does not tell; empty: the input
};

/// An input at some resolutions; a resolution is the number of voxels along the longest side of the input's
/// box.
struct CaseEntry {
  std::string name;
  std::vector<int> resolutions;
  CloseUp close_up;
  Viewpoint viewpoint;

  // Of experiments on voxelization alone.
  std::vector<double> voxel_sizes;  ///< instead of resolutions
  std::optional<double> length;     ///< of the longest side in the units of voxel_sizes; absent: world units
  std::vector<double> published_seconds;  ///< somebody else's figure for each voxel size; empty: none
  std::optional<Sweep> sweep;
  JudgedBy judged;
};

struct VariantEntry {
  std::string name;                            ///< of an entry in a table of extractors or voxelizers
  std::string label;                           ///< unique in the file; the name when the file gives none
  std::map<std::string, std::string> options;  ///< as given
  std::string uniform = {};  ///< label of an extractor above, whose mesh this one's is compared with; or empty
  std::string command = {};  ///< of an outside program (command_extractor.h), which `name` then stands for; or empty
};

/// How much work a run is.
struct Tier {
  std::vector<CaseEntry> cases;
  int repetitions = 5;  ///< timed runs a variant, at most
  double seconds_per_variant =
      5.0;  ///< no further repetition of a variant starts once its own have used this up
  std::int64_t samples = 100'000;  ///< of the distances, on each surface
  int pixels = 400;                ///< width of one picture on the sheet; 0 draws none
  bool self_intersections = true;  ///< false leaves them uncounted, and a promise about them unchecked
  bool components = false;         ///< count those of the surface in each voxelizer's level set
  std::optional<double> timeout = {};    ///< seconds that a step of a cell may take
  std::optional<double> memory_mib = {};  ///< resident memory that a cell may take
  std::map<std::string, std::string> parameters;  ///< of a measurement, as given
};

struct Experiment {
  std::string name;  ///< the file's name without extension
  ExperimentKind kind = ExperimentKind::kExtraction;
  std::string question;
  std::vector<std::string> shows;  ///< tables and figures of the thesis that it makes, "table_9_2" or "figure_9_8"
  std::vector<VariantEntry> voxelizers;
  std::vector<std::string> columns;
  std::vector<VariantEntry> variants;               ///< extractors; none in an experiment on voxelization
  double exterior_band = 3.0, interior_band = 3.0;  ///< voxels
  std::optional<double>
      features;  ///< dihedral angle in degrees above which an edge is a sharp feature; absent: not judged
  std::vector<Plot> plots;
  std::string measurement;  ///< name of an entry in the table of measurements
  std::uint64_t seed = 1;   ///< of a measurement's random numbers
  std::map<std::string, Tier> tiers;

  /// The entries whose rows are compared.
  const std::vector<VariantEntry>& contenders() const {
    return kind == ExperimentKind::kVoxelization ? voxelizers : variants;
  }
};

/// The names that a file may use.
struct Vocabulary {
  std::span<const Extractor> extractors;
  std::span<const Voxelizer> voxelizers;
  std::vector<std::string> cases, columns;
  std::span<const Measurement> measurements = {};
};

/// @throws Error "headline.toml:12: …" for a syntax error, an unknown or missing key, a wrong type, a value
/// out of range, a name or option that the vocabulary does not have, or a label that is used twice.
Experiment read_experiment(const std::filesystem::path& path, const Vocabulary& vocabulary);

/// What lists say of a file.
struct ExperimentHead {
  std::string question;
  std::vector<std::string> shows;  ///< as Experiment::shows
};
/// The head alone; as strict about syntax, but not about names.
ExperimentHead read_head(const std::filesystem::path& path);

}  // namespace hermesh
