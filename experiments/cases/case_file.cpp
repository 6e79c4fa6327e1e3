#include <toml++/toml.h>

#include <algorithm>

#include "experiments/cases/cases.h"
#include "experiments/cases/recipes.h"

namespace hermesh {
namespace {

class CaseFileReader {
 public:
  explicit CaseFileReader(const std::filesystem::path& path) : path_(path) {}

  std::vector<CaseRecipe> read() {
    toml::table document;
    try {
      document = toml::parse_file(path_.string());
    } catch (const toml::parse_error& error) {
      fail(error.source(), std::string(error.description()));
    }
    check_keys(document, {"case"});
    for (const toml::node& node : get<toml::array>(document, "case", "a list of tables"))
      add_case(as<toml::table>(node, "a case must be a table"));
    return std::move(cases_);
  }

 private:
  void add_case(const toml::table& entry) {
    CaseRecipe result;
    result.name = text(entry, "name");
    text(entry, "summary");
    if (std::ranges::find(cases_, result.name, &CaseRecipe::name) != cases_.end())
      fail(entry.source(), "the case '" + result.name + "' exists already");
    if (entry.contains("volume")) {
      add_volume(result, entry);
    } else if (entry.contains("files")) {
      check_keys(entry, {"name", "summary", "files", "triangles", "stand_in"});
      add_files(result, entry);
      result.triangles = number(*node(entry, "triangles"));
      result.stand_in = stand_in(entry);
    } else if (entry.contains("recipe")) {
      check_keys(entry, {"name", "summary", "recipe", "parameters", "sha256"});
      result.recipe = recipe(entry, "recipe");
      if (entry.contains("parameters"))
        for (const auto& [key, value] : get<toml::table>(entry, "parameters", "a table"))
          result.parameters[std::string(key.str())] = number(value);
      result.sha256 = text(entry, "sha256");
    } else {
      result.change = entry.contains("agree_faces_of") ? "agree_faces_of" : "close_holes_of";
      check_keys(entry, {"name", "summary", result.change, "sha256"});
      result.changed_case = text(entry, result.change);
      const auto base = std::ranges::find(cases_, result.changed_case, &CaseRecipe::name);
      if (base == cases_.end() || !base->change.empty())
        fail(entry.source(), result.change + " must name a case above it that has files or a recipe");
      result.sha256 = text(entry, "sha256");
    }
    cases_.push_back(std::move(result));
  }

  void add_volume(CaseRecipe& result, const toml::table& entry) {
    check_keys(entry, {"name", "summary", "files", "volume", "stand_in"});
    add_files(result, entry);
    result.is_volume = true;
    result.stand_in = text(entry, "stand_in");
    if (result.stand_in != "scan" && result.stand_in != "fog" && result.stand_in != "cube")
      fail(node(entry, "stand_in")->source(), "unknown stand-in '" + result.stand_in + "' for a volume");
    const toml::table& volume = get<toml::table>(entry, "volume", "a table");
    check_keys(volume, {"dims", "type", "spacing"});
    if (volume.empty()) return;
    const std::array<double, 3> dims = three(volume, "dims");
    result.raw = {.dims = {std::int64_t(dims[0]), std::int64_t(dims[1]), std::int64_t(dims[2])},
                  .type = text(volume, "type"),
                  .spacing = three(volume, "spacing")};
  }

  void add_files(CaseRecipe& result, const toml::table& entry) {
    for (const toml::node& item : get<toml::array>(entry, "files", "a list of tables")) {
      const toml::table& file = as<toml::table>(item, "'files' must be a list of tables");
      check_keys(file, {"file", "sha256", "from", "source", "licence"});
      text(file, "source"), text(file, "licence");
      result.files.push_back(
          {text(file, "file"), text(file, "sha256"), file.contains("from") ? text(file, "from") : ""});
    }
    if (result.files.empty()) fail(entry.source(), "'files' must not be empty");
  }

  std::string recipe(const toml::table& entry, std::string_view key) {
    const std::string name = text(entry, key);
    if (!is_recipe(name)) fail(node(entry, key)->source(), "there is no recipe '" + name + "'");
    return name;
  }
  std::string stand_in(const toml::table& entry) {
    const std::string name = text(entry, "stand_in");
    const auto other = std::ranges::find(cases_, name, &CaseRecipe::name);
    if (!is_recipe(name) && (other == cases_.end() || other->files.empty() || other->is_volume))
      fail(node(entry, "stand_in")->source(),
           "'stand_in' must be a recipe or a case above it that has files, not '" + name + "'");
    return name;
  }
  std::array<double, 3> three(const toml::table& entry, std::string_view key) {
    const toml::array& list = get<toml::array>(entry, key, "three numbers");
    if (list.size() != 3) fail(list.source(), "'" + std::string(key) + "' must be three numbers");
    return {number(list[0]), number(list[1]), number(list[2])};
  }
  void check_keys(const toml::table& entry, std::initializer_list<std::string_view> known) {
    for (const auto& [key, value] : entry)
      if (std::ranges::find(known, key.str()) == known.end())
        fail(key.source(), "unknown key '" + std::string(key.str()) + "'");
  }
  const toml::node* node(const toml::table& entry, std::string_view key) {
    const toml::node* const found = entry.get(key);
    if (!found) fail(entry.source(), "the key '" + std::string(key) + "' is missing");
    return found;
  }
  template <class T>
  const T& as(const toml::node& found, const std::string& message) {
    if (!found.is<T>()) fail(found.source(), message);
    return *found.as<T>();
  }
  template <class T>
  const T& get(const toml::table& entry, std::string_view key, const char* kind) {
    return as<T>(*node(entry, key), "'" + std::string(key) + "' must be " + kind);
  }
  std::string text(const toml::table& entry, std::string_view key) {
    const toml::node& found = *node(entry, key);
    if (!found.is_string()) fail(found.source(), "'" + std::string(key) + "' must be text");
    return **found.as_string();
  }
  double number(const toml::node& found) {
    const std::optional<double> value = found.is_number() ? found.value<double>() : std::nullopt;
    if (!value || !(*value > -1e300 && *value < 1e300)) fail(found.source(), "expected a number");
    return *value;
  }
  [[noreturn]] void fail(const toml::source_region& where, const std::string& what) const {
    throw Error(path_.string() + ", line " + std::to_string(where.begin.line) + ": " + what);
  }

  std::filesystem::path path_;
  std::vector<CaseRecipe> cases_;
};

}  // namespace

std::vector<CaseRecipe> read_case_file(const std::filesystem::path& path) {
  return CaseFileReader(path).read();
}

}  // namespace hermesh
