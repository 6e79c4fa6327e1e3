// The recipes of cases.toml as they stand there.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "experiments/cases/recipes.h"

namespace hermesh {

/// One file that holds a case's mesh.
struct CaseFile {
  std::string name;    ///< in the data folder and in the cache
  std::string sha256;  ///< hash of the file's bytes
  std::string
      from;  ///< where fetch_data.sh gets the file; empty for a file that only the data folder can have
  std::string source, licence;  ///< where the file comes from, and on which terms
};

/// How a file of raw samples is laid out, as text for import_volume.h.
struct RawSamples {
  std::array<std::int64_t, 3> dims{};
  std::string type;
  std::array<double, 3> spacing{1.0, 1.0, 1.0};  ///< mm
};

/// A case is either files, of which the first that is to be had wins, with a stand-in (a recipe that takes a
/// number of triangles) for when none is; or a recipe; or another case, changed.
struct CaseRecipe {
  std::string name, summary;
  std::vector<CaseFile> files;
  std::size_t triangles = 0;
  std::string stand_in;
  std::string recipe;
  RecipeParameters parameters;
  std::string changed_case;       ///< the case that is changed to make this one
  std::string change;             ///< "close_holes_of" or "agree_faces_of": what is done to it
  bool is_volume = false;         ///< samples instead of polygons; its stand-in is one of volume_cases.h
  std::optional<RawSamples> raw;  ///< layout of a volume's samples where the file does not say
  std::string sha256;             ///< hash of a generated mesh's arrays
};

/// Reads the recipes of a file such as cases.toml.
/// @throws Error naming the file and line of a mistake: an unknown or missing key, a value of the wrong type,
/// a name given twice.
std::vector<CaseRecipe> read_case_file(const std::filesystem::path& path);

}  // namespace hermesh
