#include "experiments/accuracy/orders.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "experiments/measure.h"

namespace hermesh {
Expectation expectation(const ExactShape& shape, bool keeps_creases) {
  if (!shape.is_sharp()) return Expectation::kSmooth;
  if (!keeps_creases) return Expectation::kSharp;
  return shape.is_flat() ? Expectation::kExact : Expectation::kKept;
}

std::optional<double> theory(Expectation expectation, Quantity quantity) {
  if (expectation == Expectation::kExact && quantity != Quantity::kCurvature) return std::nullopt;
  if (expectation == Expectation::kFirstOrder) return 1.0;
  const bool cut = expectation == Expectation::kSharp;
  switch (quantity) {
    case Quantity::kRms:
      return cut ? 1.5 : 2.0;
    case Quantity::kMax:
    case Quantity::kHausdorff:
    case Quantity::kArea:
    case Quantity::kEdges:
    case Quantity::kCorners:
      return cut ? 1.0 : 2.0;
    case Quantity::kNormals:
      return cut ? 0.5 : 1.0;
    case Quantity::kVolume:
      return 2.0;
    case Quantity::kCurvature:
      break;
  }
  return 0.0;
}

std::optional<std::pair<double, double>> two_powers(Quantity quantity) {
  switch (quantity) {
    case Quantity::kRms:
      return {{1.5, 2.0}};
    case Quantity::kMax:
    case Quantity::kHausdorff:
    case Quantity::kArea:
      return {{1.0, 2.0}};
    case Quantity::kNormals:
      return {{0.5, 1.0}};
    // The volume's are both 2; creases and corners have no smooth part.
    case Quantity::kVolume:
    case Quantity::kCurvature:
    case Quantity::kEdges:
    case Quantity::kCorners:
      break;
  }
  return std::nullopt;
}

double rounding_error(Quantity quantity, double voxel_size) {
  constexpr double kCoordinate = 2e-7;
  switch (quantity) {
    case Quantity::kNormals:
      return 10.0 * kCoordinate / voxel_size;
    case Quantity::kCurvature:
      return 0.0;
    default:
      return kCoordinate;
  }
}

void describe_order(Json& values, const std::vector<ErrorsAtSize>& errors, Expectation expectation,
                    Quantity quantity, std::uint64_t seed, int draws) {
  const bool exact = std::ranges::all_of(errors, [&](const ErrorsAtSize& at) {
    return std::ranges::max(at.errors) <= rounding_error(quantity, at.size);
  });
  values["exact"] = exact ? "yes" : "no";
  values["error_coarse"] = mean(errors.front().errors);
  values["error_fine"] = mean(errors.back().errors);
  const std::optional<double> expected = theory(expectation, quantity);
  if (expected) values["order_theory"] = *expected;
  const std::optional<SlopeFit> fit = exact ? std::nullopt : fit_slope(errors, seed, draws);
  if (fit) {
    values["order"] = fit->slope;
    values["order_low"] = fit->low;
    values["order_high"] = fit->high;
  }
  // Where an error of some power is expected none is as good as it gets.
  const bool within = exact || (fit && expected && std::abs(fit->slope - *expected) <= kOrderTolerance);
  values["order_within"] = within ? "yes" : "no";
}

}  // namespace hermesh
