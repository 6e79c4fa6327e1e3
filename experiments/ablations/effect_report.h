// Effects of an ablation from its rows: as a table with intervals and verdicts, and as a forest plot.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "experiments/ablations/paired_effect.h"
#include "experiments/harness/columns.h"

namespace hermesh {

struct JudgedEffect {
  PredictedEffect predicted;
  EffectSize size;
  PredictionVerdict verdict = PredictionVerdict::kUndecided;
};

/// An ablation with its effects over the latest rows of one experiment and tier.
struct JudgedAblation {
  std::string experiment, tier, question, commit;
  Ablation ablation;
  Json prediction;  ///< as prediction_of() made it
  std::size_t subjects = 0;
  std::vector<JudgedEffect> effects;  ///< in the order of the file
};

/// Each ablation of the rows, tier by tier; none where the rows are of other experiments. Rows of an older
/// wording of the file than the last row's are left out.
std::vector<JudgedAblation> judge_ablations(const std::vector<Json>& rows);

/// A paragraph with the factor and the prediction's commit, a table with a line for each effect, and the
/// predictions.
void write_effects(const JudgedAblation& judged, std::ostream& out);

/// The effects of all of them in one table of Markdown, and how many predictions held, fell or are undecided.
std::string summary_of(const std::vector<JudgedAblation>& ablations);

/// Draws each ablation's effects with their intervals over the predicted ranges, ratios in one plot and
/// differences of each column in another, as PNG and SVG beside the script, and names the files; or says that
/// gnuplot is not there.
/// @throws Error if the folder cannot be written.
void write_forest_plots(const std::vector<JudgedAblation>& ablations, const std::filesystem::path& folder,
                        std::ostream& out);

}  // namespace hermesh
