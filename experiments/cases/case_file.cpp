#include "experiments/cases/case_file.h"

#include <toml++/toml.h>

#include <algorithm>
#include <set>

#include "algorithms/core/error.h"
#include "experiments/cases/volume_cases.h"

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
    const toml::node* const list = document.get("case");
    const toml::array* const cases = list ? list->as_array() : nullptr;
    if (!cases) fail(document.source(), "there is no [[case]]");
    for (const toml::node& node : *cases) add_case(table(node));
    return std::move(cases_);
  }

 private:
  void add_case(const toml::table& entry) {
    CaseRecipe result;
    result.name = text(entry, "name");
    result.summary = text(entry, "summary");
    if (!names_.insert(result.name).second)
      fail(entry.source(), "the case '" + result.name + "' is there twice");
    if (entry.contains("volume")) {
      add_volume(result, entry);
    } else if (entry.contains("files")) {
      check_keys(entry, {"name", "summary", "files", "triangles", "stand_in"});
      add_files(result, *entry.get("files"));
      result.triangles = static_cast<std::size_t>(number(*get(entry, "triangles")));
      result.stand_in = text(entry, "stand_in");
      check_recipe(*get(entry, "stand_in"), result.stand_in);
    } else if (entry.contains("recipe")) {
      check_keys(entry, {"name", "summary", "recipe", "parameters", "sha256"});
      result.recipe = text(entry, "recipe");
      check_recipe(*get(entry, "recipe"), result.recipe);
      if (const toml::node* parameters = entry.get("parameters"))
        for (const auto& [key, value] : table(*parameters))
          result.parameters[std::string(key.str())] = number(value);
      result.sha256 = text(entry, "sha256");
    } else {
      result.change = entry.contains("agree_faces_of") ? "agree_faces_of" : "close_holes_of";
      check_keys(entry, {"name", "summary", result.change, "sha256"});
      result.changed_case = text(entry, result.change);
      const auto base = std::ranges::find(cases_, result.changed_case, &CaseRecipe::name);
      if (base == cases_.end() || !base->change.empty())
        fail(entry.source(), result.change + " must name a case that stands above and is of another kind");
      result.sha256 = text(entry, "sha256");
    }
    cases_.push_back(std::move(result));
  }

  void add_volume(CaseRecipe& result, const toml::table& entry) {
    check_keys(entry, {"name", "summary", "files", "volume", "stand_in"});
    add_files(result, *get(entry, "files"));
    result.is_volume = true;
    result.stand_in = text(entry, "stand_in");
    if (!is_volume_stand_in(result.stand_in))
      fail(get(entry, "stand_in")->source(), "there is no stand-in for a volume '" + result.stand_in + "'");
    const toml::table& volume = table(*get(entry, "volume"));
    check_keys(volume, {"dims", "type", "spacing"});
    if (volume.empty()) return;
    RawSamples raw;
    const std::array<double, 3> dims = three(volume, "dims");
    for (std::size_t i = 0; i < 3; ++i) raw.dims[i] = static_cast<std::int64_t>(dims[i]);
    raw.type = text(volume, "type");
    raw.spacing = three(volume, "spacing");
    result.raw = raw;
  }
  std::array<double, 3> three(const toml::table& entry, std::string_view key) {
    const toml::node* const node = get(entry, key);
    const toml::array* const list = node->as_array();
    if (!list || list->size() != 3) fail(node->source(), "'" + std::string(key) + "' must be three numbers");
    return {number((*list)[0]), number((*list)[1]), number((*list)[2])};
  }

  void add_files(CaseRecipe& result, const toml::node& node) {
    const toml::array* const files = node.as_array();
    if (!files || files->empty()) fail(node.source(), "'files' must be a list of tables");
    for (const toml::node& item : *files) {
      const toml::table& file = table(item);
      check_keys(file, {"file", "sha256", "from", "source", "licence"});
      result.files.push_back({text(file, "file"), text(file, "sha256"),
                              file.contains("from") ? text(file, "from") : "", text(file, "source"),
                              text(file, "licence")});
    }
  }

  void check_recipe(const toml::node& node, const std::string& recipe) {
    if (std::ranges::find(all_recipes(), recipe, &Recipe::name) == all_recipes().end())
      fail(node.source(), "there is no recipe '" + recipe + "'");
  }
  void check_keys(const toml::table& entry, std::initializer_list<std::string_view> known) {
    for (const auto& [key, value] : entry)
      if (std::ranges::find(known, key.str()) == known.end())
        fail(key.source(), "unknown key '" + std::string(key.str()) + "'");
  }
  const toml::table& table(const toml::node& node) {
    if (!node.is_table()) fail(node.source(), "a table should stand here");
    return *node.as_table();
  }
  const toml::node* get(const toml::table& entry, std::string_view key) {
    const toml::node* const node = entry.get(key);
    if (!node) fail(entry.source(), "the key '" + std::string(key) + "' is missing");
    return node;
  }
  std::string text(const toml::table& entry, std::string_view key) {
    const toml::node* const node = get(entry, key);
    if (!node->is_string()) fail(node->source(), "'" + std::string(key) + "' must be text");
    return **node->as_string();
  }
  double number(const toml::node& node) {
    const std::optional<double> value = node.is_number() ? node.value<double>() : std::nullopt;
    if (!value || !(*value > -1e300 && *value < 1e300)) fail(node.source(), "a number should stand here");
    return *value;
  }
  [[noreturn]] void fail(const toml::source_region& where, const std::string& what) const {
    throw Error(path_.string() + ", line " + std::to_string(where.begin.line) + ": " + what);
  }

  std::filesystem::path path_;
  std::vector<CaseRecipe> cases_;
  std::set<std::string> names_;
};

}  // namespace

std::vector<CaseRecipe> read_case_file(const std::filesystem::path& path) {
  return CaseFileReader(path).read();
}

}  // namespace hermesh
