// Cells in a process of their own: what a harness that survives its variants says to that process, and hears from it.
//
// The parent sends one job, a line of JSON that names a group of cells (Run::job() of harness.cpp makes it, serve_cells() of group_worker.cpp understands it). The child
// answers with lines of JSON, each an object with one of these keys:
//   planned   the row of a cell as far as it is known before the work on it begins
//   at        the label of the cell that it works on from now on
//   row       a finished row
//   note      a sentence that the user should read (RunContext::note)
//   stage     name of a stage, with "fraction", for the line of progress
//   done      all rows have been sent
//   error     a sentence; with "missing": true (DataMissing) or "unreadable": true (CaseUnreadable); no rows come after it
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/child_process.h"

namespace hermesh {

/// The program that works as the child, and what it may take.
struct Apart {
  std::filesystem::path program;
  std::vector<std::string> arguments;  ///< with which it calls serve_cells() of harness.h
  ChildLimits limits;
};

/// What came of a job.
struct ApartOutcome {
  std::vector<Json> rows;
  std::vector<Json> planned;
  std::string reason;   ///< why the child ended before it was done; "" if it was done
  std::string culprit;  ///< label of the cell that it worked on then; "" if on none yet
  bool crashed = false; ///< whether that was a signal, which may have its cause in an earlier cell
};

/// Runs a job to its end. `row` gets each row as it comes. @throws Cancelled; DataMissing, CaseUnreadable, Error: the child's.
ApartOutcome run_apart(const Apart& apart, const Json& job, const std::function<void(const Json&)>& row,
                       RunContext& context);

/// The child's side.
class Answers {
 public:
  /// `descriptor` is ChildProcess::kAnswers, or that of a file in tests.
  explicit Answers(int descriptor) : descriptor_(descriptor) {}
  void send(const Json& answer) const;
  /// What a group of cells reports its work to.
  CellWatch watch() const;

 private:
  int descriptor_;
};

}  // namespace hermesh
