// The options of extract and remesh that say where an adaptive extractor keeps its bound.
#pragma once

#include <optional>
#include <string>

#include "algorithms/core/variant.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "experiments/cli/session.h"

namespace hermesh::cli {

struct AdaptivityArguments {
  std::string mask, frustum, outside, tolerance_grid;  ///< empty: not given
  std::optional<int> frustum_resolution;
};

void add_adaptivity_options(CLI::App& command, AdaptivityArguments& arguments);

/// The field that the options ask for, or none. @throws UsageError for options that contradict one another, a
/// frustum that is none, or an extractor that is not adaptive; Error for a file that cannot be used.
std::optional<AdaptivityField> read_adaptivity(const AdaptivityArguments& arguments,
                                               const Extractor& extractor, Session& session);

}  // namespace hermesh::cli
