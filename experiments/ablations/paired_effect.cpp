#include "experiments/ablations/paired_effect.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>

#include "experiments/ablations/falsifier.h"

namespace hermesh {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kTail = 0.025;  // of a two-sided 95 %

double mean_of(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

double normal_below(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// The place where an increasing function reaches `value`, by bisection.
template <class Function>
double inverse(const Function& function, double value, double low, double high) {
  constexpr int kSteps = 200;  // more than a double can tell apart
  for (int i = 0; i < kSteps; ++i) {
    const double middle = 0.5 * (low + high);
    (function(middle) < value ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

double normal_quantile(double p) { return inverse(normal_below, p, -40.0, 40.0); }

/// The share of Student's t below t: the finite sums of Abramowitz & Stegun 1964, 26.7.3 and 26.7.4.
double student_below(double t, int degrees) {
  const double theta = std::atan(t / std::sqrt(double(degrees)));
  const double sine = std::sin(theta), cosine = std::cos(theta);
  double within = 0.0;  // between -t and t, with the sign of t
  if (degrees % 2 == 1) {
    double term = cosine, sum = degrees > 1 ? term : 0.0;
    for (int k = 3; k < degrees; k += 2) sum += term *= cosine * cosine * (k - 1) / k;
    within = 2.0 / std::numbers::pi * (theta + sine * sum);
  } else {
    double term = 1.0, sum = term;
    for (int k = 2; k < degrees; k += 2) sum += term *= cosine * cosine * (k - 1) / k;
    within = sine * sum;
  }
  return 0.5 + 0.5 * within;
}

bool all_equal(std::span<const double> values) {
  return std::ranges::all_of(values, [&](double value) { return value == values[0]; });
}

/// The effect of one pair on the scale that is averaged: logarithms for ratios.
std::optional<double> effect_of(const PairedValues& pair, EffectMeasure measure) {
  if (!std::isfinite(pair.level) || !std::isfinite(pair.baseline)) return std::nullopt;
  if (measure == EffectMeasure::kDifference) return pair.level - pair.baseline;
  const double plus = measure == EffectMeasure::kCountRatio ? 1.0 : 0.0;
  const double level = pair.level + plus, baseline = pair.baseline + plus;
  if (level <= 0.0 || baseline <= 0.0) return std::nullopt;
  return std::log(level / baseline);
}

Interval exponential(const Interval& interval) { return {std::exp(interval.low), std::exp(interval.high)}; }

}  // namespace

double student_quantile(double p, int degrees) {
  // One degree has the heaviest tails; 1e9 is beyond its quantile at 1e-9.
  return inverse([&](double t) { return student_below(t, degrees); }, p, -1e9, 1e9);
}

Interval student_interval(std::span<const double> values) {
  const double mean = mean_of(values), n = double(values.size());
  double squares = 0.0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  const double half =
      student_quantile(1.0 - kTail, int(values.size()) - 1) * std::sqrt(squares / (n - 1.0) / n);
  return all_equal(values) ? Interval{values[0], values[0]} : Interval{mean - half, mean + half};
}

Interval bootstrap_interval(std::span<const double> values, std::uint64_t seed) {
  constexpr std::size_t kResamples = 10'000;
  const std::size_t n = values.size();
  if (all_equal(values)) return {values[0], values[0]};
  const double mean = mean_of(values);
  std::mt19937_64 random(seed);
  std::vector<double> means(kResamples);
  for (double& resampled : means) {
    double sum = 0.0;
    // The high half times n is an index that does not depend on a library's distributions.
    for (std::size_t i = 0; i < n; ++i) sum += values[((random() >> 32) * n) >> 32];
    resampled = sum / double(n);
  }
  std::ranges::sort(means);
  // Bias: how far the estimate is from the resamples' middle, a tie counting one half (equation 14.14).
  const auto [first, last] = std::ranges::equal_range(means, mean);
  const double below = double(first - means.begin()) + 0.5 * double(last - first);
  const double bias =
      normal_quantile(std::clamp(below / double(kResamples), 0.5 / kResamples, 1.0 - 0.5 / kResamples));
  // Acceleration from the jackknife (equation 14.15). Leaving one value out moves a mean against that value.
  double squares = 0.0, cubes = 0.0;
  for (const double value : values) {
    const double moved = (value - mean) / double(n - 1);
    squares += moved * moved;
    cubes += moved * moved * moved;
  }
  const double acceleration = cubes / (6.0 * std::pow(squares, 1.5));
  const auto end = [&](double p) {
    const double z = bias + normal_quantile(p);
    const double share = normal_below(bias + z / (1.0 - acceleration * z));
    return means[std::min(kResamples - 1, std::size_t(share * double(kResamples)))];
  };
  return {end(kTail), end(1.0 - kTail)};
}

EffectSize effect_size(std::span<const PairedValues> pairs, EffectMeasure measure) {
  EffectSize size;
  std::map<std::string, std::vector<double>> by_model;
  for (const PairedValues& pair : pairs)
    if (const auto effect = effect_of(pair, measure)) {
      by_model[pair.model].push_back(*effect);
      ++size.pairs;
    } else {
      ++size.left_out;
    }
  std::vector<double> means;
  for (const auto& [model, effects] : by_model) means.push_back(mean_of(effects));
  size.models = means.size();
  size.estimate = means.empty() ? std::numeric_limits<double>::quiet_NaN() : mean_of(means);
  constexpr std::uint64_t kSeed = 1;
  size.student = size.bootstrap = {-kInfinite, kInfinite};
  if (means.size() >= 2) {
    size.student = student_interval(means);
    size.bootstrap = bootstrap_interval(means, kSeed);
  }
  if (measure != EffectMeasure::kDifference) {
    size.estimate = std::exp(size.estimate);
    size.student = exponential(size.student);
    size.bootstrap = exponential(size.bootstrap);
  }
  size.interval = {std::min(size.student.low, size.bootstrap.low),
                   std::max(size.student.high, size.bootstrap.high)};
  return size;
}

std::string name_of(PredictionVerdict verdict) {
  return verdict == PredictionVerdict::kHolds       ? "holds"
         : verdict == PredictionVerdict::kFalsified ? "falsified"
                                                    : "undecided";
}

PredictionVerdict judge_prediction(const PredictedEffect& predicted, const EffectSize& size) {
  if (size.models < kFewestModels || size.left_out > size.pairs) return PredictionVerdict::kUndecided;
  if (Falsifier(predicted.falsified_if).is_true_of(size.interval.low, size.estimate, size.interval.high))
    return PredictionVerdict::kFalsified;
  return size.interval.low >= predicted.at_least && size.interval.high <= predicted.at_most
             ? PredictionVerdict::kHolds
             : PredictionVerdict::kUndecided;
}

}  // namespace hermesh
