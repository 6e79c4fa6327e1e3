#include "experiments/experiment_file.h"

#include <toml++/toml.h>

#include <algorithm>
#include <set>
#include <sstream>
#include <string_view>

namespace hermesh {
namespace {

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

/// A table of the file that insists on every key being known and asked for. Its messages begin with
/// "file:line: ".
class Section {
 public:
  Section(std::string file, const toml::table& table, std::string what, std::vector<std::string> known)
      : file_(std::move(file)), table_(table), what_(std::move(what)) {
    for (const auto& [key, value] : table_)
      if (std::find(known.begin(), known.end(), key.str()) == known.end())
        fail(key.source().begin.line,
             "unknown key \"" + std::string(key.str()) + "\" in " + what_ + "; it takes " + joined(known));
  }

  [[noreturn]] void fail(toml::source_index line, const std::string& sentence) const {
    throw Error(file_ + ":" + std::to_string(std::max<toml::source_index>(line, 1)) + ": " + sentence);
  }
  [[noreturn]] void fail_at(const std::string& key, const std::string& sentence) const {
    const toml::node* node = table_.get(key);
    fail(node ? node->source().begin.line : line(), sentence);
  }
  toml::source_index line() const { return table_.source().begin.line; }
  const std::string& file() const { return file_; }
  bool has(const std::string& key) const { return table_.contains(key); }

  std::string text(const std::string& key) const {
    const toml::node& node = required(key);
    if (const auto* value = node.as_string(); value && !value->get().empty()) return value->get();
    fail(node.source().begin.line, "\"" + key + "\" must be a text that is not empty");
  }
  std::string text_or(const std::string& key, const std::string& fallback) const {
    return has(key) ? text(key) : fallback;
  }
  bool flag_or(const std::string& key, bool fallback) const {
    if (!has(key)) return fallback;
    if (const auto* value = table_.get(key)->as_boolean()) return value->get();
    fail_at(key, "\"" + key + "\" must be true or false");
  }
  double number_or(const std::string& key, double fallback, double lower, double upper) const {
    return has(key) ? number(*table_.get(key), key, lower, upper) : fallback;
  }
  std::int64_t integer_or(const std::string& key, std::int64_t fallback, std::int64_t lower,
                          std::int64_t upper) const {
    return has(key) ? integer(*table_.get(key), key, lower, upper) : fallback;
  }

  double number(const toml::node& node, const std::string& key, double lower, double upper) const {
    const std::optional<double> value = node.is_number() ? node.value<double>() : std::nullopt;
    if (value && *value >= lower && *value <= upper) return *value;
    std::ostringstream range;
    range << "\"" << key << "\" must be a number from " << lower << " to " << upper;
    fail(node.source().begin.line, range.str());
  }
  std::int64_t integer(const toml::node& node, const std::string& key, std::int64_t lower,
                       std::int64_t upper) const {
    if (const auto* value = node.as_integer(); value && value->get() >= lower && value->get() <= upper)
      return value->get();
    fail(node.source().begin.line, "\"" + key + "\" must be a whole number from " + std::to_string(lower) +
                                       " to " + std::to_string(upper));
  }

  const toml::array& list(const std::string& key) const {
    const toml::node& node = required(key);
    if (const auto* array = node.as_array(); array && !array->empty()) return *array;
    fail(node.source().begin.line, "\"" + key + "\" must be a list [ … ] that is not empty");
  }
  /// Names out of `known`, each at most once.
  std::vector<std::string> names(const std::string& key, const std::string& kind,
                                 const std::vector<std::string>& known) const {
    std::vector<std::string> result;
    for (const toml::node& node : list(key)) {
      const auto* value = node.as_string();
      if (!value) fail(node.source().begin.line, "\"" + key + "\" must be a list of texts");
      const std::string name = value->get();
      if (std::find(known.begin(), known.end(), name) == known.end())
        fail(node.source().begin.line,
             "there is no " + kind + " \"" + name + "\"; there are " + joined(known));
      if (std::find(result.begin(), result.end(), name) != result.end())
        fail(node.source().begin.line, "the " + kind + " \"" + name + "\" is named twice");
      result.push_back(name);
    }
    return result;
  }
  const toml::table& table(const toml::node& node, const std::string& what) const {
    if (const auto* value = node.as_table()) return *value;
    fail(node.source().begin.line, what + " must be a table");
  }
  const toml::table* optional_table(const std::string& key) const {
    const toml::node* node = table_.get(key);
    return node ? &table(*node, "\"" + key + "\"") : nullptr;
  }

 private:
  const toml::node& required(const std::string& key) const {
    const toml::node* node = table_.get(key);
    if (!node) fail(line(), what_ + " needs the key \"" + key + "\"");
    return *node;
  }

  std::string file_;
  const toml::table& table_;
  std::string what_;
};

toml::table parse(const std::filesystem::path& path) {
  const std::string file = path.filename().string();
  if (!std::filesystem::is_regular_file(path))
    throw Error("there is no experiment file " + path.string() +
                "; `hermesh list` names those that there are");
  try {
    return toml::parse_file(path.string());
  } catch (const toml::parse_error& error) {
    throw Error(file + ":" + std::to_string(std::max<toml::source_index>(error.source().begin.line, 1)) +
                ": " + std::string(error.description()));
  }
}

template <class Entry>
std::vector<std::string> names_of(std::span<const Entry> table) {
  std::vector<std::string> names;
  for (const Entry& entry : table) names.push_back(entry.name);
  return names;
}

/// An option may be written as a text, a number or a truth value; the variant's declaration judges the text.
std::string option_text(const Section& section, const std::string& key, const toml::node& node) {
  if (const auto* value = node.as_string()) return value->get();
  std::ostringstream text;
  if (const auto* integer = node.as_integer()) {
    text << integer->get();
  } else if (const auto* real = node.as_floating_point()) {
    text.precision(17);
    text << real->get();
    double shorter = 0.0;
    std::ostringstream brief;
    brief << real->get();
    std::istringstream(brief.str()) >> shorter;
    return shorter == real->get() ? brief.str() : text.str();
  } else if (const auto* flag = node.as_boolean()) {
    text << (flag->get() ? "true" : "false");
  } else {
    section.fail(node.source().begin.line, "the option \"" + key + "\" must be a text or a number");
  }
  return text.str();
}

VariantEntry read_variant(const Section& file, const toml::node& node,
                          std::span<const Extractor> extractors) {
  const Section section(file.file(), file.table(node, "a variant"), "a variant",
                        {"name", "label", "options"});
  VariantEntry entry;
  entry.name = section.text("name");
  const auto known = std::find_if(extractors.begin(), extractors.end(),
                                  [&](const Extractor& extractor) { return extractor.name == entry.name; });
  if (known == extractors.end())
    section.fail_at("name",
                    "there is no variant \"" + entry.name + "\"; there are " + joined(names_of(extractors)));
  entry.label = section.text_or("label", entry.name);
  const toml::table* options = section.optional_table("options");
  if (!options) return entry;
  for (const auto& [key, value] : *options) {
    const std::string name(key.str());
    entry.options[name] = option_text(section, name, value);
    try {
      Options(entry.name, known->options, {{name, entry.options[name]}});
    } catch (const Error& error) {
      section.fail(key.source().begin.line, error.what());
    }
  }
  return entry;
}

std::vector<VariantEntry> read_variants(const Section& file, std::span<const Extractor> extractors) {
  std::vector<VariantEntry> variants;
  std::set<std::string> labels;
  for (const toml::node& node : file.list("variants")) {
    variants.push_back(read_variant(file, node, extractors));
    if (!labels.insert(variants.back().label).second)
      file.fail(node.source().begin.line,
                "the label \"" + variants.back().label + "\" is used twice; a row is known by it");
  }
  return variants;
}

CaseEntry read_case(const Section& file, const toml::node& node, const std::vector<std::string>& cases) {
  const Section section(file.file(), file.table(node, "a case"), "a case",
                        {"name", "resolutions", "closeup", "view"});
  CaseEntry entry;
  entry.name = section.text("name");
  if (std::find(cases.begin(), cases.end(), entry.name) == cases.end())
    section.fail_at("name", "there is no case \"" + entry.name + "\"; there are " + joined(cases));
  for (const toml::node& item : section.list("resolutions"))
    entry.resolutions.push_back(static_cast<int>(section.integer(item, "resolutions", 2, 100'000)));
  if (section.has("closeup")) {
    const toml::array& list = section.list("closeup");
    if (list.size() != 4)
      section.fail_at("closeup", "\"closeup\" must be [x, y, z, size], fractions of the box");
    for (std::size_t i = 0; i < 3; ++i)
      entry.close_up.centre[i] = section.number(list[i], "closeup", 0.0, 1.0);
    entry.close_up.size = section.number(list[3], "closeup", 1e-6, 2.0);
  }
  if (section.has("view")) {
    const toml::array& list = section.list("view");
    if (list.size() != 2) section.fail_at("view", "\"view\" must be [azimuth, elevation] in degrees");
    entry.viewpoint = {section.number(list[0], "view", -360, 360), section.number(list[1], "view", -89, 89)};
  }
  return entry;
}

Tier read_tier(const Section& file, const std::string& name, const toml::table& table,
               const std::vector<std::string>& cases) {
  const Section section(
      file.file(), table, "[" + name + "]",
      {"cases", "repetitions", "seconds_per_variant", "samples", "pixels", "self_intersections"});
  Tier tier;
  tier.repetitions = static_cast<int>(section.integer_or("repetitions", tier.repetitions, 1, 1000));
  tier.seconds_per_variant = section.number_or("seconds_per_variant", tier.seconds_per_variant, 0.0, 1e5);
  tier.samples = section.integer_or("samples", tier.samples, 1, 1'000'000'000);
  tier.pixels = static_cast<int>(section.integer_or("pixels", tier.pixels, 0, 4000));
  tier.self_intersections = section.flag_or("self_intersections", tier.self_intersections);
  for (const toml::node& node : section.list("cases")) tier.cases.push_back(read_case(section, node, cases));
  return tier;
}

}  // namespace

Experiment read_experiment(const std::filesystem::path& path, const Vocabulary& vocabulary) {
  const toml::table table = parse(path);
  const Section file(path.filename().string(), table, "an experiment",
                     {"question", "voxelizers", "columns", "variants", "features", "quick", "full"});
  Experiment experiment;
  experiment.name = path.stem().string();
  experiment.question = file.text("question");
  experiment.voxelizers = file.names("voxelizers", "voxelizer", names_of(vocabulary.voxelizers));
  experiment.columns = file.names("columns", "column", vocabulary.columns);
  experiment.variants = read_variants(file, vocabulary.extractors);
  if (file.has("features")) experiment.features = file.number_or("features", 30.0, 0.0, 180.0);
  for (const std::string tier : {"quick", "full"})
    if (const toml::table* found = file.optional_table(tier))
      experiment.tiers[tier] = read_tier(file, tier, *found, vocabulary.cases);
  if (experiment.tiers.empty()) file.fail(1, "an experiment needs a table [quick] or [full] with its cases");
  return experiment;
}

std::string read_question(const std::filesystem::path& path) {
  const toml::table table = parse(path);
  const auto question = table["question"].value<std::string>();
  if (!question) throw Error(path.filename().string() + ":1: an experiment needs the key \"question\"");
  return *question;
}

}  // namespace hermesh
