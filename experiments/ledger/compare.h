// Two sets of rows beside each other, a baseline and a candidate: which cells changed, and is the change for
// the worse?
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

struct CompareSettings {
  double tolerance = 0.01;  ///< of floating-point values, relative to the baseline's
  bool costs = true;        ///< whether times and memory are compared
  bool pool = false;  ///< whether the repetitions of all runs of a cell count, rather than those of the last
  bool allow_missing =
      false;  ///< whether cells that the candidate lacks, or has under another label, are no regression
};

/// What became of one cell of the experiment's matrix.
struct CellVerdict {
  enum class State { kBoth, kMissing, kNew, kRenamed };
  std::string
      cell;  ///< "headline, quick: dragon / 400 / hermesh / openvdb", the baseline's where both have it
  State state = State::kBoth;
  std::string label;                     ///< of a renamed cell: what the candidate calls it
  std::size_t compared = 0;              ///< how many values
  std::vector<std::string> regressions;  ///< sentences: what is worse, or other than it was
  std::vector<std::string> better;
};

struct Comparison {
  CompareSettings settings;
  std::vector<CellVerdict> cells;  ///< in the baseline's order, new ones at the end
  std::vector<std::string> notes;  ///< what was not compared and why, each once with the number of its cells

  std::size_t count(CellVerdict::State state) const;
  std::size_t regressions() const;  ///< cells that have one, missing and renamed ones included unless allowed
  bool is_regression(const CellVerdict& cell) const;
  /// Whether something was compared and nothing became worse.
  bool fine() const;
};

/// Cells are matched by experiment, tier, case or table, resolution or voxel size, swept value, voxelizer and
/// label; where a measurement has several rows of one label, by the column that tells them apart (threads,
/// bins). Of several runs of a cell the last counts (latest_groups()). A cell that is missing and one that is
/// new are one that was renamed if all but the label agrees, and variant and options do, or else the digest.
///
/// Values are compared by their class (value_class.h):
///   - exact: digests, whole numbers of reports and measurements, texts, options, promises, failures. Options
///     and columns that one side alone has are noted. Of failures and broken promises, new ones are
///     regressions, and cured ones better;
///   - error: a change for the worse beyond the tolerance and 1e-6 of the column's unit (voxels, degrees)
///     is a regression;
///   - slope: a regression where the intervals do not overlap;
///   - time: a regression where the U test (rank_test.h) over all repetitions has p < 0.01 and the medians
///     differ by more than a tenth; only on one machine (CPU, cores, threads) with at least five repetitions
///     a side. Of pooled runs each must be slower than all of the other side, too, for repetitions of one run
///     share their disturbances;
///   - memory: a regression where a peak is above 1.2 times what it was and by more than a MiB; only on one
///     machine.
/// Where the inputs differ nothing else is compared, and that is a regression.
Comparison compare_rows(const std::vector<Json>& baseline, const std::vector<Json>& candidate,
                        const CompareSettings& settings = {});

/// As "md", with the counts first and then each cell that changed; "json"; or "junit", a test case a cell.
std::string text(const Comparison& comparison, const std::string& format);

}  // namespace hermesh
