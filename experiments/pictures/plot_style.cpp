#include "experiments/pictures/plot_style.h"

#include <array>
#include <numeric>

#include "algorithms/core/error.h"

namespace hermesh {
namespace {

constexpr std::array<const char*, kPlotColours> kColours = {"#0072b2", "#e69f00", "#009e73", "#d55e00",
                                                            "#56b4e9", "#cc79a7", "#666666", "#000000"};
constexpr std::array<int, kPlotMarks> kMarks = {7, 5, 9, 11, 13, 15, 6, 4, 8, 10, 12, 14, 1, 2, 3};
static_assert(std::gcd(kPlotColours, kPlotMarks) == 1, "else pairs would come again before all were used");

}  // namespace

CurveStyle curve_style(std::size_t number) {
  if (number >= kPlotStyles)
    throw Error("a plot tells " + std::to_string(kPlotStyles) + " curves apart, not " +
                std::to_string(number + 1));
  return {kColours[number % kPlotColours], kMarks[number % kPlotMarks]};
}

}  // namespace hermesh
