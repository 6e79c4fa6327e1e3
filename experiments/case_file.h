// The recipes of cases.toml as they stand there.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/recipes.h"

namespace hermesh {

/// One file that holds a case's mesh.
struct CaseFile {
  std::string name;    ///< in the data folder and in the cache
  std::string sha256;  ///< of its bytes
  std::string from;    ///< where fetch_data.sh gets it; empty for a file that only the data folder can have
};

/// A case is either files, the first that is to be had wins, with a stand-in (a recipe that takes a number of
/// triangles) for when none is; or a recipe; or another case with its holes closed.
struct CaseRecipe {
  std::string name, summary;
  std::vector<CaseFile> files;
  std::size_t triangles = 0;
  std::string stand_in;
  std::string recipe;
  RecipeParameters parameters;
  std::string close_holes_of;
  std::string sha256;  ///< of a generated mesh's arrays
};

/// @throws Error naming the file and line of a mistake: an unknown or missing key, a value of the wrong type,
/// a name given twice.
std::vector<CaseRecipe> read_case_file(const std::filesystem::path& path);

}  // namespace hermesh
