#include "experiments/ablations/falsifier.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "algorithms/core/error.h"
#include "algorithms/core/shown.h"

namespace hermesh {

Falsifier::Falsifier(const std::string& rule) {
  std::istringstream words(rule);
  const auto refuse = [&](const std::string& word) {
    throw Error("\"" + shown(word) +
                "\" should not stand there: a falsifier compares low, high or estimate with a number by <, "
                "<=, > or >=, and "
                "joins comparisons by \"and\" and \"or\"");
  };
  any_of_.emplace_back();
  for (std::string name; words >> name;) {
    std::string relation, text;  // empty where the rule ends
    words >> relation >> text;
    if (name != "low" && name != "high" && name != "estimate") refuse(name);
    if (relation != "<" && relation != "<=" && relation != ">" && relation != ">=") refuse(relation);
    double number = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (text.empty() || error != std::errc() || end != text.data() + text.size() || !std::isfinite(number))
      refuse(text);
    using Of = Comparison::Of;
    any_of_.back().push_back({name == "low"    ? Of::kLow
                              : name == "high" ? Of::kHigh
                                               : Of::kEstimate,
                              relation, number});
    std::string joint;
    if (!(words >> joint)) return;
    if (joint != "and" && joint != "or") refuse(joint);
    if (joint == "or") any_of_.emplace_back();
  }
  refuse(rule);  // It is empty, or ends in a joint.
}

bool Falsifier::is_true_of(double low, double estimate, double high) const {
  const auto holds = [&](const Comparison& comparison) {
    const double value = comparison.of == Comparison::Of::kLow    ? low
                         : comparison.of == Comparison::Of::kHigh ? high
                                                                  : estimate;
    if (comparison.relation == "<") return value < comparison.number;
    if (comparison.relation == "<=") return value <= comparison.number;
    if (comparison.relation == ">") return value > comparison.number;
    return value >= comparison.number;
  };
  return std::ranges::any_of(any_of_, [&](const auto& all) { return std::ranges::all_of(all, holds); });
}

std::string Falsifier::misfit(double at_least, double at_most) const {
  // Truth changes at the numbers of the rule alone, so that places at, below and above each stand for all
  // intervals.
  std::vector<double> places = {-1e300, 1e300};
  const auto add = [&](double number) {
    if (!std::isfinite(number)) return;
    const double step = 1e-9 * std::max(1.0, std::abs(number));
    places.insert(places.end(), {number - step, number, number + step});
  };
  for (const auto& all : any_of_)
    for (const Comparison& comparison : all) add(comparison.number);
  add(at_least);
  add(at_most);
  std::ranges::sort(places);
  bool can_be_true = false;
  for (std::size_t i = 0; i < places.size(); ++i)
    for (std::size_t j = i; j < places.size(); ++j)
      for (std::size_t k = j; k < places.size(); ++k) {
        if (!is_true_of(places[i], places[j], places[k])) continue;
        can_be_true = true;
        if (places[i] >= at_least && places[k] <= at_most)
          return "it can be true of an interval within the range that is predicted";
      }
  return can_be_true ? "" : "it is true of no interval";
}

}  // namespace hermesh
