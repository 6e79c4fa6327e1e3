// Plots from rows, by gnuplot: a PNG to look at, a PDF and an SVG for the paper, with the data and the script beside
// them.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// A curve for every label, or every variant, over the rows in which both columns have a value.
struct Plot {
  std::string name;  ///< name of the files, without an extension
  std::string title;
  std::string case_name = {};  ///< only rows of this case; empty: all
  std::string x;               ///< column
  std::vector<std::string>
      y;  ///< columns; each one after the first gives one curve, whatever the label
  std::string x_label, y_label;  ///< with the unit
  bool log_x = false, log_y = false;
  bool percent = false;     ///< y is a share and shown in percent
  bool by_variant = false;  ///< a curve through all labels of a variant
  int resolution = 0;       ///< only rows of this one; 0: all
  bool categories = false;  ///< the labels stand on an axis, in the order of x, and each column of y is a curve
  std::vector<std::string> emphasised = {};  ///< variants or labels, whole or up to a comma or space, drawn thick
  std::string note = {};                     ///< a sentence under the title

  bool operator==(const Plot&) const = default;
};

Json to_json(const Plot& plot);
Plot plot_from_json(const Json& json);

/// Draws the plots that the latest rows name, into the folder. A plot without a point is left out. The stream `out` is
/// told what was drawn, or in a sentence why not: gnuplot is not there (the script is written in any case), or there
/// are more curves than styles (plot_style.h).
///
/// A label has one style in all plots of an experiment. A point has an error bar where its row has the columns
/// NAME_low and NAME_high of its column NAME, or several timed repetitions (then from the shortest to the longest).
/// Under the title stand the plot's note, models that were replaced by a stand-in, and, where y is a time or made of
/// times, the machines. The same rows give the same bytes of the PDF, which has a fixed date.
/// @throws Error if the folder cannot be written.
void write_plots(const std::vector<Json>& rows, const std::filesystem::path& folder, std::ostream& out);

}  // namespace hermesh
