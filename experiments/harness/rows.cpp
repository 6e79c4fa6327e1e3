#include "experiments/harness/rows.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

namespace hermesh {
using validation::MeshReport;

std::vector<std::string> promise_words(const Promises& promises) {
  std::vector<std::string> words;
  if (promises.closed) words.push_back("closed");
  if (promises.manifold) words.push_back("manifold");
  if (promises.oriented) words.push_back("oriented");
  if (promises.no_self_intersection) words.push_back("no self-intersection");
  return words;
}

PromiseCheck check_promises(const Promises& promises, const MeshReport& report) {
  PromiseCheck check;
  const auto counted = [](std::int64_t count, const char* what) {
    return std::to_string(count) + " " + what;
  };
  if (promises.closed && !report.closed())
    check.broken.push_back("closed (" + counted(report.boundary_edges, "boundary edges)"));
  if (promises.manifold && !report.manifold())
    check.broken.push_back("manifold (" + counted(report.non_manifold_edges, "edges and ") +
                           counted(report.non_manifold_vertices, "vertices are not)"));
  if (promises.oriented && !report.oriented())
    check.broken.push_back("oriented (" + counted(report.inconsistent_edges, "inconsistent edges)"));
  // Every polygon turned round leaves no inconsistent edge, but a closed surface then has a negative volume.
  if (promises.oriented && report.oriented() && report.closed() && report.volume < 0.0)
    check.broken.push_back("oriented (inside out, the volume is negative)");
  if (promises.no_self_intersection) {
    if (!report.self_intersections)
      check.unchecked.push_back("no self-intersection");
    else if (report.self_intersections->pairs > 0)
      check.broken.push_back("no self-intersection (" + counted(report.self_intersections->pairs, "pairs)"));
  }
  return check;
}

std::string promise_verdict(const Promises& promises, const PromiseCheck& check) {
  const auto joined = [](const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
    return text;
  };
  if (!check.broken.empty()) return "BROKEN: " + joined(check.broken);
  const std::vector<std::string> words = promise_words(promises);
  if (words.empty()) return "promises nothing";
  return "promises " + joined(words) + (check.unchecked.empty() ? ": kept" : ": not all checked");
}

std::string promise_letters(const Promises& promises, const PromiseCheck& check) {
  std::string letters;
  if (promises.closed) letters += 'c';
  if (promises.manifold) letters += 'm';
  if (promises.oriented) letters += 'o';
  if (promises.no_self_intersection) letters += 'i';
  if (letters.empty()) return "none";
  return letters + (!check.broken.empty() ? " BROKEN" : check.unchecked.empty() ? " kept" : " unchecked");
}

void add_time_ratios(std::vector<Json>& rows) {
  const auto median_of = [](const Json& row) -> const Json* {
    const auto seconds = row.find("seconds");
    return seconds != row.end() && seconds->contains("median") ? &seconds->at("median") : nullptr;
  };
  const auto base = std::find_if(rows.begin(), rows.end(), [&](const Json& row) {
    return row.at("variant").at("name") == "openvdb" && median_of(row) && median_of(row)->get<double>() > 0.0;
  });
  if (base == rows.end()) return;
  const double reference = median_of(*base)->get<double>();
  for (Json& row : rows)
    if (const Json* own = median_of(row)) row["time_over_openvdb"] = own->get<double>() / reference;
}

void add_voxelizer_ratios(std::vector<Json>& rows) {
  const auto base = std::find_if(rows.begin(), rows.end(), [](const Json& row) {
    return text_at(row, "/variant/name") == "openvdb" && text_at(row, "/variant/default_options") == "true" &&
           number_at(row, "/seconds/median") > 0.0;
  });
  if (base == rows.end()) return;
  const double seconds = number_at(*base, "/seconds/median"), peak = number_at(*base, "/peak_bytes");
  for (Json& row : rows) {
    if (const double own = number_at(row, "/seconds/median"); own > 0.0)
      row["openvdb_over_time"] = seconds / own;
    if (find(row, "/peak_bytes") && peak > 0.0)
      row["peak_over_openvdb"] = number_at(row, "/peak_bytes") / peak;
  }
}

void append_row(const std::filesystem::path& file, const Json& row) {
  // A row may hold text from outside (a CPU's name, a library's message); what is no UTF-8 in it must not
  // lose the row.
  const std::string line = row.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  const int descriptor = open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  const bool written =
      descriptor >= 0 && write(descriptor, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  const std::string reason = std::strerror(errno);
  if (descriptor >= 0) close(descriptor);
  if (!written) throw Error("cannot append a row to " + file.string() + ": " + reason);
}

namespace {

void read_file(const std::filesystem::path& file, std::vector<Json>& rows) {
  std::ifstream stream(file);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    if (line.empty()) continue;
    Json row = Json::parse(line, nullptr, false);
    if (!row.is_object() || !row.contains("variant") || !row.contains("case"))
      throw Error(file.string() + ":" + std::to_string(number) + ": this line is not a row of results");
    rows.push_back(std::move(row));
  }
}

}  // namespace

std::vector<Json> read_rows(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (std::filesystem::is_regular_file(folder)) {
    files.push_back(folder);
  } else if (std::filesystem::is_directory(folder)) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
      if (entry.is_regular_file() && entry.path().extension() == ".jsonl") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<Json> rows;
  for (const auto& file : files) read_file(file, rows);
  if (rows.empty())
    throw Error("there are no rows of results (*.jsonl) under " + folder.string() +
                "; `hermesh run` writes them");
  return rows;
}

}  // namespace hermesh
