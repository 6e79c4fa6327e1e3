#include "experiments/ablations/effect_report.h"

#include <cmath>
#include <limits>
#include <map>
#include <ostream>
#include <sstream>

#include "experiments/harness/table.h"

namespace hermesh {
namespace {

/// What tells a row's subject and level, by what the levels of the factor are.
struct Place {
  std::string model, subject, level;
};

Place place_of(const Json& row, LevelKind levels) {
  const std::string model = text_at(row, "/case/name"), resolution = text_at(row, "/resolution");
  const std::string variant = text_at(row, "/variant/label"), voxelizer = text_at(row, "/voxelization/label");
  switch (levels) {
    case LevelKind::kVariants:
      return {model, model + "/" + resolution + "/" + voxelizer, variant};
    case LevelKind::kVoxelizers:
      return {model, model + "/" + resolution + "/" + variant, voxelizer};
    case LevelKind::kResolutions:
      return {model, model + "/" + variant + "/" + voxelizer, resolution};
    case LevelKind::kMeasured:
      break;
  }
  const std::string measured = text_at(row, "/values/model");
  return {measured, measured + "/" + text_at(row, "/values/resolution"), text_at(row, "/values/level")};
}

/// NaN where a cell failed or the row has no such value.
double value_in(const Json& row, const std::string& name) {
  const auto number = [&](const Column& column) {
    const Json value = find(row, "/failed") ? Json(nullptr) : value_of(column, row);
    return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  };
  for (const Column& column : own_columns(row))
    if (column.name == name) return number(column);
  for (const Column& column : all_columns())
    if (column.name == name) return number(column);
  return std::numeric_limits<double>::quiet_NaN();
}

JudgedAblation judge_one(const std::vector<Json>& rows) {
  const Json& last = rows.back();
  JudgedAblation judged{text_at(last, "/experiment"),
                        text_at(last, "/tier"),
                        text_at(last, "/question"),
                        text_at(last, "/commit"),
                        ablation_from_json(last.at("ablation")),
                        last.at("ablation").value("prediction", Json::object()),
                        0,
                        {}};
  std::map<std::string, std::map<std::string, const Json*>> subjects;  // by subject, then by level
  std::map<std::string, std::string> models;
  for (const Json& row : rows) {
    if (row.at("ablation") != last.at("ablation")) continue;
    const Place place = place_of(row, judged.ablation.levels);
    subjects[place.subject][place.level] = &row;
    models[place.subject] = place.model;
  }
  judged.subjects = subjects.size();
  for (const PredictedEffect& effect : judged.ablation.effects) {
    std::vector<PairedValues> pairs;
    for (const auto& [subject, by_level] : subjects) {
      const auto baseline = by_level.find(judged.ablation.baseline), level = by_level.find(effect.level);
      if (baseline == by_level.end() || level == by_level.end()) continue;
      pairs.push_back({models[subject], value_in(*baseline->second, effect.column),
                       value_in(*level->second, effect.column)});
    }
    const EffectSize size = effect_size(pairs, effect.measure);
    judged.effects.push_back({effect, size, judge_prediction(effect, size)});
  }
  return judged;
}

std::string range_text(double low, double high) {
  if (std::isinf(low)) return "≤ " + readable(high);
  if (std::isinf(high)) return "≥ " + readable(low);
  return readable(low) + " to " + readable(high);
}

std::string interval_text(const EffectSize& size) {
  return size.models < 2 ? "–" : readable(size.interval.low) + " to " + readable(size.interval.high);
}

std::string verdict_text(const JudgedAblation& judged, const JudgedEffect& effect) {
  const std::string verdict = name_of(effect.verdict);
  return text_at(judged.prediction, "/commit").empty() ? verdict + ", not predicted beforehand" : verdict;
}

void write_lines(const std::vector<JudgedAblation>& ablations, bool with_name, std::ostream& out) {
  out << (with_name ? "\n| ablation | factor " : "\n")
      << "| level | against | column | measure | better | models | pairs | left out | effect | 95 % interval "
         "| predicted | falsified if | verdict |\n"
      << (with_name ? "| --- | --- " : "")
      << "| --- | --- | --- | --- | --- | --: | --: | --: | --: | --- | --- | --- | --- |\n";
  for (const JudgedAblation& judged : ablations)
    for (const JudgedEffect& effect : judged.effects) {
      const EffectSize& size = effect.size;
      const PredictedEffect& predicted = effect.predicted;
      if (with_name) out << "| " << judged.experiment << " | " << judged.ablation.factor << " ";
      out << "| " << predicted.level << " | " << judged.ablation.baseline << " | " << predicted.column
          << " | " << name_of(predicted.measure) << " | " << (predicted.lower_is_better ? "lower" : "higher")
          << " | " << size.models << " | " << size.pairs << " | " << size.left_out << " | "
          << (size.models == 0 ? "–" : readable(size.estimate)) << " | " << interval_text(size) << " | "
          << range_text(predicted.at_least, predicted.at_most) << " | " << predicted.falsified_if << " | "
          << verdict_text(judged, effect) << " |\n";
    }
}

std::string counts_text(const std::vector<JudgedAblation>& ablations) {
  std::map<PredictionVerdict, int> counts;
  for (const JudgedAblation& judged : ablations)
    for (const JudgedEffect& effect : judged.effects) ++counts[effect.verdict];
  using enum PredictionVerdict;
  return std::to_string(counts[kHolds]) + " predictions hold, " + std::to_string(counts[kFalsified]) +
         " are falsified, and " + std::to_string(counts[kUndecided]) + " are undecided";
}

}  // namespace

std::vector<JudgedAblation> judge_ablations(const std::vector<Json>& rows) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<Json>> own;
  for (const RowGroup& group : latest_groups(rows))
    for (const Json& row : group.rows) {
      if (!find(row, "/ablation")) continue;
      const std::string key = text_at(row, "/experiment") + "\n" + text_at(row, "/tier");
      if (!own.contains(key)) order.push_back(key);
      own[key].push_back(row);
    }
  std::vector<JudgedAblation> judged;
  for (const std::string& key : order) judged.push_back(judge_one(own[key]));
  return judged;
}

void write_effects(const JudgedAblation& judged, std::ostream& out) {
  const std::string commit = text_at(judged.prediction, "/commit");
  out << "### effects of " << judged.ablation.factor << "\n\n- subjects: " << judged.subjects
      << "; baseline: " << judged.ablation.baseline << "\n- prediction: "
      << (commit.empty() ? text_at(judged.prediction, "/note")
                         : text_at(judged.prediction, "/file") + " as commit " + commit.substr(0, 12) +
                               " of " + text_at(judged.prediction, "/date") +
                               " left it; the rows are of commit " + judged.commit.substr(0, 12))
      << "\n- interval: hull of Student's t and of the BCa bootstrap (Efron & Tibshirani 1993) over models, "
         "a model's resolutions averaged\n"
      << "- verdicts: " << counts_text({judged}) << "\n";
  write_lines({judged}, false, out);
  out << '\n';
  std::string sentence;
  for (const JudgedEffect& effect : judged.effects) {
    if (effect.predicted.prediction == sentence) continue;  // several levels may share one
    sentence = effect.predicted.prediction;
    out << "- predicted of " << effect.predicted.column << ": " << sentence << "\n";
  }
  out << '\n';
}

std::string summary_of(const std::vector<JudgedAblation>& ablations) {
  if (ablations.empty()) return "\nNo ablation has rows yet.\n";
  std::ostringstream out;
  out << "\nOf " << ablations.size() << " ablations " << counts_text(ablations) << ".\n";
  write_lines(ablations, true, out);
  return out.str();
}

}  // namespace hermesh
