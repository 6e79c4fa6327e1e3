// The harness: experiment file in, one JSON row per cell of its matrix out.
#pragma once

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/core/variant.h"
#include "experiments/harness/apart.h"

namespace hermesh {

/// Both tables, ours first.
std::vector<Extractor> all_extractors();
std::vector<Voxelizer> all_voxelizers();

struct ExperimentInfo {
  std::string name, question;
  std::filesystem::path file;
  std::vector<std::string> shows;  ///< tables and figures of the thesis that it makes, "table_9_2" or "figure_9_8"
};
/// The experiments that come with the project: the files below experiments/questions/, and the predictions of ablations.
std::vector<ExperimentInfo> list_experiments();

/// The file of an experiment: `name` is its path, its name, or a table or figure of the thesis that it makes.
/// @throws Error for a name that is none of these, with those most like it, and for a path to no file that ends in the name of
/// an experiment.
std::filesystem::path experiment_file(const std::string& name);

/// What a quick look takes in place of what the file says; empty leaves that as it is.
struct Overrides {
  std::vector<std::string> variants;   ///< labels or names in the file; else names of the table, with default options
  std::vector<std::string> cases;      ///< names in the file; else cases, or mesh files, at the resolutions of the first
  std::vector<int> resolutions;        ///< of all cases
  std::optional<int> repetitions = {};
  std::map<std::string, std::string> parameters = {};  ///< of a measurement, by name
};

struct RunSettings {
  std::filesystem::path experiment;
  std::string tier = "quick";  ///< "quick" or "full"
  std::filesystem::path out;   ///< folder for rows.jsonl, meshes and pictures
  std::string filter;          ///< only cells whose "case/resolution/variant" contains this text
  Overrides overrides = {};
  /// Whether cells that `out` has rows of are not made again: of the same cell, settings, program (by the hash of its file)
  /// and data (by their hash). Groups with outside programs are always made again.
  bool resume = false;
  /// The program that works on the cells, and its limits, which come before those of the file; none: they are worked on in
  /// this process, which does not survive the crash of one.
  std::optional<Apart> apart = {};
  std::function<void(const std::string&)> log = {};  ///< gets a line for each group of cells that is done
};

/// Runs every cell: validates once, then times in interleaved repetitions; appends rows to out/rows.jsonl, those of a group
/// (a case, resolution and voxelizer) as soon as it is done, prints the table to `table`, writes a picture a group. A cell
/// that crashes, hangs or goes over a limit, or has no input, is a row with the reason; the others of its group are begun anew.
/// Returns 0; 3 if a promise was broken, the libraries' counts are not ours or required data are missing; otherwise 1 if a cell
/// failed, which its row explains, and the last line counts.
/// @throws Error for a mistake in the file, naming its line; Cancelled.
int run_experiment(const RunSettings& settings, RunContext& context, std::ostream& table);

/// The child's side of RunSettings::apart: reads a job from the standard input, works on its cells, and answers on
/// ChildProcess::kAnswers. Returns its exit code. @throws Cancelled.
int serve_cells(const struct Tables& tables, RunContext& context);
int serve_cells(RunContext& context);  ///< with the tables of the program

/// Tables from the rows under `folder`, as "md", "csv" or "tex"; or "plots", which draws them into it and
/// says which.
/// @throws Error if there are no rows.
void write_report(const std::filesystem::path& folder, const std::string& format, std::ostream& out);

}  // namespace hermesh
