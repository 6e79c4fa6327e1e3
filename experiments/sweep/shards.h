// Shards: the parts that an experiment is cut into where it outgrows a machine, and what each says of itself.
//
// The partition depends on the experiment file and its tier alone. What is dealt out are groups of cells
// (group_worker.h), since the cells of a group take turns while they are timed. A group weighs its cells
// times the square of its resolution, as a narrow band has about as many voxels. The groups go, the heaviest
// first and those of one weight in the order of the file, to the shard that has the least weight so far, of
// several the one with the lowest number. The heaviest shard thus weighs at most 4/3 − 1/(3 N) of what the
// best partition into N gives (Graham, "Bounds on multiprocessing timing anomalies", 1969).
#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "algorithms/core/run_context.h"
#include "experiments/harness/columns.h"

namespace hermesh {

struct RunSettings;
struct Tables;

/// One of the parts, numbered from 1.
struct Shard {
  int number = 1, of = 1;
  bool operator==(const Shard&) const = default;
};

/// Most parts that an experiment can be cut into.
constexpr int kMostShards = 10'000;

/// The shard that a text such as "2/3" names. @throws Error for anything else.
Shard shard_of(const std::string& text);

/// The number of the shard, from 1, that each of the weights falls to.
std::vector<int> partition(const std::vector<double>& weights, int shards);

/// A cell of the whole experiment.
struct ShardedCell {
  std::string cell;  ///< fingerprint of all that the file says of it, as its row has it under "cell"
  std::string name;  ///< "dragon/400/openvdb/contouring" for a reader
  int shard = 1;     ///< the number of the one that makes it
};

/// What a folder of a shard says of itself, in its file shard.json: which program makes what part of what.
/// The file is written before the first row and once more at the end.
struct ShardManifest {
  std::string experiment, tier;
  std::string file_sha256;  ///< of the experiment file
  Shard shard;
  std::string commit, binary;  ///< the program's, as in its rows
  int threads = 0;
  std::vector<ShardedCell> cells = {};  ///< of all shards, in the order of the file
  bool finished = false;                ///< whether the shard has a row for each of its cells
};

/// run_experiment() of a part of the cells; the folder also gets a manifest. A shard may have no cells. Plots
/// are left to the merged rows (experiments/ledger/merge.h).
/// @throws Error for a filter or overrides, as a shard is a part of the whole file; for a measurement, whose
/// one function makes all rows; for a file that names a cell twice; and for the folder of another shard.
/// Otherwise as run_experiment().
int run_shard(const Shard& shard, const RunSettings& settings, RunContext& context, std::ostream& table);
int run_shard(const Shard& shard, const RunSettings& settings, const Tables& tables, RunContext& context,
              std::ostream& table);

/// The path of the manifest in a shard's folder.
std::filesystem::path manifest_path(const std::filesystem::path& folder);

/// Puts it into the folder in one step, so that a killed run leaves the former one or this one. @throws Error
/// if that fails.
void write_manifest(const ShardManifest& manifest, const std::filesystem::path& folder);

/// @throws Error naming the folder if it holds no manifest.
ShardManifest read_manifest(const std::filesystem::path& folder);

}  // namespace hermesh
