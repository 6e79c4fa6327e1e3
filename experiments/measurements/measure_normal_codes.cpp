// Error and speed of the 16-bit normals: trap T1 of the notes on the thesis, and its corrections.
#include <time.h>

#include <array>
#include <cmath>
#include <numbers>

#include "algorithms/hermite/normal_code.h"
#include "algorithms/hermite/normal_codes.h"
#include "experiments/cases/random_normals.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

using Normal = std::array<float, 3>;
using Vector = std::array<double, 3>;

constexpr std::size_t kCodes = 65'536;
constexpr double kDegrees = 180.0 / std::numbers::pi;

/// Computed from the chord, since the cosine of a small angle has lost its digits.
double degrees_between(const Normal& p, const Normal& q) {
  const double x = double(p[0]) - q[0], y = double(p[1]) - q[1], z = double(p[2]) - q[2];
  return 2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(x * x + y * y + z * z))) * kDegrees;
}

/// The i-th of n points that cover the sphere evenly, the spherical Fibonacci lattice.
Normal sphere_point(std::size_t i, std::size_t n) {
  static const double golden_angle = std::numbers::pi * (3.0 - std::sqrt(5.0));
  const double z = 1.0 - (2.0 * double(i) + 1.0) / double(n), r = std::sqrt(1.0 - z * z);
  const double angle = golden_angle * double(i);
  return {float(r * std::cos(angle)), float(r * std::sin(angle)), float(z)};
}

struct Sweep {
  std::vector<float> errors;                  ///< degrees, of every normal
  std::vector<std::optional<Normal>> member;  ///< by code: one of the normals that have it
};

template <NormalCode Code>
Sweep sweep_sphere(std::size_t points, const RunContext& context) {
  Sweep sweep;
  sweep.errors.resize(points);
  sweep.member.resize(kCodes);
  for (std::size_t i = 0; i < points; ++i) {
    if (i % 65'536 == 0) context.check();
    const Normal normal = sphere_point(i, points);
    const std::uint16_t code = Code::pack(normal);
    sweep.errors[i] = float(degrees_between(normal, Code::unpack(code)));
    sweep.member[code] = normal;
  }
  return sweep;
}

/// Returns the point of the great circle from `start` along the unit tangent after an angle in radians.
Normal walk(const Vector& start, const Vector& tangent, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {float(c * start[0] + s * tangent[0]), float(c * start[1] + s * tangent[1]),
          float(c * start[2] + s * tangent[2])};
}

/// Two unit vectors that are perpendicular to a unit vector and to one another (Duff et al., Building an
/// Orthonormal Basis, Revisited, JCGT 2017).
std::array<Vector, 2> tangents(const Vector& n) {
  const double sign = std::copysign(1.0, n[2]), a = -1.0 / (sign + n[2]), b = n[0] * n[1] * a;
  return {{{1.0 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]}, {b, sign + n[1] * n[1] * a, -n[1]}}};
}

/// Returns the largest error on the border of the cell of normals that share a code, searched from one of its
/// members. A cell is star-shaped about each of its points, and none is wider than kReach.
template <NormalCode Code>
double error_on_border(std::uint16_t code, const Normal& member, int directions) {
  constexpr int kHalvings = 20;
  constexpr double kReach = 4.0 / kDegrees;
  const Vector start = {member[0], member[1], member[2]};
  const auto [u, v] = tangents(start);
  const Normal decoded = Code::unpack(code);
  double largest = 0.0;
  for (int direction = 0; direction < directions; ++direction) {
    const double turn = 2.0 * std::numbers::pi * direction / directions;
    const double c = std::cos(turn), s = std::sin(turn);
    const Vector tangent = {c * u[0] + s * v[0], c * u[1] + s * v[1], c * u[2] + s * v[2]};
    double inside = 0.0, outside = kReach;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (inside + outside);
      (Code::pack(walk(start, tangent, middle)) == code ? inside : outside) = middle;
    }
    largest = std::max(largest, degrees_between(decoded, walk(start, tangent, inside)));
  }
  return largest;
}

template <NormalCode Code>
double largest_error_on_borders(const Sweep& sweep, int directions, const RunContext& context) {
  double largest = 0.0;
  for (std::size_t code = 0; code < kCodes; ++code) {
    if (code % 1024 == 0) context.check();
    if (sweep.member[code])
      largest =
          std::max(largest, error_on_border<Code>(std::uint16_t(code), *sweep.member[code], directions));
  }
  return largest;
}

template <NormalCode Code>
double largest_length_error() {
  double largest = 0.0;
  for (std::size_t code = 0; code < kCodes; ++code) {
    const Normal n = Code::unpack(std::uint16_t(code));
    largest = std::max(largest, std::abs(std::hypot(double(n[0]), double(n[1]), double(n[2])) - 1.0));
  }
  return largest;
}

struct ExpectedErrors {
  NormalCodeId code;
  double mean, max;  ///< degrees
};
/// As stated by the notes on the thesis (trap T1); a code without an entry has no expectation.
constexpr ExpectedErrors kExpected[] = {{NormalCodeId::thesis, 1.32, 2.56},
                                        {NormalCodeId::baptista, 0.81, 1.92},
                                        {NormalCodeId::rounded, 0.34, 0.96},
                                        {NormalCodeId::octahedral, 0.34, 0.95}};

double percentile(std::vector<float>& errors, double share) {
  const auto at = errors.begin() + std::ptrdiff_t(share * double(errors.size() - 1));
  std::nth_element(errors.begin(), at, errors.end());
  return *at;
}

MeasuredRow error_row(NormalCodeId id, std::vector<float>& errors) {
  double sum = 0.0, squares = 0.0;
  for (const double error : errors) sum += error, squares += error * error;
  const double count = double(errors.size());
  MeasuredRow row{"errors", std::string(name(id)), {}, {}};
  row.values["mean"] = sum / count;
  row.values["rms"] = std::sqrt(squares / count);
  row.values["median"] = percentile(errors, 0.5);
  row.values["p95"] = percentile(errors, 0.95);
  row.values["p99"] = percentile(errors, 0.99);
  row.values["max"] = *std::max_element(errors.begin(), errors.end());
  for (const ExpectedErrors& expected : kExpected) {
    if (expected.code != id) continue;
    row.values["expected_mean"] = expected.mean;
    row.values["expected_max"] = expected.max;
    if (std::abs(sum / count - expected.mean) > 0.02 * expected.mean)
      row.broken.push_back("the mean error is not the expected one");
  }
  return row;
}

void add_histogram(const std::string& label, const std::vector<float>& errors, const Options& parameters,
                   std::vector<MeasuredRow>& rows) {
  const auto bins = std::size_t(parameters.number("bins"));
  const double width = parameters.number("last_bin") / double(bins);
  std::vector<std::size_t> counts(bins);
  for (const double error : errors)
    if (const auto bin = std::size_t(error / width); bin < bins) ++counts[bin];
  for (std::size_t bin = 0; bin < bins; ++bin)
    rows.push_back(
        {"histogram",
         label,
         {{"error", (double(bin) + 0.5) * width}, {"share", double(counts[bin]) / double(errors.size())}},
         {}});
}

/// A row of errors, and those of the histogram.
template <NormalCode Code>
std::vector<MeasuredRow> measure_errors(NormalCodeId id, const MeasurementInput& input) {
  const auto points = std::size_t(input.parameters.number("points"));
  Sweep sweep = sweep_sphere<Code>(points, input.context);
  std::vector<MeasuredRow> rows = {error_row(id, sweep.errors)};
  rows[0].values["codes"] =
      std::ranges::count_if(sweep.member, [](const auto& member) { return member.has_value(); });
  rows[0].values["cell_max"] =
      largest_error_on_borders<Code>(sweep, int(input.parameters.number("directions")), input.context);
  rows[0].values["length_off"] = largest_length_error<Code>();
  add_histogram(Code::name, sweep.errors, input.parameters, rows);
  return rows;
}

/// The loops that are timed, behind pointers, so that no repetition can be optimised away.
struct Loops {
  void (*pack)(const Normal*, std::uint16_t*, std::size_t);
  void (*unpack)(const std::uint16_t*, Normal*, std::size_t);
  void (*negate)(const std::uint16_t*, std::uint16_t*, std::size_t);
};

template <NormalCode Code>
Loops loops_of(Code) {
  return {[](const Normal* from, std::uint16_t* to, std::size_t n) {
            for (std::size_t i = 0; i < n; ++i) to[i] = Code::pack(from[i]);
          },
          [](const std::uint16_t* from, Normal* to, std::size_t n) {
            for (std::size_t i = 0; i < n; ++i) to[i] = Code::unpack(from[i]);
          },
          [](const std::uint16_t* from, std::uint16_t* to, std::size_t n) {
            for (std::size_t i = 0; i < n; ++i) to[i] = Code::negate(from[i]);
          }};
}

/// CPU seconds of this thread, which other programs on the machine do not add to.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Nanoseconds an element. A chunk of normals and codes is 224 KiB, and is worked on several times while it
/// is in the second-level cache, so that the code is timed and not the memory.
template <class From, class To>
double pass(void (*loop)(const From*, To*, std::size_t), const std::vector<From>& from, std::vector<To>& to) {
  constexpr std::size_t kChunk = 16'384;
  constexpr int kRounds = 8;
  const double start = thread_seconds();
  for (std::size_t begin = 0; begin < from.size(); begin += kChunk)
    for (int round = 0; round < kRounds; ++round)
      loop(&from[begin], &to[begin], std::min(kChunk, from.size() - begin));
  return 1e9 * (thread_seconds() - start) / (double(from.size()) * kRounds);
}

/// All codes and operations, interleaved.
std::vector<MeasuredRow> measure_speed(const MeasurementInput& input) {
  std::vector<NormalCodeId> ids(kNormalCodes.begin(), kNormalCodes.end());
  std::erase_if(ids, [&](NormalCodeId id) { return !input.wants("speed", std::string(name(id))); });
  if (ids.empty()) return {};
  const auto normals = random_normals(std::size_t(input.parameters.number("normals")), input.seed);
  std::vector<Normal> decoded(normals.size());
  std::vector<std::vector<std::uint16_t>> codes(ids.size(), std::vector<std::uint16_t>(normals.size()));
  std::vector<std::uint16_t> negated(normals.size());
  std::vector<std::function<double()>> work;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Loops loops = with_normal_code(ids[i], [](auto code) { return loops_of(code); });
    loops.pack(normals.data(), codes[i].data(), normals.size());
    work.push_back([&, i, loops] { return pass(loops.pack, normals, codes[i]); });
    work.push_back([&, i, loops] { return pass(loops.unpack, codes[i], decoded); });
    work.push_back([&, i, loops] { return pass(loops.negate, codes[i], negated); });
  }
  const auto nanoseconds = race(work, int(input.parameters.number("repetitions")));
  std::vector<MeasuredRow> rows;
  constexpr std::array kOperations = {"pack", "unpack", "negate"};
  for (std::size_t i = 0; i < nanoseconds.size(); ++i) {
    if (i % 3 == 0) rows.push_back({"speed", std::string(name(ids[i / 3])), {}, {}});
    const std::string operation = kOperations[i % 3];
    rows.back().values[operation] = median(nanoseconds[i]);
    rows.back().values[operation + "_min"] = std::ranges::min(nanoseconds[i]);
  }
  return rows;
}

}  // namespace

std::vector<MeasuredRow> measure_normal_codes(const MeasurementInput& input) {
  std::vector<MeasuredRow> rows;
  for (std::size_t i = 0; i < kNormalCodes.size(); ++i) {
    const std::string label(name(kNormalCodes[i]));
    if (!input.wants("errors", label) && !input.wants("histogram", label)) continue;
    input.context.progress("errors", double(i) / double(kNormalCodes.size()));
    std::ranges::move(
        with_normal_code(kNormalCodes[i],
                         [&](auto code) { return measure_errors<decltype(code)>(kNormalCodes[i], input); }),
        std::back_inserter(rows));
  }
  const Stage stage(input.context, "speed");
  std::ranges::move(measure_speed(input), std::back_inserter(rows));
  return rows;
}

}  // namespace hermesh
