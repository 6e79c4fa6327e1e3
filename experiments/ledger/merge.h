// Shards of an experiment (experiments/sweep/shards.h), joined to the rows of the whole.
#pragma once

#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// The rows of all cells of an experiment from the folders of its shards, each once, in the order of the
/// experiment file. They are those of one run without shards, times and the like aside; all carry the `run`
/// of the first, so that they share tables, and where that was not theirs, their own under `shard_run`. Of
/// several rows of a cell in one folder the last one counts, as a run that is taken up again replaces what
/// was made of other data. A shard may be given twice.
/// @throws Error in one sentence for folders that are no shards, or not of one experiment, tier, file,
/// partition, commit, program and number of threads; for shards and cells that are missing; for a cell of
/// which two folders have differing values; and for a case that is another input in one folder than in
/// another.
std::vector<Json> merged_rows(const std::vector<std::filesystem::path>& shards);

/// Writes those rows to out/rows.jsonl, the last thing of all, copies the meshes and pictures of the shards
/// beside them, draws the plots, and says on `text` how many cells there are and how many failed.
/// @throws as merged_rows(); Error if there are rows below `out` already, `out` is in a shard, or it cannot
/// be written.
void merge_shards(const std::filesystem::path& out, const std::vector<std::filesystem::path>& shards,
                  std::ostream& text);

}  // namespace hermesh
