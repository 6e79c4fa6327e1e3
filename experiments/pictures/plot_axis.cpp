#include "experiments/pictures/plot_axis.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

namespace hermesh {
namespace {

/// A share of the axis that a tick's text takes at most, so that texts with this between them do not touch.
constexpr double kTextShare = 0.045;

std::string digits(double value, int most) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", most, value);
  return text;
}

std::vector<double> linear_ticks(double low, double high, bool whole) {
  const double raw = (high - low) / 6, power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double factor : {5.0, 2.0, 1.0})
    if (factor * power >= raw) step = factor * power;
  if (whole) step = std::max(step, 1.0);
  std::vector<double> ticks;
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i)
    ticks.push_back(i * step + 0.0);  // no -0
  return ticks;
}

/// Ticks at the digits of the densest set that is not crowded; within less than a decade linear ones.
std::vector<double> log_ticks(double low, double high, std::size_t most) {
  const double first = std::floor(std::log10(low)), last = std::ceil(std::log10(high));
  static const std::vector<std::vector<double>> kSets = {
      {1, 2, 3, 4, 5, 6, 7, 8, 9}, {1, 2, 3, 5, 7}, {1, 2, 5}, {1, 3}, {1}};
  std::vector<double> ticks;
  for (const std::vector<double>& set : kSets) {
    ticks.clear();
    for (double decade = first; decade <= last; ++decade)
      for (const double digit : set) {
        const double value = digit * std::pow(10.0, decade);
        if (value >= low && value <= high) ticks.push_back(value);
      }
    if (ticks.size() <= most) break;
  }
  if (ticks.size() > most) {  // more decades than texts
    const std::size_t every = (ticks.size() + most - 1) / most;
    std::vector<double> kept;
    for (std::size_t i = 0; i < ticks.size(); i += every) kept.push_back(ticks[i]);
    return kept;
  }
  return ticks.size() < 2 ? linear_ticks(low, high, false) : ticks;
}

/// Whether texts at these values, which are sorted, stand apart.
bool stand_apart(const std::set<double>& values, const PlotAxis& axis, bool logarithmic) {
  const auto place = [&](double value) {
    return logarithmic ? std::log(value / axis.low) / std::log(axis.high / axis.low)
                       : (value - axis.low) / (axis.high - axis.low);
  };
  double before = -1.0;
  for (const double value : values) {
    if (place(value) - before < kTextShare) return false;
    before = place(value);
  }
  return true;
}

}  // namespace

std::string tick_text(double value, double greatest) {
  const double size = std::abs(value);
  if (greatest >= 1e4)
    for (const auto& [factor, unit] : {std::pair(1e9, " G"), std::pair(1e6, " M"), std::pair(1e3, " k")})
      if (size >= factor) return digits(value / factor, 4) + unit;
  return digits(value, 6);
}

PlotAxis plot_axis(const std::vector<double>& values, bool logarithmic, bool from_zero, bool at_values,
                   std::size_t most) {
  const auto [least, greatest] = std::ranges::minmax(values);
  PlotAxis axis{};
  if (logarithmic) {
    // At least a fifth of a decade, so that numbers that hardly differ do not look far apart.
    const double room =
        std::max(0.05 * std::log10(greatest / least), 0.5 * (0.2 - std::log10(greatest / least)));
    axis.low = least * std::pow(10.0, -std::max(room, 0.02));
    axis.high = greatest * std::pow(10.0, std::max(room, 0.02));
  } else {
    const double low = from_zero ? std::min(least, 0.0) : least,
                 high = from_zero ? std::max(greatest, 0.0) : greatest;
    const double span = high > low ? high - low : std::max(std::abs(high), 1.0);
    axis.low = from_zero && low == 0.0 ? 0.0 : low - 0.04 * span;
    axis.high = from_zero && high == 0.0 && low < 0.0 ? 0.0 : high + 0.05 * span;
  }
  const bool whole = std::ranges::all_of(values, [](double value) { return value == std::round(value); });
  const std::set<double> distinct(values.begin(), values.end());
  std::vector<double> at;
  if (at_values && distinct.size() > 1 && distinct.size() <= 9 && stand_apart(distinct, axis, logarithmic))
    at.assign(distinct.begin(), distinct.end());
  else
    at = logarithmic ? log_ticks(axis.low, axis.high, most) : linear_ticks(axis.low, axis.high, whole);
  const double most_of_ticks =
      at.empty() ? 0.0 : std::abs(*std::ranges::max_element(at, {}, [](double v) { return std::abs(v); }));
  for (const double value : at) axis.ticks.push_back({value, tick_text(value, most_of_ticks)});
  if (!logarithmic) return axis;
  for (double decade = std::floor(std::log10(axis.low)); decade <= std::ceil(std::log10(axis.high)); ++decade)
    for (int digit = 1; digit <= 9; ++digit) {
      const double value = digit * std::pow(10.0, decade);
      const bool known =
          std::ranges::any_of(at, [&](double tick) { return std::abs(tick / value - 1.0) < 1e-9; });
      if (!known && value >= axis.low && value <= axis.high) axis.ticks.push_back({value, ""});
    }
  return axis;
}

}  // namespace hermesh
