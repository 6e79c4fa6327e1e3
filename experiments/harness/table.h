// Tables from rows: for a terminal (Markdown that is aligned), for other programs (CSV), for the paper
// (LaTeX).
#pragma once

#include <ostream>
#include <vector>

#include "experiments/harness/columns.h"
#include "experiments/harness/rows.h"

namespace hermesh {

/// Rows of one table: the same experiment, tier, run, case, resolution and voxelizer, in the order of the
/// variants. The values of a sweep, and voxel sizes that are given as such, share a table.
struct RowGroup {
  std::vector<Json> rows;
  int earlier_runs = 0;  ///< how many other groups differ from this one in the run alone, and are not in it
};

/// Groups in the order in which they first appear; of groups that differ in the run alone, the last one. In
/// an additive table (measurements.h) rows replace those of other runs above them that have the same label and
/// resolution, and add to all others; those of one label stand together.
std::vector<RowGroup> latest_groups(const std::vector<Json>& rows);

/// One Markdown table with what it was measured on above, and below it, in capitals, every broken promise,
/// disagreement of the libraries and failure. Columns aligned for a terminal. Shows the columns that the rows
/// name.
void write_markdown(const RowGroup& group, std::ostream& out);
/// What the headers mean that these rows use.
void write_legend(const std::vector<Json>& rows, std::ostream& out);
/// One LaTeX table environment; needs the package booktabs.
void write_latex(const RowGroup& group, std::ostream& out);
/// Every row and every column, numbers in full, in the columns' units (voxels, MiB, seconds).
void write_csv(const std::vector<Json>& rows, std::ostream& out);

}  // namespace hermesh
