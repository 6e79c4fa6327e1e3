#include "experiments/accuracy/normal_code_order.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "algorithms/hermite/with_normal_code.h"
#include "experiments/cases/random_normals.h"

namespace hermesh {
namespace {

using Normal = std::array<float, 3>;
using Vector = std::array<double, 3>;

/// A normal's magnitudes projected onto the octahedron, as multiples of the step, quantised.
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
      // Both rounded up beyond the sum: the one that gained more goes back.
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
    // The one that rounding moved farthest the wrong way: down where one is missing, up where there is one
    // too many.
    for (int i = 1; i < 3; ++i)
      if (missing * (gained[farthest] - gained[i]) > 0) farthest = i;
    at[std::size_t(farthest)] += missing;
  }
  return {at[0], at[1]};
}

/// What comes back of a normal. The thesis divides into one level less than it reconstructs from (trap T1).
Vector through(const Normal& normal, NormalCodeId code, int levels) {
  const Vector magnitude = {std::abs(double(normal[0])), std::abs(double(normal[1])),
                            std::abs(double(normal[2]))};
  const double sum = magnitude[0] + magnitude[1] + magnitude[2];
  const int packed = code == NormalCodeId::thesis ? levels - 1 : levels;
  const std::array<int, 2> at = quantised(
      {magnitude[0] / sum * packed, magnitude[1] / sum * packed, magnitude[2] / sum * packed}, code, packed);
  Vector back = {double(at[0]), double(at[1]), double(levels - at[0] - at[1])};
  // Where both were rounded up beyond the sum the octahedral code's point lies beyond the equator, mirrored.
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

double angle(const Normal& a, const Vector& b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return 2.0 * std::asin(std::min(1.0, 0.5 * std::sqrt(x * x + y * y + z * z)));
}

}  // namespace

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
        const double error = angle(normal, through(normal, code, levels));
        sum += error;
        largest = std::max(largest, error);
      }
      order.mean.back().errors.push_back(sum / double(normals));
      order.max.back().errors.push_back(largest);
    }
  }
  // The thesis's and its kin's octants have 126 levels (of which it makes 127), the octahedral ones 127.
  const bool octants = code == NormalCodeId::baptista || code == NormalCodeId::rounded;
  for (const Normal& normal : random_normals(normals, seed)) {
    const Normal used =
        with_normal_code(code, [&](auto c) { return decltype(c)::unpack(decltype(c)::pack(normal)); });
    order.differing += angle(used, through(normal, code, octants ? 126 : 127)) > 1e-5;
  }
  return order;
}

}  // namespace hermesh
