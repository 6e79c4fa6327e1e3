#include "experiments/accuracy/slope_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "experiments/measure.h"

namespace hermesh {
namespace {

struct Point {
  double x, y;
};

double slope_of(const std::vector<Point>& points) {
  double x = 0, y = 0, xx = 0, xy = 0;
  for (const Point& p : points) x += p.x, y += p.y;
  x /= double(points.size()), y /= double(points.size());
  for (const Point& p : points) xx += (p.x - x) * (p.x - x), xy += (p.x - x) * (p.y - y);
  return xy / xx;
}

/// Draws numbers below n. The standard's distributions differ from library to library, a remainder does not.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : generator_(seed) {}
  std::size_t below(std::size_t n) { return std::size_t(generator_() % n); }

 private:
  std::mt19937_64 generator_;
};

}  // namespace

std::optional<SlopeFit> fit_slope(const std::vector<ErrorsAtSize>& data, std::uint64_t seed, int draws) {
  std::vector<Point> points;
  std::set<double> sizes;
  for (const ErrorsAtSize& each : data) {
    const double error = mean(each.errors);
    if (!(error > 0.0) || !std::isfinite(error)) return std::nullopt;
    points.push_back({std::log(each.size), std::log(error)});
    sizes.insert(each.size);
  }
  if (sizes.size() < 2) return std::nullopt;
  const std::size_t wanted = std::min<std::size_t>(3, sizes.size());
  Draw draw(seed);
  std::vector<double> slopes;
  while (int(slopes.size()) < draws) {
    std::vector<Point> drawn;
    std::set<double> different;
    bool has_logarithm = true;
    for (std::size_t i = 0; i < data.size(); ++i) {
      const ErrorsAtSize& at = data[draw.below(data.size())];
      double sum = 0.0;
      for (std::size_t j = 0; j < at.errors.size(); ++j) sum += at.errors[draw.below(at.errors.size())];
      has_logarithm &= sum > 0.0;
      different.insert(at.size);
      drawn.push_back({std::log(at.size), std::log(sum / double(at.errors.size()))});
    }
    // With one error of 0 in a size there are draws without a logarithm; others remain, for the mean is not
    // 0.
    if (different.size() >= wanted && has_logarithm) slopes.push_back(slope_of(drawn));
  }
  std::ranges::sort(slopes);
  const auto percentile = [&](double share) {
    return slopes[std::size_t(share * double(slopes.size() - 1))];
  };
  // The slope of all lies within, even where all draws are equal but for rounding.
  const double slope = slope_of(points);
  return SlopeFit{slope, std::min(slope, percentile(0.025)), std::max(slope, percentile(0.975))};
}

std::optional<TwoTermFit> fit_two_terms(const std::vector<ErrorsAtSize>& data, double a, double b) {
  if (data.size() < 3) return std::nullopt;
  // Rows are divided by their error, so that small sizes count as much as large ones: |first sᵃ/e + second
  // sᵇ/e − 1| is least.
  double aa = 0, ab = 0, bb = 0, ra = 0, rb = 0;
  for (const ErrorsAtSize& each : data) {
    const double error = mean(each.errors);
    if (error == 0.0 || !std::isfinite(error)) return std::nullopt;
    const double u = std::pow(each.size, a) / error, v = std::pow(each.size, b) / error;
    aa += u * u, ab += u * v, bb += v * v, ra += u, rb += v;
  }
  const double determinant = aa * bb - ab * ab;
  TwoTermFit fit{(ra * bb - rb * ab) / determinant, (rb * aa - ra * ab) / determinant, 0.0};
  for (const ErrorsAtSize& each : data) {
    const double off =
        (fit.first * std::pow(each.size, a) + fit.second * std::pow(each.size, b)) / mean(each.errors) - 1.0;
    fit.residual += off * off;
  }
  fit.residual = std::sqrt(fit.residual / double(data.size()));
  return fit;
}

}  // namespace hermesh
