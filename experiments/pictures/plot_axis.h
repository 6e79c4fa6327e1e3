// Axes of plots: their range, and ticks that do not run into one another.
#pragma once

#include <string>
#include <vector>

namespace hermesh {

struct Tick {
  double at;
  std::string text;  ///< empty for a minor tick
};

struct PlotAxis {
  double low, high;  ///< the ends of the axis, low < high
  std::vector<Tick> ticks;
};

/// The axis of these values, of which there is at least one. A logarithmic one needs positive values, ends a
/// little beyond them and not at whole decades, and has its digits in ticks as densely as leaves at most
/// `most` texts. A linear one holds 0 if `from_zero`. Where the values are few and far enough apart, as
/// resolutions and numbers of threads are, and `at_values`, the ticks stand at the values themselves.
PlotAxis plot_axis(const std::vector<double>& values, bool logarithmic, bool from_zero, bool at_values,
                   std::size_t most = 7);

/// "250", "1.5 M", "0.02"; thousands have letters where the greatest number of the axis is 10,000 or more.
std::string tick_text(double value, double greatest);

}  // namespace hermesh
