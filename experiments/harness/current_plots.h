// Plots of old rows as the experiment's file asks for them today.
#pragma once

#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// The rows with the plots of experiments/NAME.toml in place of their own, where the checkout has the
/// experiment NAME that a row is of; others keep theirs. What is drawn can so be mended without making rows
/// anew. @throws Error for a file with an error.
std::vector<Json> with_current_plots(std::vector<Json> rows);

}  // namespace hermesh
