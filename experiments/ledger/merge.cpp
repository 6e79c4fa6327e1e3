#include "experiments/ledger/merge.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "algorithms/core/error.h"
#include "experiments/harness/failures.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/rows.h"
#include "experiments/ledger/compare.h"
#include "experiments/sweep/shards.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

struct ShardFolder {
  fs::path path;
  ShardManifest manifest;
};

bool same_cell(const ShardedCell& a, const ShardedCell& b) {
  return a.cell == b.cell && a.name == b.name && a.shard == b.shard;
}

/// @throws Error for the first thing in which the two are not parts of one whole.
void check_of_one(const ShardFolder& a, const ShardFolder& b) {
  const auto same = [&](const std::string& what, const auto& ours, const auto& theirs) {
    if (ours != theirs)
      throw Error(a.path.string() + " and " + b.path.string() + " are of " + what + " (" + ours + " and " +
                  theirs + ") and cannot be merged");
  };
  const auto number = [](int value) { return std::to_string(value); };
  const ShardManifest &ours = a.manifest, &theirs = b.manifest;
  same("different experiments", ours.experiment, theirs.experiment);
  same("different tiers", ours.tier, theirs.tier);
  same("different states of the experiment file", ours.file_sha256.substr(0, 12),
       theirs.file_sha256.substr(0, 12));
  same("different numbers of shards", number(ours.shard.of), number(theirs.shard.of));
  same("different commits", ours.commit, theirs.commit);
  same("different programs", ours.binary, theirs.binary);
  same("runs with different numbers of threads", number(ours.threads), number(theirs.threads));
  if (!std::ranges::equal(ours.cells, theirs.cells, same_cell))
    throw Error(a.path.string() + " and " + b.path.string() + " name different cells and cannot be merged");
}

/// @throws Error naming the shards of which no folder was given.
void check_all_there(const std::vector<ShardFolder>& folders) {
  std::set<int> there;
  for (const ShardFolder& folder : folders) there.insert(folder.manifest.shard.number);
  const int of = folders.front().manifest.shard.of;
  std::string missing;
  int count = 0;
  for (int number = 1; number <= of; ++number)
    if (!there.contains(number)) missing += (count++ ? ", " : "") + std::to_string(number);
  if (count > 0)
    throw Error((count == 1 ? "shard " : "shards ") + missing + " of " + std::to_string(of) +
                (count == 1 ? " is" : " are") + " missing");
}

/// Whether the rows agree in all but times and memory, which is what one program makes of one input.
bool same_values(const Json& a, const Json& b) {
  const CompareSettings exact{.tolerance = 0.0, .costs = false};
  return text_at(a, "/failed") == text_at(b, "/failed") &&
         text_at(a, "/case/sha256") == text_at(b, "/case/sha256") && compare_rows({a}, {b}, exact).fine() &&
         compare_rows({b}, {a}, exact).fine();
}

/// The last row of each cell that the folder's program made.
std::map<std::string, Json> last_rows(const ShardFolder& folder) {
  std::map<std::string, Json> rows;
  const fs::path file = folder.path / "rows.jsonl";
  std::error_code error;
  if (const auto size = fs::file_size(file, error); error || size == 0)
    return rows;  // a shard may have no cells
  for (Json& row : read_rows(file)) {
    if (text_at(row, "/binary") != folder.manifest.binary) continue;
    const std::string cell = text_at(row, "/cell");
    rows[cell] = std::move(row);
  }
  return rows;
}

/// Remembers which input a case was, and in which folder.
class Inputs {
 public:
  /// @throws Error if the row's case was another input before.
  void check(const Json& row, const fs::path& folder) {
    const std::string hash = text_at(row, "/case/sha256");
    if (hash.empty()) return;  // of a case that cannot be read
    const std::string name = text_at(row, "/case/name");
    const auto [known, is_new] = known_.try_emplace(name + "/" + text_at(row, "/sweep/value"), hash, folder);
    if (!is_new && known->second.first != hash)
      throw Error("the case " + name + " is another input in " + folder.string() + " than in " +
                  known->second.second.string());
  }

 private:
  std::map<std::string, std::pair<std::string, fs::path>> known_;
};

void copy_files(const fs::path& from, const fs::path& to) {
  for (auto each = fs::recursive_directory_iterator(from); each != fs::recursive_directory_iterator();
       ++each) {
    const fs::path& path = each->path();
    if (!each->is_regular_file() || path.extension() == ".jsonl" ||
        path.filename().string().starts_with("shard.json"))
      continue;
    const fs::path target = to / path.lexically_relative(from);
    fs::create_directories(target.parent_path());
    fs::copy_file(path, target, fs::copy_options::skip_existing);
  }
}

/// @throws Error if rows in `out` would be beside others, or would be read with those of a shard.
void check_folder(const fs::path& out, const std::vector<fs::path>& shards) {
  const auto absolute = [](const fs::path& path) { return fs::weakly_canonical(fs::absolute(path)); };
  for (const fs::path& shard : shards) {
    const fs::path from_shard = absolute(out).lexically_relative(absolute(shard));
    if (from_shard == "." || *from_shard.begin() != "..")
      throw Error(out.string() + " is in the shard " + shard.string());
  }
  if (!fs::exists(out)) return;
  if (!fs::is_directory(out)) throw Error(out.string() + " is no folder");
  for (const auto& each : fs::recursive_directory_iterator(out))
    if (each.is_regular_file() && each.path().extension() == ".jsonl")
      throw Error(out.string() + " has rows already: " + each.path().string());
}

}  // namespace

std::vector<Json> merged_rows(const std::vector<fs::path>& shards) {
  std::vector<ShardFolder> folders;
  for (const fs::path& shard : shards) folders.push_back({shard, read_manifest(shard)});
  if (folders.empty()) throw Error("there are no shards to merge");
  for (const ShardFolder& folder : folders) check_of_one(folders.front(), folder);
  check_all_there(folders);

  std::map<std::string, std::pair<Json, fs::path>> found;
  Inputs inputs;
  const std::vector<ShardedCell>& cells = folders.front().manifest.cells;
  for (const ShardFolder& folder : folders) {
    std::map<std::string, Json> own = last_rows(folder);
    for (const ShardedCell& cell : cells) {
      const auto row = own.find(cell.cell);
      if (row == own.end()) continue;
      const auto [there, is_new] = found.try_emplace(cell.cell, row->second, folder.path);
      if (!is_new && !same_values(there->second.first, row->second))
        throw Error("the cell " + cell.name + " has other values in " + folder.path.string() + " than in " +
                    there->second.second.string());
      inputs.check(row->second, folder.path);
    }
  }

  std::vector<Json> rows;
  std::vector<const ShardedCell*> missing;
  for (const ShardedCell& cell : cells)
    if (const auto row = found.find(cell.cell); row != found.end())
      rows.push_back(std::move(row->second.first));
    else
      missing.push_back(&cell);
  if (!missing.empty())
    throw Error(std::to_string(missing.size()) + " of " + std::to_string(cells.size()) +
                " cells are missing, the first is " + missing[0]->name + " of shard " +
                std::to_string(missing[0]->shard) + ": run that shard again, to its end");
  for (Json& row : rows) {
    const std::string run = text_at(row, "/run"), first = text_at(rows.front(), "/run");
    if (run == first) continue;
    row["shard_run"] = run;
    row["run"] = first;
  }
  return rows;
}

void merge_shards(const fs::path& out, const std::vector<fs::path>& shards, std::ostream& text) {
  check_folder(out, shards);
  const std::vector<Json> rows = merged_rows(shards);
  const fs::path file = out / "rows.jsonl", half = out / "rows.half";
  try {
    fs::create_directories(out);
    for (const fs::path& shard : shards) copy_files(shard, out);
    fs::remove(half);
    append_rows(half, rows);
    fs::rename(half, file);
  } catch (const fs::filesystem_error& error) {
    throw Error("cannot merge into " + out.string() + ": " + error.what());
  }
  write_report(out, "plots", text);
  text << "Rows: " << file.string() << ", " << rows.size() << " cells of " << shards.size() << " shards\n";
  write_failures(rows, text);
}

}  // namespace hermesh
