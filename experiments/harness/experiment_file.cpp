#include "experiments/harness/experiment_file.h"

#include <algorithm>
#include <regex>
#include <set>

#include "algorithms/io/mesh_file.h"
#include "experiments/ablations/read_ablation.h"
#include "experiments/harness/command_extractor.h"
#include "experiments/harness/toml_section.h"

namespace hermesh {
namespace {

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
    section.fail(node.source().begin.line, "the option \"" + shown(key) + "\" must be a text or a number");
  }
  return text.str();
}

/// A variant by its table of `options` in the file, checked against the declarations.
template <class Entry>
VariantEntry read_variant(const Section& file, const toml::node& node, const std::string& kind,
                          std::span<const Entry> table) {
  const Section section(file.file(), file.table(node, "a " + kind), "a " + kind,
                        kind == "variant" ? std::vector<std::string>{"name", "label", "options", "uniform", "command"}
                                          : std::vector<std::string>{"name", "label", "options"});
  VariantEntry entry;
  if (section.has("command")) {
    for (const char* key : {"name", "options"})
      if (section.has(key)) section.fail_at(key, "a command has a \"label\", and \"" + std::string(key) + "\" has no place beside it");
    entry.command = section.text("command");
    entry.label = section.text("label");
    entry.name = "command " + entry.label;
    entry.uniform = section.text_or("uniform", "");
    try {
      command_extractor(entry.name, entry.command);
    } catch (const Error& error) {
      section.fail_at("command", error.what());
    }
    return entry;
  }
  entry.name = section.text("name");
  const auto known =
      std::find_if(table.begin(), table.end(), [&](const Entry& each) { return each.name == entry.name; });
  if (known == table.end())
    section.fail_at("name",
                    "there is no " + kind + " \"" + shown(entry.name) + "\"; there are " +
                        joined(likest_first(names_of(table), entry.name)));
  entry.label = section.text_or("label", entry.name);
  entry.uniform = section.text_or("uniform", "");
  const toml::table* options = section.optional_table("options");
  if (!options) return entry;
  for (const auto& [key, value] : *options)
    entry.options[std::string(key.str())] = option_text(section, std::string(key.str()), value);
  try {
    Options(entry.name, known->options, entry.options);
  } catch (const Error& error) {
    // All of them together, for one may need another; the sentence names the one that is wrong.
    const std::string sentence = error.what();
    auto line = options->begin()->first.source().begin.line;
    for (const auto& [key, value] : *options)
      if (sentence.find("'" + std::string(key.str()) + "'") != std::string::npos) {
        line = key.source().begin.line;
        break;
      }
    section.fail(line, shown(sentence, 200));
  }
  return entry;
}

template <class Entry>
std::vector<VariantEntry> read_variants(const Section& file, const std::string& kind,
                                        std::span<const Entry> table) {
  std::vector<VariantEntry> variants;
  std::set<std::string> labels;
  for (const toml::node& node : file.list(kind + "s")) {
    variants.push_back(read_variant(file, node, kind, table));
    if (const std::string& uniform = variants.back().uniform; !uniform.empty() && !labels.contains(uniform))
      file.fail(node.source().begin.line,
                "there is no " + kind + " with the label \"" + shown(uniform) + "\" above, as uniform has it");
    if (!labels.insert(variants.back().label).second)
      file.fail(node.source().begin.line,
                "the label \"" + shown(variants.back().label) + "\" is used twice; a row is known by it");
  }
  return variants;
}

/// Either names or tables.
std::vector<VariantEntry> read_voxelizers(const Section& file, std::span<const Voxelizer> table) {
  if (file.list("voxelizers")[0].is_table()) return read_variants(file, "voxelizer", table);
  std::vector<VariantEntry> voxelizers;
  for (const std::string& name : file.names("voxelizers", "voxelizer", names_of(table)))
    voxelizers.push_back({name, name, {}});
  return voxelizers;
}

std::vector<double> read_numbers(const Section& section, const std::string& key, double lower, double upper) {
  std::vector<double> numbers;
  for (const toml::node& item : section.list(key)) numbers.push_back(section.number(item, key, lower, upper));
  return numbers;
}

void read_view(const Section& section, CaseEntry& entry) {
  if (section.has("closeup")) {
    const std::vector<double> list = read_numbers(section, "closeup", 0.0, 2.0);
    if (list.size() != 4)
      section.fail_at("closeup", "\"closeup\" must be [x, y, z, size], fractions of the box");
    for (std::size_t i = 0; i < 3; ++i) {
      if (list[i] > 1.0) section.fail_at("closeup", "the centre of \"closeup\" must lie in the box, 0 to 1");
      entry.close_up.centre[i] = list[i];
    }
    if (list[3] < 1e-6) section.fail_at("closeup", "the size of \"closeup\" must be above 0");
    entry.close_up.size = list[3];
  }
  if (section.has("view")) {
    const toml::array& list = section.list("view");
    if (list.size() != 2) section.fail_at("view", "\"view\" must be [azimuth, elevation] in degrees");
    entry.viewpoint = {section.number(list[0], "view", -360, 360), section.number(list[1], "view", -89, 89)};
  }
}

/// "all" or a number of them.
std::int64_t read_amount(const Section& section, const std::string& key, std::int64_t fallback) {
  if (!section.has(key)) return fallback;
  if (section.is_text(key)) {
    section.choice(key, {"all"});
    return JudgedBy::kAll;
  }
  return section.integer_or(key, fallback, 1, 100'000'000);
}

JudgedBy read_judged(const Section& section, const std::vector<std::string>& cases) {
  using Signs = JudgedBy::Signs;
  constexpr std::int64_t kSamples = 10'000;
  JudgedBy judged;
  if (section.has("distances")) judged.distances = read_amount(section, "distances", 0);
  if (section.has("signs"))
    judged.signs = Signs(section.choice("signs", {"none", "parity", "unanimous-parity", "winding-number"}));
  const std::int64_t usual = judged.signs == Signs::kParity ? JudgedBy::kAll : kSamples;
  judged.sign_samples = read_amount(section, "sign_samples", usual);
  if (judged.signs != Signs::kParity && judged.sign_samples == JudgedBy::kAll)
    section.fail_at("sign_samples", "only parity can judge the signs of all voxels");
  judged.to_boundary = section.flag_or("to_boundary", false);
  judged.solid = section.text_or("solid", "");
  if (!judged.solid.empty() && std::find(cases.begin(), cases.end(), judged.solid) == cases.end())
    section.fail_at("solid", "there is no case \"" + shown(judged.solid) + "\"; there are " +
                                 joined(likest_first(cases, judged.solid)));
  return judged;
}

std::optional<Sweep> read_sweep(const Section& section) {
  const toml::table* table = section.optional_table("sweep");
  if (!table) return std::nullopt;
  if (table->size() != 1)
    section.fail_at("sweep", "\"sweep\" must be { parameter = [values] } of the case's recipe");
  const std::string parameter(table->begin()->first.str());
  const Section values(section.file(), *table, "a sweep", {parameter});
  return Sweep{parameter, read_numbers(values, parameter, -1e9, 1e9)};
}

void read_voxel_sizes(const Section& section, CaseEntry& entry) {
  entry.voxel_sizes = read_numbers(section, "voxel_sizes", 1e-9, 1e9);
  if (section.has("length")) entry.length = section.number_or("length", 1.0, 1e-9, 1e9);
  if (!section.has("published_seconds")) return;
  entry.published_seconds = read_numbers(section, "published_seconds", 0.0, 1e9);
  if (entry.published_seconds.size() != entry.voxel_sizes.size())
    section.fail_at("published_seconds", "\"published_seconds\" must have a value for every voxel size");
}

CaseEntry read_case(const Section& file, const toml::node& node, ExperimentKind kind,
                    const std::vector<std::string>& cases) {
  const bool extraction = kind == ExperimentKind::kExtraction;
  const Section section(
      file.file(), file.table(node, "a case"), "a case",
      extraction
          ? std::vector<std::string>{"name", "resolutions", "closeup", "view"}
          : std::vector<std::string>{"name", "resolutions", "voxel_sizes", "length", "published_seconds",
                                     "sweep", "distances", "signs", "sign_samples", "solid", "to_boundary"});
  CaseEntry entry;
  entry.name = section.text("name");
  // A case may be a mesh file, too; one that is not there is no mistake in this file, and makes rows that say so.
  if (std::find(cases.begin(), cases.end(), entry.name) == cases.end() && !is_mesh_path(entry.name) &&
      !std::filesystem::is_regular_file(entry.name))
    section.fail_at("name", "there is no case \"" + shown(entry.name) + "\", nor such a file; there are " +
                                joined(likest_first(cases, entry.name)));
  if (section.has("voxel_sizes")) {
    if (section.has("resolutions"))
      section.fail_at("resolutions", "a case has either \"resolutions\" or \"voxel_sizes\"");
    read_voxel_sizes(section, entry);
  } else {
    for (const toml::node& item : section.list("resolutions"))
      entry.resolutions.push_back(static_cast<int>(section.integer(item, "resolutions", 2, 100'000)));
  }
  if (extraction) {
    read_view(section, entry);
    return entry;
  }
  entry.sweep = read_sweep(section);
  entry.judged = read_judged(section, cases);
  return entry;
}

Tier read_tier(const Section& file, const std::string& name, const toml::table& table, ExperimentKind kind,
               const std::vector<std::string>& cases) {
  const bool extraction = kind == ExperimentKind::kExtraction;
  const Section section(
      file.file(), table, "[" + name + "]",
      extraction ? std::vector<std::string>{"cases", "repetitions", "seconds_per_variant", "samples",
                                            "pixels", "self_intersections", "timeout", "memory"}
                 : std::vector<std::string>{"cases", "repetitions", "seconds_per_variant", "components", "timeout", "memory"});
  Tier tier;
  tier.repetitions = static_cast<int>(section.integer_or("repetitions", tier.repetitions, 1, 1000));
  tier.seconds_per_variant = section.number_or("seconds_per_variant", tier.seconds_per_variant, 0.0, 1e5);
  tier.samples = section.integer_or("samples", tier.samples, 1, 1'000'000'000);
  tier.pixels = static_cast<int>(section.integer_or("pixels", tier.pixels, 0, 4000));
  tier.self_intersections = section.flag_or("self_intersections", tier.self_intersections);
  tier.components = section.flag_or("components", tier.components);
  if (section.has("timeout")) tier.timeout = section.number_or("timeout", 0.0, 0.01, 1e7);
  if (section.has("memory")) tier.memory_mib = section.number_or("memory", 0.0, 16.0, 1e9);
  for (const toml::node& node : section.list("cases"))
    tier.cases.push_back(read_case(section, node, kind, cases));
  return tier;
}

Plot read_plot(const Section& file, const toml::node& node, const Vocabulary& vocabulary) {
  const Section section(
      file.file(), file.table(node, "a plot"), "a plot",
      {"name", "title", "case", "x", "y", "x_label", "y_label", "log_x", "log_y", "percent", "by_variant",
       "resolution", "categories", "emphasised", "note"});
  const auto known = [&](const std::string& key, const std::string& name,
                         const std::vector<std::string>& names) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      section.fail_at(key,
                      "there is no " + std::string(key == "case" ? "case" : "column") + " \"" + shown(name) + "\"; there are " +
                               joined(likest_first(names, name)));
    return name;
  };
  Plot plot;
  plot.name = section.text("name");
  plot.title = section.text("title");
  if (section.has("case")) plot.case_name = known("case", section.text("case"), vocabulary.cases);
  plot.x = known("x", section.text("x"), vocabulary.columns);
  plot.y = section.names("y", "column", vocabulary.columns);
  plot.x_label = section.text("x_label");
  plot.y_label = section.text("y_label");
  plot.log_x = section.flag_or("log_x", false);
  plot.log_y = section.flag_or("log_y", false);
  plot.percent = section.flag_or("percent", false);
  plot.by_variant = section.flag_or("by_variant", false);
  plot.resolution = static_cast<int>(section.integer_or("resolution", 0, 0, 1 << 20));
  plot.categories = section.flag_or("categories", false);
  if (section.has("emphasised"))
    for (const toml::node& name : section.list("emphasised")) {
      if (!name.is_string()) section.fail_at("emphasised", "\"emphasised\" must be a list of texts");
      plot.emphasised.push_back(name.value<std::string>().value());
    }
  if (section.has("note")) plot.note = section.text("note");
  return plot;
}

/// A plot's case is one of the measurement's tables.
Vocabulary words_of(const Measurement& measurement) {
  Vocabulary words;
  for (const MeasuredTable& table : measurement.tables) {
    words.cases.push_back(table.name);
    for (const MeasuredColumn& column : table.columns) words.columns.push_back(column.name);
  }
  return words;
}

Tier read_parameters(const Section& file, const std::string& name, const toml::table& table,
                     const Measurement& measurement) {
  const Section section(file.file(), table, "[" + name + "]", names_of(std::span(measurement.parameters)));
  Tier tier;
  for (const auto& [key, value] : table)
    tier.parameters[std::string(key.str())] = option_text(section, std::string(key.str()), value);
  try {
    Options(measurement.name, measurement.parameters, tier.parameters);
  } catch (const Error& error) {
    section.fail(section.line(), shown(error.what(), 200));
  }
  return tier;
}

const std::vector<std::string> kKeys = {"kind",          "question",      "shows", "voxelizers",  "columns",
                                        "variants",      "features",      "plots", "measurement", "seed",
                                        "exterior_band", "interior_band", "quick", "full",
                                        // Those of an ablation.
                                        "factor", "levels", "baseline", "effects"};

Experiment read_measurement(const Section& file, const Vocabulary& vocabulary, Experiment experiment) {
  for (const char* key : {"voxelizers", "columns", "variants", "features", "exterior_band", "interior_band"})
    if (file.has(key)) file.fail_at(key, "\"" + std::string(key) + "\" has no place in a measurement");
  const Measurement& measurement =
      vocabulary.measurements[file.choice("measurement", names_of(vocabulary.measurements))];
  experiment.measurement = measurement.name;
  experiment.seed = std::uint64_t(file.integer_or("seed", 1, 0, 1'000'000'000));
  if (file.has("plots"))
    for (const toml::node& node : file.list("plots"))
      experiment.plots.push_back(read_plot(file, node, words_of(measurement)));
  for (const std::string tier : {"quick", "full"})
    if (const toml::table* found = file.optional_table(tier))
      experiment.tiers[tier] = read_parameters(file, tier, *found, measurement);
  if (experiment.tiers.empty())
    file.fail(1, "a measurement needs a table [quick] or [full], which may be empty");
  read_ablation(file, experiment, vocabulary);
  return experiment;
}

void read_extraction(const Section& file, const Vocabulary& vocabulary, Experiment& experiment) {
  for (const char* key : {"exterior_band", "interior_band"})
    if (file.has(key)) file.fail_at(key, "\"" + std::string(key) + "\" needs kind = \"voxelization\"");
  experiment.variants = read_variants(file, "variant", vocabulary.extractors);
  if (file.has("features")) experiment.features = file.number_or("features", 30.0, 0.0, 180.0);
}

void read_voxelization(const Section& file, Experiment& experiment) {
  for (const char* key : {"variants", "features"})
    if (file.has(key)) file.fail_at(key, "\"" + std::string(key) + "\" needs kind = \"extraction\"");
  experiment.exterior_band = file.number_or("exterior_band", 3.0, 1.0, 1e4);
  experiment.interior_band = file.number_or("interior_band", 3.0, 1.0, 1e4);
}

std::vector<std::string> read_shows(const Section& file) {
  std::vector<std::string> shows;
  if (!file.has("shows")) return shows;
  static const std::regex kNumber("(table|figure)_[0-9]+_[0-9]+");
  for (const toml::node& node : file.list("shows")) {
    const auto* value = node.as_string();
    if (!value || !std::regex_match(value->get(), kNumber))
      file.fail(node.source().begin.line, "\"shows\" must be a list of tables and figures such as \"figure_9_8\"");
    shows.push_back(value->get());
  }
  return shows;
}

}  // namespace

Experiment read_experiment(const std::filesystem::path& path, const Vocabulary& vocabulary) {
  const toml::table table = parse_toml(path);
  const Section file(path.filename().string(), table, "an experiment", kKeys);
  Experiment experiment;
  experiment.name = path.stem().string();
  if (file.has("kind"))
    experiment.kind = ExperimentKind(file.choice("kind", {"extraction", "voxelization", "measurement"}));
  experiment.question = file.text("question");
  experiment.shows = read_shows(file);
  if (experiment.kind == ExperimentKind::kMeasurement) return read_measurement(file, vocabulary, experiment);
  for (const char* key : {"measurement", "seed"})
    if (file.has(key)) file.fail_at(key, "\"" + std::string(key) + "\" needs kind = \"measurement\"");
  experiment.voxelizers = read_voxelizers(file, vocabulary.voxelizers);
  experiment.columns = file.names("columns", "column", vocabulary.columns);
  const bool extraction = experiment.kind == ExperimentKind::kExtraction;
  if (extraction)
    read_extraction(file, vocabulary, experiment);
  else
    read_voxelization(file, experiment);
  if (file.has("plots"))
    for (const toml::node& node : file.list("plots"))
      experiment.plots.push_back(read_plot(file, node, vocabulary));
  for (const std::string tier : {"quick", "full"})
    if (const toml::table* found = file.optional_table(tier))
      experiment.tiers[tier] = read_tier(file, tier, *found, experiment.kind, vocabulary.cases);
  if (experiment.tiers.empty()) file.fail(1, "an experiment needs a table [quick] or [full] with its cases");
  read_ablation(file, experiment, vocabulary);
  return experiment;
}

ExperimentHead read_head(const std::filesystem::path& path) {
  const toml::table table = parse_toml(path);
  const auto question = table["question"].value<std::string>();
  if (!question) throw Error(path.filename().string() + ":1: an experiment needs the key \"question\"");
  return {*question, read_shows(Section(path.filename().string(), table, "an experiment", kKeys))};
}

}  // namespace hermesh
