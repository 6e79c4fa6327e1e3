// Cases: named inputs. experiments/cases.toml is the one file of recipes; this finds, checks or makes what it
// names.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

struct CaseInfo {
  std::string name;
  std::string summary;  ///< one line
  std::string
      kind;  ///< "file" or "generated"; "volume" for what volume_cases.h loads and load_case() does not
};

/// A case made ready. Every table says `origin`, so that nobody takes a stand-in for the real thing.
struct LoadedCase {
  std::string name;
  PolygonMesh mesh;
  std::string origin;  ///< "data folder", "package registry", "generated", or "stand-in: …" with the reason
  std::string sha256;  ///< hash of the file's bytes, or of the generated mesh's arrays
  std::optional<std::uint64_t> seed = {};  ///< seed of a generated case's random numbers, where it has any
};

/// All cases of cases.toml, in its order. @throws Error naming the file and line of a mistake.
std::vector<CaseInfo> list_cases();

/// Loads a case: from $HERMESH_DATA, or from the cache (filled from a package registry on first use), or else
/// as its procedural stand-in of the same size. A name that is no case but a path to a mesh file is read as
/// that file.
/// @throws Error for an unknown name, or a file whose SHA-256 is not the stated one.
LoadedCase load_case(const std::string& name, RunContext& context);

/// A case made by its recipe with some parameters changed. @throws Error for an unknown name, a case that is
/// not made by a recipe, an unknown parameter, or a value out of range.
LoadedCase load_changed_case(const std::string& name, const std::map<std::string, double>& changes,
                             RunContext& context);

/// A case's file is wanted, and only its stand-in is to be had: `hermesh run --require-data`.
class DataMissing : public Error {
  using Error::Error;
};
/// Makes stand-ins an error from now on, in the whole process: loading one throws DataMissing.
void require_data(bool required);
bool data_are_required();
/// @throws DataMissing naming the case and `reason`, why none of its files is to be had, if data are
/// required.
void check_stand_in_allowed(const std::string& name, const std::string& reason);

/// Whether a file of the case is in the data folder, the cache or a registry, so that no stand-in would be
/// taken.
/// @throws Error for an unknown name, or a file whose SHA-256 is not the stated one.
bool is_at_hand(const std::string& name, RunContext& context);

struct CaseRecipe;  // case_file.h

/// A case's file that is at hand, its SHA-256 checked.
struct LocatedFile {
  std::filesystem::path path;
  std::string origin, sha256;  ///< as in LoadedCase
};

/// Looks for the files of a case in the data folder, the cache and the package registry. Returns nothing
/// where none of them has one; then `reasons` says why.
/// @throws Error for a file whose SHA-256 is not the stated one.
std::optional<LocatedFile> locate_files(const CaseRecipe& recipe, std::string& reasons, RunContext& context);

/// Where the experiments and the recipes are: $HERMESH_EXPERIMENTS, else the source tree that the program was
/// built from.
std::filesystem::path experiments_folder();

}  // namespace hermesh
