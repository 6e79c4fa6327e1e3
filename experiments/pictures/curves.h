// What a plot draws: points of rows, joined to curves.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "experiments/pictures/plot.h"

namespace hermesh {

struct CurvePoint {
  double x, y;      ///< in the columns' units; y in percent where the plot asks for that
  std::size_t row;  ///< index into the rows that were given
  std::optional<double> low = {}, high = {};  ///< ends of y's interval, both or none
};

struct Curve {
  std::string label;
  std::string column;              ///< what y is
  std::vector<CurvePoint> points;  ///< by x, then by y
};

/// The curves of a plot. The first column gives a curve for every label or variant. The others do not depend on who
/// competes: they are taken from the rows of the first label alone, and are called by their column's header. A plot
/// of categories has one curve a column, called by its header, and x numbers the labels from 0 by their least value of
/// plot.x, then as they come; a row need not have that column.
/// @throws Error for a column that there is not.
std::vector<Curve> curves_of(const Plot& plot, const std::vector<Json>& rows);

/// The latest rows of one experiment, and the plots that the last of them names.
struct PlottedRows {
  std::string experiment;
  std::vector<Json> rows;
  std::vector<Plot> plots;
};
/// Each experiment of the rows, in the order of their names.
std::vector<PlottedRows> plotted_rows(const std::vector<Json>& rows);

}  // namespace hermesh
