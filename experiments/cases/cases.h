// Cases: named inputs, meshes and volumes. experiments/cases.toml describes them; these functions read it and
// find, verify or make an input.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/level_set.h"
#include "algorithms/core/polygon_mesh.h"
#include "algorithms/core/run_context.h"

namespace hermesh {

/// A file of a case.
struct CaseFile {
  std::string name;    ///< in the data directory and in the cache
  std::string sha256;  ///< of the file's bytes
  std::string from;    ///< source for fetch_data.sh; empty for a file that only the data directory can have
};

/// Layout of a file of raw samples, as text for import_volume.h.
struct RawSamples {
  std::array<std::int64_t, 3> dims{};
  std::string type;
  std::array<double, 3> spacing{1.0, 1.0, 1.0};  ///< mm
};

/// A case is files, of which the first available one is used, with a stand-in (a recipe that takes a number
/// of triangles, or another case with files) if none is; or a recipe; or another case, changed.
struct CaseRecipe {
  std::string name;
  std::vector<CaseFile> files;
  double triangles = 0;
  std::string stand_in;
  std::string recipe;
  std::map<std::string, double> parameters;
  std::string changed_case;       ///< the case that is changed to make this one
  std::string change;             ///< "close_holes_of" or "agree_faces_of"
  bool is_volume = false;         ///< samples instead of polygons; the stand-in is one of volume_cases.cpp
  std::optional<RawSamples> raw;  ///< layout of a volume's samples if the file does not state it
  std::string sha256;             ///< of the arrays of a generated mesh
};

/// Reads a file such as cases.toml.
/// @throws Error naming the file and line of a mistake: an unknown or missing key, a value of the wrong type,
/// a duplicate name.
std::vector<CaseRecipe> read_case_file(const std::filesystem::path& path);

struct CaseInfo {
  std::string name;
  std::string kind;  ///< "file", "generated" or "volume"
};

/// Returns the cases of cases.toml in its order. @throws as read_case_file().
std::vector<CaseInfo> list_cases();

struct LoadedCase {
  std::string name;
  PolygonMesh mesh;
  std::string
      origin;  ///< "data folder", "package registry", "generated", "file", or "stand-in: …" with the reason
  std::string sha256;                      ///< of the file's bytes, or of the generated mesh's arrays
  std::optional<std::uint64_t> seed = {};  ///< of a generated case's random numbers, if it has any
};

/// Loads a case of polygons: from $HERMESH_DATA, else from the cache (filled from a package registry on first
/// use), else as its stand-in, procedural of the same size or another case. A name that is not a case but
/// the path of a mesh file is read.
/// @throws Error for an unknown name or a file with another SHA-256 than stated; DataMissing.
LoadedCase load_case(const std::string& name, RunContext& context);

/// Generates a case with some parameters of its recipe changed. @throws Error for an unknown name, a case
/// without a recipe, an unknown parameter, or a value out of range.
LoadedCase load_changed_case(const std::string& name, const std::map<std::string, double>& changes,
                             RunContext& context);

struct LoadedVolume {
  LevelSet volume;
  std::string origin;  ///< as in LoadedCase
  std::string sha256;  ///< of the file's bytes; empty for a stand-in
};

/// Loads a case that is a volume. @throws as load_case().
LoadedVolume load_volume(const std::string& name, RunContext& context);

/// Thrown instead of loading a stand-in if data are required: `hermesh run --require-data`.
class DataMissing : public Error {
  using Error::Error;
};
/// Makes stand-ins an error from now on in the whole process.
void require_data(bool required);

/// Returns true if no stand-in would be loaded for the case. @throws as load_case().
bool is_at_hand(const std::string& name, RunContext& context);

/// Returns $HERMESH_EXPERIMENTS, else the directory experiments/ of the source tree that the program was
/// built from.
std::filesystem::path experiments_folder();

/// Returns the text as one word of a shell command.
std::string shell_quoted(const std::string& text);

// SHA-256 in 64 hexadecimal digits.

/// @throws Error if the file cannot be read.
std::string sha256_of_file(const std::filesystem::path& path);
std::string sha256_of_text(std::string_view text);
/// Hashes the numbers of points, triangles and quads (64 bits each), the origin, the points, the triangles,
/// the quads, all little-endian.
std::string sha256_of_mesh(const PolygonMesh& mesh);

}  // namespace hermesh
