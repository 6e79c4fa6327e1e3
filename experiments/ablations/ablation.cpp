#include "experiments/ablations/ablation.h"

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace hermesh {
namespace {

constexpr std::array<const char*, 3> kMeasures = {"ratio", "difference", "count-ratio"};
constexpr std::array<const char*, 4> kLevels = {"variants", "voxelizers", "resolutions", "measured"};

template <class Names>
std::size_t index_of(const Names& names, const std::string& name) {
  std::size_t at = 0;
  while (at + 1 < names.size() && names[at] != name) ++at;
  return at;
}

// JSON has no infinity: a bound that there is not is null.
Json bound(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
double bound_or(const Json& value, double none) { return value.is_number() ? value.get<double>() : none; }

}  // namespace

std::string name_of(EffectMeasure measure) { return kMeasures[std::size_t(measure)]; }

Json to_json(const Ablation& ablation) {
  Json effects = Json::array();
  for (const PredictedEffect& effect : ablation.effects)
    effects.push_back({{"level", effect.level},
                       {"column", effect.column},
                       {"measure", name_of(effect.measure)},
                       {"better", effect.lower_is_better ? "lower" : "higher"},
                       {"prediction", effect.prediction},
                       {"at_least", bound(effect.at_least)},
                       {"at_most", bound(effect.at_most)},
                       {"falsified_if", effect.falsified_if}});
  return {{"factor", ablation.factor},
          {"levels", kLevels[std::size_t(ablation.levels)]},
          {"baseline", ablation.baseline},
          {"effects", std::move(effects)}};
}

Ablation ablation_from_json(const Json& json) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  Ablation ablation{
      json.at("factor"), LevelKind(index_of(kLevels, json.at("levels"))), json.at("baseline"), {}};
  for (const Json& effect : json.at("effects"))
    ablation.effects.push_back(
        {effect.at("level"), effect.at("column"), EffectMeasure(index_of(kMeasures, effect.at("measure"))),
         effect.at("better") == "lower", effect.at("prediction"), bound_or(effect.at("at_least"), -kNone),
         bound_or(effect.at("at_most"), kNone), effect.at("falsified_if")});
  return ablation;
}

}  // namespace hermesh
