// What would falsify a prediction, as a rule on the interval of its effect: comparisons of `low`, `high` (the
// ends of the 95 % interval) or `estimate` with a number, joined by `and`, which binds more tightly, and
// `or`: "high < 1.2 or low > 3".
#pragma once

#include <string>
#include <vector>

namespace hermesh {

class Falsifier {
 public:
  /// @throws Error that names the word which it does not understand.
  explicit Falsifier(const std::string& rule);

  bool is_true_of(double low, double estimate, double high) const;

  /// Why the rule does not fit a predicted range of the effect; empty if it does. It must be false of every
  /// interval within the range, and true of some interval.
  std::string misfit(double at_least, double at_most) const;

 private:
  struct Comparison {
    enum class Of { kLow, kEstimate, kHigh } of;
    std::string relation;  ///< <, <=, >, >=
    double number;
  };
  std::vector<std::vector<Comparison>> any_of_;  ///< each inner list holds if all of its comparisons do
};

}  // namespace hermesh
