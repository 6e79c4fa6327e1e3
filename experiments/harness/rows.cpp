#include "experiments/harness/rows.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "algorithms/core/error.h"

namespace hermesh {

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

std::map<std::string, std::string> options_in(const std::string& canonical) {
  std::map<std::string, std::string> options;
  std::istringstream words(canonical);
  std::string key;
  for (std::string word; words >> word;)
    if (const std::size_t equals = word.find('='); equals != std::string::npos)
      options[key = word.substr(0, equals)] = word.substr(equals + 1);
    else if (!key.empty())
      options[key] += " " + word;
  return options;
}

void append_row(const std::filesystem::path& file, const Json& row) { append_rows(file, {row}); }

void append_rows(const std::filesystem::path& file, const std::vector<Json>& rows) {
  // A row may hold text from outside (a CPU's name, a library's message); what is no UTF-8 in it must not
  // lose the row.
  std::string line;
  for (const Json& row : rows) line += row.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  const int descriptor = open(file.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0644);
  const bool written =
      descriptor >= 0 && write(descriptor, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  const std::string reason = std::strerror(errno);
  if (descriptor >= 0) close(descriptor);
  if (!written) throw Error("cannot append a row to " + file.string() + ": " + reason);
}

bool drop_torn_row(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  if (text.empty() || text.back() == '\n') return false;
  std::error_code error;
  std::filesystem::resize_file(file, text.rfind('\n') + 1, error);
  if (error) throw Error("cannot cut the last line off " + file.string() + ": " + error.message());
  return true;
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
