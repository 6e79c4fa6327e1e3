// The keys of an experiment file that make it an ablation (ablation.h; predictions/ablation_truncation.toml
// explains them).
#pragma once

#include <filesystem>
#include <optional>

#include "experiments/ablations/ablation.h"

namespace hermesh {

class Section;
struct Experiment;
struct Vocabulary;

/// The ablation that a file is, if it has the key that makes it one. `experiment` is what else the file says.
/// @throws Error naming file and line of a key that is missing or wrong, and of a falsifier that does not fit
/// its prediction.
std::optional<Ablation> read_ablation(const Section& file, const Experiment& experiment,
                                      const Vocabulary& vocabulary);

/// What read_ablation() finds in a file that read_experiment() has read.
std::optional<Ablation> read_ablation(const std::filesystem::path& path, const Experiment& experiment,
                                      const Vocabulary& vocabulary);

}  // namespace hermesh
