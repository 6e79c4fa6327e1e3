// The options of hermesh extract for label maps.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "algorithms/core/level_set.h"
#include "experiments/cli/session.h"

namespace hermesh::cli {

struct LabelArguments {
  std::optional<std::int64_t> label;  ///< the only label to extract
  std::string labels;                 ///< "all" or numbers with commas between them; empty: not given
  bool shared_walls = false;
  std::optional<double> smoothing;  ///< voxels
};

/// Adds the options to the command extract.
std::shared_ptr<LabelArguments> add_label_options(CLI::App& command);

/// Returns true if an option of LabelArguments was given.
bool asks_for_labels(const LabelArguments& arguments);

/// Adds a note if the volume of which an isosurface is extracted is a label map.
void note_label_map(const LevelSet& volume, Session& session);

/// Extracts the boundaries of labels. @param grid name, empty for the grid `labels` or the only grid
/// @throws UsageError for other options of the command, which have no effect here
int run_extract_labels(const LabelArguments& arguments, const Paths& paths, const std::string& grid,
                       const CLI::App& command, Session& session);

}  // namespace hermesh::cli
