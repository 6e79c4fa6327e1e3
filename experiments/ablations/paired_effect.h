// The size of a paired effect over models, its 95 % interval, and what that says of a prediction.
//
// Resolutions of one model are no independent draws, so that a model counts once: with the mean of its pairs'
// effects. The interval is about the mean over models, and is the hull of two: Student's t, which assumes
// that means of models are normal, and the bias-corrected and accelerated bootstrap (BCa; Efron & Tibshirani
// 1993, chapter 14), which does not, but is too narrow for few models. No verdict then hangs on the choice
// between them. Ratios are averaged as logarithms.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "experiments/ablations/ablation.h"

namespace hermesh {

struct Interval {
  double low = 0.0, high = 0.0;
};

/// One subject at both levels.
struct PairedValues {
  std::string model;
  double baseline = 0.0, level = 0.0;
};

struct EffectSize {
  double estimate = 0.0;
  Interval student, bootstrap;  ///< 95 % each
  Interval interval;            ///< their hull
  std::size_t models = 0, pairs = 0;
  std::size_t left_out = 0;  ///< pairs without an effect, such as a ratio to 0
};

/// The p-quantile of Student's t, for 0 < p < 1 and at least one degree of freedom.
double student_quantile(double p, int degrees);

/// The 95 % interval about the mean by Student's t; a point for values that are all equal. It needs two
/// values.
Interval student_interval(std::span<const double> values);

/// The 95 % interval by BCa, from 10,000 resamples that `seed` alone decides.
Interval bootstrap_interval(std::span<const double> values, std::uint64_t seed);

/// With fewer than two models the intervals are all numbers.
EffectSize effect_size(std::span<const PairedValues> pairs, EffectMeasure measure);

enum class PredictionVerdict { kHolds, kFalsified, kUndecided };
std::string name_of(PredictionVerdict verdict);

/// Fewer models than this decide nothing.
inline constexpr std::size_t kFewestModels = 5;

/// The rule: falsified if the file's falsifier is true of the interval; holds if the whole interval is in the
/// range that was predicted; otherwise undecided. Undecided, too, with fewer than kFewestModels or where more
/// than half of the pairs have no effect. @throws Error for a falsifier that cannot be read.
PredictionVerdict judge_prediction(const PredictedEffect& predicted, const EffectSize& size);

}  // namespace hermesh
