// Rows that the present program no longer makes: a sample of the cells behind the rows of results/ is made once more, from
// what the rows say of themselves, and what comes out is held against them. Dates and commits decide nothing.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "experiments/harness/run_cells.h"

namespace hermesh {

/// What a sample of one folder's cells gave.
struct FolderCheck {
  std::size_t rows = 0;       ///< that the folder shows
  std::size_t tried = 0;      ///< rows of the sample
  std::size_t by_digest = 0;  ///< of these, those compared by digest; the others by their counts
  std::size_t differing = 0;  ///< of these, those that came out otherwise or can no longer be made
  std::string sample;         ///< which cells
  std::string difference;     ///< the first: cell, value then, value now
  std::string skipped;        ///< why nothing was tried, where nothing was
};

/// Makes the sample of a folder's rows again. Of an extraction or voxelization it is the `groups` cheapest cases at one
/// resolution by the times in the rows, all variants; of a measurement one row of each table. Compared are digests; where a
/// row of an older program has none, whole numbers and texts (counts), and never times or memory. Rows whose input is a
/// stand-in, or not at hand as the row's hash has it, are passed over. `scratch` is a folder for what the cells write.
/// @throws Cancelled.
FolderCheck check_folder(const std::vector<Json>& rows, std::size_t groups, const Tables& tables,
                         const std::filesystem::path& scratch, RunContext& context);

}  // namespace hermesh
