// Jobs: the requests of the laboratory (experiments/lab/driver.py) to hermesh-lab, as lines of JSON on the
// standard input, and the answers, lines of JSON on file descriptor 3.
//
// A job is an object with "kind", "threads", "require_data" and "out", and depending on its kind
//   extraction, voxelization  the cells of one group: GroupJob
//   input                     the description of an input: "case", "sweep"
//   distances                 of the vertices of mesh files to an input: "case", "sha256", "meshes"
//   measurement               the rows of a measurement: "measurement", "parameters", "seed", "filter",
//   "done", "head"
//
// Answers are objects with one of these keys:
//   planned   the keys of a row that are known before its cell is run
//   at        label of the cell that runs next
//   row       a finished row
//   input     name, origin, sha256 and size of an input
//   distances of the vertices of one mesh file, world units
//   note      a message for the user
//   stage     name of a stage, with "fraction"
//   done      all rows have been sent
//   error     a message; with "missing": true (DataMissing) or "unreadable": true (CaseUnreadable); no rows
//   follow
#pragma once

#include "experiments/harness/job.h"

namespace hermesh {

/// Returns the tables of the program.
Tables all_tables();

/// Reads one job from the standard input, works on it and sends the answers. @throws Error if there is no
/// job.
void serve_job(const Tables& tables, RunContext& context);

/// Returns extractors and voxelizers with their options, cases, measurements with parameters and tables, for
/// experiments/lab/experiment.py.
Json vocabulary(const Tables& tables);

}  // namespace hermesh
