// What a page shows of rows: tables, figures and histories as one JSON object, which the page's script reads.
#pragma once

#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// An object with
///
///   rows      all rows as they are; the other members refer to them by their number here
///   tables    the groups of `hermesh report` in its order: {experiment, tier, question, title, case,
///   resolution, facts,
///             sentences, earlier, first_column, columns: [{header, meaning, pointer, left}],
///             rows: [{row, label, variant, cells, trouble}]}; a cell is null, a text, or [text, number], and
///             `trouble` has the sentences of broken promises and failures
///   figures   as figures_of() makes them
///   histories of the tables with cells that several runs have rows of: {title, case, resolution, columns,
///   runs: [{run,
///             date, commit, dirty, cpu}], series: [{label, points: [{row, run, cells: numbers or nulls}]}]};
///             `run` is an index into the runs, which are in the order of their dates
///
/// @throws Error for a plot of a column that there is not.
Json page_data(const std::vector<Json>& rows);

}  // namespace hermesh
