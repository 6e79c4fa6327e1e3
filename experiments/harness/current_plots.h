// Plots of old rows as the experiment's file asks for them today.
#pragma once

#include <filesystem>
#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// The rows with the plots of the experiment's own file in place of their own, where `folder` is one that the
/// project keeps (provenance.h) and the checkout has the experiment NAME that a row is of; others keep theirs,
/// for somebody's own experiment may have the name of one of the project's. What is drawn can so be mended
/// without making rows anew. @throws Error for a file with an error.
std::vector<Json> with_current_plots(std::vector<Json> rows, const std::filesystem::path& folder);

}  // namespace hermesh
