// Two runs beside each other: does a cell still make the same?
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// Cells are matched by experiment, case, resolution, voxelizer and variant; of several rows of a cell the
/// last one counts, for a folder gets the rows of each new run behind those of the ones before.
struct RunComparison {
  struct Difference {
    std::string cell, before, after;  ///< digests, or the sentence of a failure
  };
  std::size_t equal = 0;
  std::vector<Difference> different;
  std::vector<std::string> missing;  ///< cells of the first run that the second has no row of
  std::vector<std::string> added;    ///< and the other way round
  std::size_t without_digest = 0;    ///< cells of both runs whose rows have none, which cannot be compared

  bool same() const { return different.empty() && missing.empty() && equal > 0; }
};

RunComparison compare_runs(const std::vector<Json>& before, const std::vector<Json>& after);

/// Markdown: the counts, then each cell that differs or is missing.
std::string text(const RunComparison& comparison);

}  // namespace hermesh
