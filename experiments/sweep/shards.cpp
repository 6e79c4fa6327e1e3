#include "experiments/sweep/shards.h"

#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "algorithms/core/error.h"
#include "algorithms/core/shown.h"

namespace hermesh {

Shard shard_of(const std::string& text) {
  Shard shard{0, 0};
  const std::size_t slash = text.find('/');
  const auto read = [&](std::size_t begin, std::size_t end, int& value) {
    const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + end, value);
    return error == std::errc() && stop == text.data() + end;
  };
  if (slash == std::string::npos || !read(0, slash, shard.number) ||
      !read(slash + 1, text.size(), shard.of) || shard.of < 1 || shard.of > kMostShards || shard.number < 1 ||
      shard.number > shard.of)
    throw Error("--shard takes the number of a part and how many there are, such as 2/3, with at most " +
                std::to_string(kMostShards) + " parts, not '" + shown(text) + "'");
  return shard;
}

std::vector<int> partition(const std::vector<double>& weights, int shards) {
  std::vector<std::size_t> order(weights.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  std::ranges::stable_sort(order, std::greater(), [&](std::size_t i) { return weights[i]; });
  std::vector<double> sums(static_cast<std::size_t>(shards), 0.0);
  std::vector<int> parts(weights.size());
  for (const std::size_t i : order) {
    const auto lightest = std::ranges::min_element(sums);
    *lightest += weights[i];
    parts[i] = static_cast<int>(lightest - sums.begin()) + 1;
  }
  return parts;
}

std::filesystem::path manifest_path(const std::filesystem::path& folder) { return folder / "shard.json"; }

void write_manifest(const ShardManifest& manifest, const std::filesystem::path& folder) {
  Json cells = Json::array();
  for (const ShardedCell& cell : manifest.cells) cells.push_back({cell.cell, cell.name, cell.shard});
  const Json json = {{"experiment", manifest.experiment},
                     {"tier", manifest.tier},
                     {"file_sha256", manifest.file_sha256},
                     {"shard", manifest.shard.number},
                     {"of", manifest.shard.of},
                     {"commit", manifest.commit},
                     {"binary", manifest.binary},
                     {"threads", manifest.threads},
                     {"finished", manifest.finished},
                     {"cells", cells}};
  const std::filesystem::path file = manifest_path(folder),
                              half = file.string() + "." + std::to_string(getpid());
  std::ofstream stream(half);
  stream << json.dump(1, ' ', false, Json::error_handler_t::replace) << '\n';
  stream.close();
  std::error_code error;
  if (stream) std::filesystem::rename(half, file, error);
  if (!stream || error) throw Error("cannot write " + file.string() + (error ? ": " + error.message() : ""));
}

ShardManifest read_manifest(const std::filesystem::path& folder) {
  const std::filesystem::path file = manifest_path(folder);
  if (!std::filesystem::is_regular_file(file))
    throw Error(folder.string() +
                " is no shard of an experiment: it has no shard.json, which `hermesh run --shard` writes");
  std::ifstream stream(file);
  const Json json = Json::parse(stream, nullptr, false);
  try {
    ShardManifest manifest{
        json.at("experiment"), json.at("tier"),   json.at("file_sha256"), {json.at("shard"), json.at("of")},
        json.at("commit"),     json.at("binary"), json.at("threads"),     {},
        json.at("finished")};
    for (const Json& cell : json.at("cells")) manifest.cells.push_back({cell.at(0), cell.at(1), cell.at(2)});
    return manifest;
  } catch (const Json::exception&) {
    throw Error(file.string() + " is torn or no manifest of a shard; run the shard again");
  }
}

}  // namespace hermesh
