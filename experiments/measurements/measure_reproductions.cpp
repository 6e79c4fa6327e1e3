// What it takes to reproduce a table or figure of the thesis: each experiment that makes some is run by a program of its own,
// as a user would run it.
#include <unistd.h>

#include <algorithm>

#include "experiments/cases/cases.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/measure.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/shell.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// "table_9_2" as a reader writes it.
std::string shown_number(const std::string& number) {
  std::string text = number;
  text[text.find('_')] = ' ';
  text[text.find('_')] = '.';
  return text;
}

struct Finished {
  double seconds = 0.0;
  int exit_code = 0;
  std::size_t rows = 0, pictures = 0;
};

Finished run(const ExperimentInfo& experiment, const std::string& tier, const fs::path& folder) {
  const fs::path program = fs::read_symlink("/proc/self/exe");
  Finished finished;
  int status = -1;
  finished.seconds = timed([&] {
    status = shell_output(shell_quoted(program.string()) + " run --quiet --tier " + tier + " --out " +
                          shell_quoted(folder.string()) + " " + shell_quoted(experiment.file.string()) + " >" +
                          shell_quoted((folder.string() + ".log")) + " 2>&1")
                 .status;
  });
  finished.exit_code = status < 0 || status % 256 != 0 ? -1 : status / 256;
  if (fs::exists(folder / "rows.jsonl")) finished.rows = read_rows(folder / "rows.jsonl").size();
  for (const auto& entry : fs::recursive_directory_iterator(folder)) finished.pictures += entry.path().extension() == ".png" ? 1 : 0;
  return finished;
}

std::vector<MeasuredRow> measure_reproductions(const MeasurementInput& input) {
  const std::string tier = input.parameters.text("tier");
  const fs::path scratch = fs::temp_directory_path() / ("hermesh-reproductions-" + std::to_string(getpid()));
  std::vector<MeasuredRow> rows;
  for (const ExperimentInfo& experiment : list_experiments()) {
    if (std::ranges::none_of(experiment.shows,
                             [&](const std::string& number) { return input.wants("numbers", shown_number(number)); }))
      continue;
    input.context.check();
    input.context.progress("run " + experiment.name, 0.0);
    fs::create_directories(scratch / experiment.name);
    const Finished finished = run(experiment, tier, scratch / experiment.name);
    for (const std::string& number : experiment.shows) {
      MeasuredRow row{"numbers", shown_number(number)};
      row.values = {{"command", "./reproduce " + number}, {"experiment", experiment.name}, {"minutes", finished.seconds / 60},
                    {"rows", finished.rows},              {"pictures", finished.pictures}, {"exit_code", finished.exit_code}};
      // A broken promise is a finding of the experiment; without rows it did not run.
      if (finished.rows == 0 || (finished.exit_code != 0 && finished.exit_code != 3))
        row.broken.push_back("the experiment gave no rows, or ended with another code than 0 or 3");
      rows.push_back(std::move(row));
    }
    fs::remove_all(scratch);
  }
  return rows;
}

}  // namespace

Measurement reproductions_measurement() {
  return {"reproductions",
          "how long each table and figure of the thesis takes to reproduce",
          {{"tier", "quick", "tier of the experiments", {"quick", "full"}}},
          {{"numbers",
            "tables and figures of the thesis",
            "number",
            {{"command", "command", "what reproduces it, once the program is built"},
             {"experiment", "experiment", "that makes it"},
             {"minutes", "minutes", "that the experiment took, all its tables and figures included"},
              {"rows", "rows", "that it gave"},
             {"pictures", "pictures", "that it drew"},
             {"exit_code", "exit code", "0, or 3 where a promise was found broken"}}}},
          measure_reproductions};
}

}  // namespace hermesh
