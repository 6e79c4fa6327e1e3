// Baselines: rows that were accepted as what the program should make, with the reason, for `hermesh compare`
// to hold others against.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

struct AcceptedRows {
  std::string experiment;  ///< whose rows they are, and the name of the baseline's folder
  std::vector<Json>
      rows;  ///< of several runs of a cell the last, each with {"accepted": {"reason", "date", "commit"}}
};

/// The rows as a baseline. Rows of one commit are accepted alone, for a baseline says what one program makes.
/// @throws Error without a reason; for rows of several experiments or commits, of sources that had changes or
/// are unknown; and, unless `with_failures`, for rows that failed or broke what they promise.
AcceptedRows accepted(const std::vector<Json>& rows, const std::string& reason, bool with_failures);

/// Writes folder/EXPERIMENT/rows.jsonl in the place of what was there, at once or not at all, and returns its
/// path.
/// @throws Error if it cannot be written.
std::filesystem::path write_baseline(const AcceptedRows& accepted, const std::filesystem::path& folder);

}  // namespace hermesh
