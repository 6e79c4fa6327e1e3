#include "experiments/accuracy/orders.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>

#include "algorithms/hermite/normal_codes.h"
#include "experiments/cases/random_normals.h"
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

/// Orders by quantity, on smooth surfaces and with creases cut off.
struct PairOfOrders {
  double smooth, cut;
};
constexpr std::array<PairOfOrders, kQuantities.size()> kOrders = {
    {{2, 1.5}, {2, 1}, {1, 0.5}, {2, 1}, {2, 2}, {0, 0}, {2, 1}, {2, 1}, {2, 1}}};

/// Largest deviation of a slope from theory that is tolerated.
constexpr double kOrderTolerance = 0.15;

/// Returns the error up to which a result counts as exact: the effect of single precision on coordinates
/// around 1, in world units, and on the triangles' angles in radians.
double rounding_error(Quantity quantity, double voxel_size) {
  constexpr double kCoordinate = 2e-7;
  if (quantity == Quantity::kCurvature) return 0.0;
  return quantity == Quantity::kNormals ? 10.0 * kCoordinate / voxel_size : kCoordinate;
}

using Normal = std::array<float, 3>;
using Vector = std::array<double, 3>;

/// Quantises a normal's magnitudes, projected onto the octahedron, in multiples of the step.
std::array<int, 2> quantised(const Vector& projected, NormalCodeId code, int levels) {
  std::array<int, 3> at;
  std::array<double, 3> gained;  // by rounding
  for (int i = 0; i < 3; ++i) {
    at[i] = int(std::floor(projected[i] + 0.5));
    gained[i] = at[i] - projected[i];
  }
  switch (code) {
    case NormalCodeId::thesis:
    case NormalCodeId::baptista:
      return {int(projected[0]), int(projected[1])};
    case NormalCodeId::rounded:
      // If both were rounded up beyond the sum, the one that gained more is rounded down.
      if (at[0] + at[1] > levels) --at[gained[0] > gained[1] ? 0 : 1];
      return {at[0], at[1]};
    case NormalCodeId::octahedral:
      return {at[0], at[1]};
    case NormalCodeId::nearest:
      break;
  }
  const int missing = levels - at[0] - at[1] - at[2];
  if (missing != 0) {
    int farthest = 0;
    // Corrects the one that rounding moved farthest in the wrong direction.
    for (int i = 1; i < 3; ++i)
      if (missing * (gained[farthest] - gained[i]) > 0) farthest = i;
    at[std::size_t(farthest)] += missing;
  }
  return {at[0], at[1]};
}

/// Returns the decoded normal. The thesis divides into one level less than it reconstructs from (trap T1).
Vector through(const Normal& normal, NormalCodeId code, int levels) {
  const Vector magnitude = {std::abs(double(normal[0])), std::abs(double(normal[1])),
                            std::abs(double(normal[2]))};
  const double sum = magnitude[0] + magnitude[1] + magnitude[2];
  const int packed = code == NormalCodeId::thesis ? levels - 1 : levels;
  const std::array<int, 2> at = quantised(
      {magnitude[0] / sum * packed, magnitude[1] / sum * packed, magnitude[2] / sum * packed}, code, packed);
  Vector back = {double(at[0]), double(at[1]), double(levels - at[0] - at[1])};
  // If both were rounded up beyond the sum, the octahedral code's point lies beyond the equator, mirrored.
  bool beyond = false;
  if (back[2] < 0) {
    beyond = true;
    back = {double(levels - at[1]), double(levels - at[0]), back[2]};
  }
  const double length = std::sqrt(back[0] * back[0] + back[1] * back[1] + back[2] * back[2]);
  for (int i = 0; i < 3; ++i)
    back[i] = std::copysign(back[i], i == 2 && beyond ? -normal[i] : normal[i]) / length;
  return back;
}

double angle_between(const Normal& a, const Vector& b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return 2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(x * x + y * y + z * z)));
}

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
  std::mt19937_64 generator(seed);
  // The standard's distributions differ between libraries, a remainder does not.
  const auto below = [&](std::size_t n) { return std::size_t(generator() % n); };
  std::vector<double> slopes;
  while (int(slopes.size()) < draws) {
    std::vector<Point> drawn;
    std::set<double> different;
    bool has_logarithm = true;
    for (std::size_t i = 0; i < data.size(); ++i) {
      const ErrorsAtSize& at = data[below(data.size())];
      double sum = 0.0;
      for (std::size_t j = 0; j < at.errors.size(); ++j) sum += at.errors[below(at.errors.size())];
      has_logarithm &= sum > 0.0;
      different.insert(at.size);
      drawn.push_back({std::log(at.size), std::log(sum / double(at.errors.size()))});
    }
    // Draws that consist only of zero errors have no logarithm.
    if (different.size() >= wanted && has_logarithm) slopes.push_back(slope_of(drawn));
  }
  std::ranges::sort(slopes);
  const auto percentile = [&](double share) {
    return slopes[std::size_t(share * double(slopes.size() - 1))];
  };
  // The interval contains the slope, even if all draws are equal except for rounding.
  const double slope = slope_of(points);
  return SlopeFit{slope, std::min(slope, percentile(0.025)), std::max(slope, percentile(0.975))};
}

std::optional<TwoTermFit> fit_two_terms(const std::vector<ErrorsAtSize>& data, double a, double b) {
  if (data.size() < 3) return std::nullopt;
  // Minimises |first sᵃ/e + second sᵇ/e − 1|: rows are divided by their error, so that sizes have equal
  // weight.
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

Expectation expectation(const ExactShape& shape, bool keeps_creases) {
  if (!shape.is_sharp()) return Expectation::kSmooth;
  if (!keeps_creases) return Expectation::kSharp;
  return shape.is_flat() ? Expectation::kExact : Expectation::kKept;
}

std::optional<double> theory(Expectation expectation, Quantity quantity) {
  if (expectation == Expectation::kExact && quantity != Quantity::kCurvature) return std::nullopt;
  if (expectation == Expectation::kFirstOrder) return 1.0;
  const auto& [smooth, cut] = kOrders[std::size_t(quantity)];
  return expectation == Expectation::kSharp ? cut : smooth;
}

std::optional<std::pair<double, double>> two_powers(Quantity quantity) {
  // The volume's are both 2; creases and corners have no smooth part.
  for (const Quantity none : {Quantity::kVolume, Quantity::kCurvature, Quantity::kEdges, Quantity::kCorners})
    if (quantity == none) return std::nullopt;
  const auto& [smooth, cut] = kOrders[std::size_t(quantity)];
  return {{cut, smooth}};
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
  // No error satisfies any expected order.
  const bool within = exact || (fit && expected && std::abs(fit->slope - *expected) <= kOrderTolerance);
  values["order_within"] = within ? "yes" : "no";
}

NormalCodeOrder normal_code_order(NormalCodeId code, std::size_t normals, std::uint64_t seed,
                                  const RunContext& context) {
  constexpr int kDraws = 3;
  NormalCodeOrder order;
  for (int bits = 4; bits <= 10; ++bits) {
    const int levels = (1 << bits) - 1;
    order.mean.push_back({1.0 / levels, {}}), order.max.push_back({1.0 / levels, {}});
    for (int draw = 0; draw < kDraws; ++draw) {
      context.check();
      double sum = 0.0, largest = 0.0;
      for (const Normal& normal : random_normals(normals, seed + std::uint64_t(draw))) {
        const double error = angle_between(normal, through(normal, code, levels));
        sum += error;
        largest = std::max(largest, error);
      }
      order.mean.back().errors.push_back(sum / double(normals));
      order.max.back().errors.push_back(largest);
    }
  }
  // The octants of the thesis and its variants have 126 levels (of which it makes 127), the octahedral codes
  // 127.
  const bool octants = code == NormalCodeId::baptista || code == NormalCodeId::rounded;
  for (const Normal& normal : random_normals(normals, seed)) {
    const Normal used =
        with_normal_code(code, [&](auto c) { return decltype(c)::unpack(decltype(c)::pack(normal)); });
    order.differing += angle_between(used, through(normal, code, octants ? 126 : 127)) > 1e-5;
  }
  return order;
}

std::optional<double> triangles_times_error(const std::string& shape) {
  if (shape != "sphere" && shape != "ellipsoid" && shape != "torus") return std::nullopt;
  // Elliptic: an equilateral triangle whose corners are as far outside as its middle is inside, 3√3 (L. Fejes
  // Tóth 1948). Hyperbolic: the largest found by a search over triangles and planes, not a proven optimum.
  // Curvature K and distance ε scale them by ε/√|K|.
  constexpr double kEllipticArea = 5.196152422706632, kHyperbolicArea = 6.13;
  const std::shared_ptr<const ExactShape> surface = exact_shape(shape);
  // Facets this small miss less than a ten-thousandth of the area.
  const PolygonMesh facets = surface->facets(0.02);
  double sum = 0.0;
  for (const Triangle& t : facets.triangles) {
    const Eigen::Vector3d a = facets.world(t[0]), b = facets.world(t[1]), c = facets.world(t[2]);
    const double curvature = surface->nearest((a + b + c) / 3.0).gaussian_curvature;
    const double area = 0.5 * (b - a).cross(c - a).norm();
    sum += area * std::sqrt(std::abs(curvature)) / (curvature > 0 ? kEllipticArea : kHyperbolicArea);
  }
  return sum;
}

}  // namespace hermesh
