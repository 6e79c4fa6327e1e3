// An ablation: an experiment that changes one factor, and says beforehand what that will do.
//
// An experiment file with the key `factor` is one (experiments/ablations/predictions/ablation_truncation.toml
// explains the keys). Its cells are those of any experiment; its effects are paired differences between a
// level of the factor and the baseline, over subjects.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// How two paired values become one effect.
enum class EffectMeasure {
  kRatio,  ///< level ÷ baseline, averaged geometrically; a pair with a value that is not above 0 has none
  kDifference,  ///< level − baseline, in the column's unit
  kCountRatio,  ///< (level + 1) ÷ (baseline + 1), averaged geometrically, for counts that may be 0
};

/// What the levels of the factor are in the file.
enum class LevelKind { kVariants, kVoxelizers, kResolutions, kMeasured };

/// One effect and what was predicted of it.
struct PredictedEffect {
  std::string level;
  std::string column;
  EffectMeasure measure = EffectMeasure::kRatio;
  bool lower_is_better = true;
  std::string prediction;                                      ///< a sentence with its reason
  double at_least = -std::numeric_limits<double>::infinity();  ///< range of the effect that is predicted
  double at_most = std::numeric_limits<double>::infinity();
  std::string falsified_if;  ///< a rule on the interval (falsifier.h)
};

struct Ablation {
  std::string factor;
  LevelKind levels = LevelKind::kVariants;
  std::string baseline;
  std::vector<PredictedEffect> effects;
};

/// What a row keeps of it, so that a report needs the rows alone.
Json to_json(const Ablation& ablation);
/// @throws nlohmann::json::exception for JSON that to_json() did not make.
Ablation ablation_from_json(const Json& json);

/// "ratio", "difference", "count-ratio".
std::string name_of(EffectMeasure measure);

}  // namespace hermesh
