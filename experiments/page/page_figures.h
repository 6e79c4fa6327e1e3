// The figures of a page: those that the rows name, and those that suit every experiment of their kind.
#pragma once

#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// Key under which a row that goes through here holds its number among the rows of the page.
inline constexpr const char* kPageRow = "page_row";
std::size_t page_row(const Json& row);

/// A list of figures of the latest rows, experiment by experiment. Each is an object:
///
///   kind      "curves", or "dots" for one line of the figure a row, with the labels at the left
///   title, experiment, case, resolution (text), x_label, y_label with units
///   log_x, log_y, zero_y (whether the axis starts at 0), lines (whether points are joined),
///   front (whether the points that no other one beats in both coordinates are joined)
///   note      a sentence below the figure, where a plot has one
///   series    [{label, style, points: [[row, x, y, low, high], …]}, …]; `style` numbers the labels of an
///   experiment, so
///             that a variant looks the same in all of its figures; low and high are the ends of the interval
///             of y (of x in "dots"), null where there is none
///
/// Made are: the plots that the rows name. Of extractions, for every case and resolution, the rms distance to
/// the input over the triangles, unless a plot of the rows shows that, and the times with the shortest and
/// the longest repetition. Of extractions and voxelizations at several resolutions, the time over the active
/// voxels. Of the tables of measurements, each column with an interval, which is one with the columns
/// NAME_low and NAME_high beside it, and each whose name has the word slope in it. Rows have their numbers
/// under kPageRow. @throws Error for a plot of a column that there is not.
Json figures_of(const std::vector<Json>& rows);

}  // namespace hermesh
