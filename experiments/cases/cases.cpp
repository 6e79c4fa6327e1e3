#include "experiments/cases/cases.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "algorithms/core/quad_diagonals.h"
#include "algorithms/io/import/import_volume.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/vdb_file.h"
#include "experiments/cases/recipes.h"
#include "reference/agreed_faces.h"

namespace hermesh {

namespace {

namespace fs = std::filesystem;

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

std::vector<CaseRecipe> all_cases() { return read_case_file(experiments_folder() / "cases.toml"); }

fs::path cache_folder() {
  if (const std::string cache = environment("HERMESH_CACHE"); !cache.empty()) return cache;
  if (const std::string cache = environment("XDG_CACHE_HOME"); !cache.empty())
    return fs::path(cache) / "hermesh";
  if (const std::string home = environment("HOME"); !home.empty())
    return fs::path(home) / ".cache" / "hermesh";
  return fs::temp_directory_path() / "hermesh";
}

/// Runs a shell command; returns its status and the last line of its output.
std::pair<int, std::string> last_line_of(const std::string& command) {
  FILE* const pipe = popen(command.c_str(), "r");
  if (!pipe) return {-1, ""};
  std::string text;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) text += static_cast<char>(c);
  while (text.ends_with('\n')) text.pop_back();
  return {pclose(pipe), text.substr(text.rfind('\n') + 1)};
}

/// Runs fetch_data.sh. Returns the reason if there is no file afterwards, else "".
std::string fetch(const CaseFile& file, RunContext& context) {
  if (file.from.empty()) return "it has no public source";
  // The laboratory states here why its own download failed.
  if (const std::string offline = environment("HERMESH_OFFLINE"); !offline.empty())
    return offline == "1" ? "HERMESH_OFFLINE is set" : offline;
  // An unreachable registry takes long to fail, so each file is tried once.
  static std::map<std::string, std::string> failures;
  if (const auto known = failures.find(file.name); known != failures.end()) return known->second;
  context.progress("fetch " + file.name, 0.0);
  const auto [status, reason] = last_line_of(
      "bash " + shell_quoted((experiments_folder() / "fetch_data.sh").string()) + " " +
      shell_quoted(file.name) + " " + shell_quoted(cache_folder().string()) + " 2>&1 </dev/null");
  context.check();
  if (status == -1) return "no shell could be started";
  if (status == 0) return "";
  return failures[file.name] = reason.empty() ? "it could not be fetched" : reason;
}

/// A file of a case that is available, with the stated SHA-256.
struct LocatedFile {
  fs::path path;
  std::string origin, sha256;  ///< as in LoadedCase
};

bool data_required = false;

/// @throws DataMissing naming the case and the reason if data are required.
void check_stand_in_allowed(const std::string& name, const std::string& reason) {
  if (data_required)
    throw DataMissing("the case " + name + " would be a stand-in, because " + reason +
                      "; put the file into the folder $HERMESH_DATA, or leave out --require-data");
}

/// Reads polygons like the program: quads are cut along the better diagonal.
PolygonMesh read_polygons(const fs::path& path, RunContext& context) {
  PolygonMesh mesh = read_mesh(path, context);
  choose_diagonals(mesh);
  return mesh;
}

/// @throws Error if the file does not have the hash that the case states.
LocatedFile checked(const CaseRecipe& recipe, const CaseFile& file, const fs::path& path,
                    const std::string& origin) {
  const std::string sha256 = sha256_of_file(path);
  if (sha256 != file.sha256)
    throw Error(path.string() + " is not the file of case " + recipe.name + ": its SHA-256 is " + sha256 +
                " instead of " + file.sha256 + "; remove it or put the right one there");
  return {path, origin, sha256};
}

/// Returns the first of the case's files that is in the directory.
std::optional<LocatedFile> find_in(const fs::path& folder, const CaseRecipe& recipe,
                                   const std::string& origin) {
  for (const CaseFile& file : recipe.files)
    if (fs::exists(folder / file.name)) return checked(recipe, file, folder / file.name, origin);
  return std::nullopt;
}

/// Looks for the files of a case in the data directory, the cache and the package registry. Without one, sets
/// `reasons`.
std::optional<LocatedFile> locate_files(const CaseRecipe& recipe, std::string& reasons, RunContext& context) {
  const std::string data = environment("HERMESH_DATA");
  if (!data.empty())
    if (std::optional<LocatedFile> found = find_in(data, recipe, "data folder")) return found;
  reasons.clear();
  for (const CaseFile& file : recipe.files) {
    // A file in the cache came from a registry earlier.
    if (std::optional<LocatedFile> found = find_in(cache_folder(), recipe, "package registry")) return found;
    const std::string reason = fetch(file, context);
    if (reason.empty()) return checked(recipe, file, cache_folder() / file.name, "package registry");
    reasons += (reasons.empty() ? "" : "; ") + file.name + " is not in the data folder, and " + reason;
  }
  return std::nullopt;
}

LoadedCase load_files(const std::vector<CaseRecipe>& all, const CaseRecipe& recipe, RunContext& context);

LoadedCase load_stand_in(const std::vector<CaseRecipe>& all, const CaseRecipe& recipe,
                         const std::string& reason, RunContext& context) {
  check_stand_in_allowed(recipe.name, reason);
  if (!is_recipe(recipe.stand_in)) {
    LoadedCase other = load_files(all, *std::ranges::find(all, recipe.stand_in, &CaseRecipe::name), context);
    other.name = recipe.name;
    if (!other.origin.starts_with("stand-in"))
      other.origin = "stand-in: the case " + recipe.stand_in + ", because " + reason;
    return other;
  }
  PolygonMesh mesh = make_recipe(recipe.stand_in, {{"triangles", recipe.triangles}}, context);
  const std::string sha256 = sha256_of_mesh(mesh);
  return {recipe.name, std::move(mesh),
          "stand-in: " + recipe.stand_in + " of the same size, because " + reason, sha256};
}

LoadedCase load_files(const std::vector<CaseRecipe>& all, const CaseRecipe& recipe, RunContext& context) {
  std::string reasons;
  if (const std::optional<LocatedFile> located = locate_files(recipe, reasons, context))
    return {recipe.name, read_polygons(located->path, context), located->origin, located->sha256};
  return load_stand_in(all, recipe, reasons, context);
}

LevelSet read_volume(const CaseRecipe& recipe, const std::filesystem::path& path, RunContext& context) {
  if (recipe.raw)
    return import_raw(path,
                      {.dims = recipe.raw->dims,
                       .format = parse_sample_format(recipe.raw->type),
                       .spacing = recipe.raw->spacing,
                       .offset = 0},
                      {}, context);
  if (is_nifti_path(path)) return import_nifti(path, {}, context);
  return read_level_set(path, "", context);
}

LoadedCase generated(const CaseRecipe& recipe, const RecipeParameters& parameters, RunContext& context) {
  LoadedCase result{recipe.name, make_recipe(recipe.recipe, parameters, context), "generated", ""};
  if (const auto seed = parameters.find("seed"); seed != parameters.end())
    result.seed = static_cast<std::uint64_t>(seed->second);
  return result;
}

LoadedCase load_recipe(const std::vector<CaseRecipe>& all, const CaseRecipe& recipe, RunContext& context) {
  if (recipe.is_volume) throw Error("the case " + recipe.name + " is a volume and has no polygons");
  if (!recipe.files.empty()) return load_files(all, recipe, context);
  LoadedCase result;
  if (recipe.change.empty()) {
    result = generated(recipe, recipe.parameters, context);
  } else {
    result = load_recipe(all, *std::ranges::find(all, recipe.changed_case, &CaseRecipe::name), context);
    result.mesh =
        recipe.change == "close_holes_of" ? close_holes(result.mesh) : with_agreeing_faces(result.mesh);
  }
  result.name = recipe.name;
  result.sha256 = sha256_of_mesh(result.mesh);
  // Generated bytes are the same on every machine.
  if (!result.origin.starts_with("stand-in") && result.sha256 != recipe.sha256)
    throw Error("case " + recipe.name + " came out with the SHA-256 " + result.sha256 + " instead of " +
                recipe.sha256 + "; its recipe has changed, or this build does not keep to IEEE arithmetic");
  return result;
}

/// @throws Error for an unknown name.
const CaseRecipe& case_named(const std::vector<CaseRecipe>& all, const std::string& name,
                             const std::string& what = "") {
  const auto recipe = std::ranges::find(all, name, &CaseRecipe::name);
  if (recipe != all.end()) return *recipe;
  std::string names;
  for (const CaseRecipe& each : all) names += (names.empty() ? "" : ", ") + each.name;
  throw Error("there is no case '" + name + "'" + what + "; the cases are: " + names);
}

}  // namespace

void require_data(bool required) { data_required = required; }

bool is_at_hand(const std::string& name, RunContext& context) {
  const std::vector<CaseRecipe> all = all_cases();
  const CaseRecipe& recipe = case_named(all, name);
  std::string reasons;
  return recipe.files.empty() || locate_files(recipe, reasons, context);
}

std::vector<CaseInfo> list_cases() {
  std::vector<CaseInfo> cases;
  for (const CaseRecipe& recipe : all_cases())
    cases.push_back({recipe.name, recipe.is_volume ? "volume" : recipe.files.empty() ? "generated" : "file"});
  return cases;
}

LoadedCase load_case(const std::string& name, RunContext& context) {
  const std::vector<CaseRecipe> all = all_cases();
  if (is_mesh_path(name) && std::ranges::find(all, name, &CaseRecipe::name) == all.end())
    return {name, read_polygons(name, context), "file", sha256_of_file(name)};
  return load_recipe(all, case_named(all, name, " and no mesh file of that name"), context);
}

LoadedCase load_changed_case(const std::string& name, const std::map<std::string, double>& changes,
                             RunContext& context) {
  const std::vector<CaseRecipe> all = all_cases();
  const CaseRecipe& recipe = case_named(all, name);
  if (recipe.recipe.empty())
    throw Error("the case '" + name + "' has no recipe, and so no parameters to change");
  RecipeParameters parameters = recipe.parameters;
  for (const auto& [key, value] : changes) parameters[key] = value;
  LoadedCase result = generated(recipe, parameters, context);
  result.sha256 = sha256_of_mesh(result.mesh);
  return result;
}

LoadedVolume load_volume(const std::string& name, RunContext& context) {
  const std::vector<CaseRecipe> all = all_cases();
  const CaseRecipe& recipe = case_named(all, name);
  if (!recipe.is_volume) throw Error("the case " + name + " is not a volume");
  std::string reasons;
  if (const auto located = locate_files(recipe, reasons, context))
    return {read_volume(recipe, located->path, context), located->origin, located->sha256};
  check_stand_in_allowed(name, reasons);
  return {make_volume_stand_in(recipe.stand_in), "stand-in: " + recipe.stand_in + ", because " + reasons, ""};
}

fs::path experiments_folder() {
  const std::string folder = environment("HERMESH_EXPERIMENTS");
  return folder.empty() ? fs::path(HERMESH_SOURCE_DIR) / "experiments" : fs::path(folder);
}

std::string shell_quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

}  // namespace hermesh
