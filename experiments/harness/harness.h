// The harness: experiment file in, one JSON row per cell of its matrix out.
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "algorithms/core/variant.h"

namespace hermesh {

/// Both tables, ours first.
std::vector<Extractor> all_extractors();
std::vector<Voxelizer> all_voxelizers();

struct ExperimentInfo {
  std::string name, question;
  std::filesystem::path file;
  std::vector<std::string> shows;  ///< tables and figures of the thesis that it makes, "table_9_2" or "figure_9_8"
};
/// The experiments/*.toml that come with the project.
std::vector<ExperimentInfo> list_experiments();

/// The file of an experiment: `name` is its path, its name, or a table or figure of the thesis that it makes.
/// @throws Error for a name that is none of these, with those most like it.
std::filesystem::path experiment_file(const std::string& name);

struct RunSettings {
  std::filesystem::path experiment;
  std::string tier = "quick";  ///< "quick" or "full"
  std::filesystem::path out;   ///< folder for rows.jsonl, meshes and pictures
  std::string filter;          ///< only cells whose "case/resolution/variant" contains this text
};

/// Runs every cell: validates once, then times in interleaved repetitions; appends rows to out/rows.jsonl,
/// prints the table to `table`, writes a picture a case and resolution. Returns 0; 3 if a promise was broken
/// or the libraries' counts are not ours; otherwise 1 if a variant failed, which its row explains.
/// @throws Error for a mistake in the file, naming its line.
int run_experiment(const RunSettings& settings, RunContext& context, std::ostream& table);

/// Tables from the rows under `folder`, as "md", "csv" or "tex"; or "plots", which draws them into it and
/// says which.
/// @throws Error if there are no rows.
void write_report(const std::filesystem::path& folder, const std::string& format, std::ostream& out);

}  // namespace hermesh
