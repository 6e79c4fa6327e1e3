// Experiment files: a question, and the matrix of cells that answers it. README of the format: the comment at
// the head of headline.toml. Read strictly, because a misspelt key that is ignored turns into a wrong figure
// in a paper.
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
#include "experiments/render.h"

namespace hermesh {

/// An input at some resolutions; a resolution is the number of voxels along the longest side of the input's
/// box.
struct CaseEntry {
  std::string name;
  std::vector<int> resolutions;
  CloseUp close_up;
  Viewpoint viewpoint;
};

struct VariantEntry {
  std::string name;                            ///< of an entry in a table of extractors
  std::string label;                           ///< unique in the file; the name when the file gives none
  std::map<std::string, std::string> options;  ///< as given
};

/// How much work a run is.
struct Tier {
  std::vector<CaseEntry> cases;
  int repetitions = 5;  ///< timed extractions a variant, at most
  double seconds_per_variant =
      5.0;  ///< no further repetition of a variant starts once its own have used this up
  std::int64_t samples = 100'000;  ///< of the distances, on each surface
  int pixels = 400;                ///< width of one picture on the sheet; 0 draws none
  bool self_intersections = true;  ///< false leaves them uncounted, and a promise about them unchecked
};

struct Experiment {
  std::string name;  ///< the file's name without extension
  std::string question;
  std::vector<std::string> voxelizers, columns;
  std::vector<VariantEntry> variants;
  std::optional<double>
      features;  ///< dihedral angle in degrees above which an edge is a sharp feature; absent: not judged
  std::map<std::string, Tier> tiers;
};

/// The names that a file may use.
struct Vocabulary {
  std::span<const Extractor> extractors;
  std::span<const Voxelizer> voxelizers;
  std::vector<std::string> cases, columns;
};

/// @throws Error "headline.toml:12: …" for a syntax error, an unknown or missing key, a wrong type, a value
/// out of range, a name or option that the vocabulary does not have, or a label that is used twice.
Experiment read_experiment(const std::filesystem::path& path, const Vocabulary& vocabulary);

/// The question alone, for lists; as strict about syntax, but not about names.
std::string read_question(const std::filesystem::path& path);

}  // namespace hermesh
