// Plots from rows, by gnuplot: a PNG to look at and an SVG for the paper, with the data and the script beside
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

  bool operator==(const Plot&) const = default;
};

Json to_json(const Plot& plot);
Plot plot_from_json(const Json& json);

/// Draws the plots that the latest rows name, into the folder. A plot without a point is left out. The stream `out` is
/// told what was drawn, or in a sentence that gnuplot is not there; the script is written in any case.
/// @throws Error if the folder cannot be written.
void write_plots(const std::vector<Json>& rows, const std::filesystem::path& folder, std::ostream& out);

}  // namespace hermesh
