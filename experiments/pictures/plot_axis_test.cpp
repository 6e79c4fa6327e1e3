#include "experiments/pictures/plot_axis.h"

#include <gtest/gtest.h>

namespace hermesh {
namespace {

std::vector<std::string> texts(const PlotAxis& axis) {
  std::vector<std::string> result;
  for (const Tick& tick : axis.ticks)
    if (!tick.text.empty()) result.push_back(tick.text);
  return result;
}
using Texts = std::vector<std::string>;

TEST(PlotAxis, HasItsTicksAtValuesThatAreFewAndApart) {
  EXPECT_EQ(texts(plot_axis({50, 100, 200, 100}, true, false, true)), (Texts{"50", "100", "200"}));
  EXPECT_EQ(texts(plot_axis({1, 2, 4, 8, 16}, false, false, true)), (Texts{"1", "2", "4", "8", "16"}));
  // 100 and 101 would run into each other.
  EXPECT_EQ(texts(plot_axis({0, 100, 101}, false, false, true)), (Texts{"0", "20", "40", "60", "80", "100"}));
}

TEST(PlotAxis, OfALogarithmEndsNearTheValues) {
  const PlotAxis axis = plot_axis({0.95, 55}, true, false, false);
  EXPECT_GT(axis.low, 0.7);
  EXPECT_LT(axis.high, 80);
  EXPECT_EQ(texts(axis), (Texts{"1", "2", "5", "10", "20", "50"}));
}

TEST(PlotAxis, HoldsEveryValueAndZero) {
  const PlotAxis over = plot_axis({20, 260}, false, true, false),
                 under = plot_axis({-3, 5}, false, true, false);
  EXPECT_EQ(over.low, 0);
  EXPECT_GT(over.high, 260);
  EXPECT_LT(under.low, -3);
  EXPECT_EQ(texts(over).front(), "0");
  EXPECT_LT(plot_axis({0, 0}, false, true, false).low, plot_axis({0, 0}, false, true, false).high);
}

TEST(PlotAxis, WritesThousandsWithLetters) {
  EXPECT_EQ(tick_text(1500, 2e6), "1.5 k");
  EXPECT_EQ(tick_text(1500, 2000), "1500");
  EXPECT_EQ(tick_text(0.02, 1), "0.02");
}

}  // namespace
}  // namespace hermesh
