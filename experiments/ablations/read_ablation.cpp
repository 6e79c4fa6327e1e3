#include "experiments/ablations/read_ablation.h"

#include <algorithm>
#include <array>

#include "experiments/ablations/falsifier.h"
#include "experiments/harness/experiment_file.h"
#include "experiments/harness/toml_section.h"

namespace hermesh {
namespace {

std::string known_text(const Section& section, const std::string& key, const std::string& kind,
                       const std::vector<std::string>& known) {
  const std::string text = section.text(key);
  if (std::ranges::find(known, text) == known.end())
    section.fail_at(key, "there is no " + kind + " \"" + shown(text) + "\"; there are " +
                             joined(likest_first(known, text)));
  return text;
}

/// One [[effects]] table, for each of its levels.
std::vector<PredictedEffect> read_effects(const Section& file, const toml::node& node,
                                          const std::string& baseline, const std::vector<std::string>& levels,
                                          const std::vector<std::string>& columns) {
  const Section section(
      file.file(), file.table(node, "an effect"), "an effect",
      {"levels", "column", "measure", "better", "prediction", "at_least", "at_most", "falsified_if"});
  constexpr double kLargest = 1e12;
  PredictedEffect effect;
  effect.column = known_text(section, "column", "column", columns);
  effect.measure = EffectMeasure(section.choice("measure", {"ratio", "difference", "count-ratio"}));
  effect.lower_is_better = section.choice("better", {"lower", "higher"}) == 0;
  effect.prediction = section.text("prediction");
  if (!section.has("at_least") && !section.has("at_most"))
    section.fail(section.line(), "a prediction needs its size: \"at_least\", \"at_most\", or both");
  effect.at_least = section.number_or("at_least", effect.at_least, -kLargest, kLargest);
  effect.at_most = section.number_or("at_most", effect.at_most, -kLargest, kLargest);
  if (effect.at_least > effect.at_most) section.fail_at("at_most", "\"at_most\" is below \"at_least\"");
  effect.falsified_if = section.text("falsified_if");
  try {
    if (const std::string misfit = Falsifier(effect.falsified_if).misfit(effect.at_least, effect.at_most);
        !misfit.empty())
      section.fail_at("falsified_if", "\"falsified_if\" does not fit the prediction: " + misfit);
  } catch (const Error& error) {
    const std::string sentence = error.what();
    section.fail_at("falsified_if",
                    sentence.substr(sentence.starts_with(file.file()) ? sentence.find(": ") + 2 : 0));
  }
  std::vector<PredictedEffect> effects;
  for (const std::string& level : section.names("levels", "level", levels)) {
    if (level == baseline)
      section.fail_at("levels", "the level \"" + shown(level) + "\" is the baseline itself");
    effects.push_back(effect);
    effects.back().level = level;
  }
  return effects;
}

/// What may be a level, where the levels are those parts of the file.
std::vector<std::string> labels_of(const Experiment& experiment, LevelKind kind) {
  std::vector<std::string> labels;
  if (kind == LevelKind::kVariants)
    for (const VariantEntry& variant : experiment.contenders()) labels.push_back(variant.label);
  if (kind == LevelKind::kVoxelizers && experiment.kind == ExperimentKind::kExtraction)
    for (const VariantEntry& voxelizer : experiment.voxelizers) labels.push_back(voxelizer.label);
  if (kind == LevelKind::kResolutions)
    for (const auto& [name, tier] : experiment.tiers)
      for (const CaseEntry& entry : tier.cases)
        for (const int resolution : entry.resolutions)
          if (const std::string label = std::to_string(resolution);
              std::ranges::find(labels, label) == labels.end())
            labels.push_back(label);
  return labels;
}

/// Columns of a measurement are its own.
std::vector<std::string> columns_of(const Experiment& experiment, const Vocabulary& vocabulary) {
  if (experiment.kind != ExperimentKind::kMeasurement) return vocabulary.columns;
  std::vector<std::string> columns;
  for (const Measurement& measurement : vocabulary.measurements)
    if (measurement.name == experiment.measurement)
      for (const MeasuredTable& table : measurement.tables)
        for (const MeasuredColumn& column : table.columns) columns.push_back(column.name);
  return columns;
}

std::vector<std::string> measured_levels(const Section& file) {
  std::vector<std::string> levels;
  for (const toml::node& node : file.list("levels")) {
    const auto* level = node.as_string();
    if (!level)
      file.fail(node.source().begin.line,
                "\"levels\" must be a list of texts, or say what they are in the file");
    levels.push_back(level->get());
  }
  return levels;
}

}  // namespace

std::optional<Ablation> read_ablation(const Section& file, const Experiment& experiment,
                                      const Vocabulary& vocabulary) {
  if (!file.has("factor")) {
    for (const char* key : {"levels", "baseline", "effects"})
      if (file.has(key))
        file.fail_at(
            key, "\"" + std::string(key) + "\" needs the key \"factor\", which makes the file an ablation");
    return std::nullopt;
  }
  Ablation ablation;
  ablation.factor = file.text("factor");
  const bool measured = experiment.kind == ExperimentKind::kMeasurement;
  ablation.levels = measured ? LevelKind::kMeasured
                             : LevelKind(file.choice("levels", {"variants", "voxelizers", "resolutions"}));
  const std::vector<std::string> levels =
      measured ? measured_levels(file) : labels_of(experiment, ablation.levels);
  if (levels.size() < 2)
    file.fail_at("levels", "an ablation needs two levels of its factor, and these are fewer");
  ablation.baseline = known_text(file, "baseline", "level", levels);
  const std::vector<std::string> columns = columns_of(experiment, vocabulary);
  for (const toml::node& node : file.list("effects"))
    for (PredictedEffect& effect : read_effects(file, node, ablation.baseline, levels, columns))
      ablation.effects.push_back(std::move(effect));
  return ablation;
}

std::optional<Ablation> read_ablation(const std::filesystem::path& path, const Experiment& experiment,
                                      const Vocabulary& vocabulary) {
  const toml::table table = parse_toml(path);
  std::vector<std::string> keys;
  for (const auto& [key, value] : table) keys.emplace_back(key.str());
  return read_ablation(Section(path.filename().string(), table, "an experiment", keys), experiment,
                       vocabulary);
}

}  // namespace hermesh
