// Where the prediction of an ablation stands: the commit that last touched its file. A prediction that is not
// committed before the run may have been written after it.
#pragma once

#include <filesystem>
#include <string>

#include "experiments/harness/columns.h"

namespace hermesh {

/// {"file", "sha256", "commit", "date"} of an ablation's file; without the last two where the file is not
/// committed as it is, and then with "note", a sentence that says so.
Json prediction_of(const std::filesystem::path& file);

/// Rows of a folder that check_may_be_kept() guards must have a prediction that was committed.
/// @throws Error for such a folder and a prediction with a note.
void check_prediction(const Json& prediction, const std::filesystem::path& out);

/// What is wrong with the prediction of an ablation's row, a sentence; empty if nothing is, and for any other
/// row. Its commit must be the row's own or one before it, be older than the row, and hold the file with the
/// row's hash. Where the checkout's folder is no git checkout, or has no such history (a shallow one), only
/// what the row says is judged.
std::string prediction_problem(const Json& row, const std::filesystem::path& checkout);

}  // namespace hermesh
