#include <nlohmann/json.hpp>
#include <ostream>

#include "experiments/ablations/effect_report.h"
#include "experiments/harness/current_plots.h"
#include "experiments/harness/harness.h"
#include "experiments/pictures/plot.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/table.h"

namespace hermesh {
namespace {

/// Tables of one experiment follow one another under its question.
void write_markdown_report(const std::vector<Json>& rows, std::ostream& out) {
  std::string experiment;
  const std::vector<JudgedAblation> ablations = judge_ablations(rows);
  for (const RowGroup& group : latest_groups(rows)) {
    const Json& first = group.rows.front();
    const std::string name = first.value("experiment", "") + " (" + first.value("tier", "") + ")";
    if (name != experiment) out << "## " << name << ": " << first.value("question", "") << "\n\n";
    // What was asked comes before the rows that answer it.
    if (name != experiment)
      for (const JudgedAblation& judged : ablations)
        if (judged.experiment + " (" + judged.tier + ")" == name) write_effects(judged, out);
    experiment = name;
    write_markdown(group, out);
    write_legend(group.rows, out);
    out << '\n';
  }
}

}  // namespace

void write_report(const std::filesystem::path& folder, const std::string& format, std::ostream& out) {
  if (format != "md" && format != "csv" && format != "tex" && format != "plots")
    throw Error("there is no format \"" + format + "\" of reports; there are md, csv, tex, plots");
  const std::vector<Json> rows = read_rows(folder);
  if (format == "plots") {
    const std::filesystem::path place = std::filesystem::is_directory(folder) ? folder : folder.parent_path();
    write_plots(with_current_plots(rows, place), place, out);
    return write_forest_plots(judge_ablations(rows), place, out);
  }
  if (format == "csv") return write_csv(rows, out);
  if (format == "md") return write_markdown_report(rows, out);
  for (const RowGroup& group : latest_groups(rows)) write_latex(group, out);
}

}  // namespace hermesh
