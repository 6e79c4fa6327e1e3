#include "experiments/ledger/baseline.h"

#include <chrono>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>

#include "algorithms/core/error.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/table.h"

namespace hermesh {
namespace {

std::string now() {
  const std::time_t time = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&time, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string cell_name(const Json& row) {
  return text_at(row, "/case/name") + " / " + text_at(row, "/variant/label");
}

/// The value that all rows have at a place. @throws Error with `what` where they have several.
std::string common_at(const std::vector<Json>& rows, const std::string& place, const std::string& what) {
  const std::string value = text_at(rows.front(), place);
  for (const Json& row : rows)
    if (text_at(row, place) != value)
      throw Error("the rows are of more than one " + what + ": " + value + " and " + text_at(row, place));
  return value;
}

}  // namespace

AcceptedRows accepted(const std::vector<Json>& rows, const std::string& reason, bool with_failures) {
  if (reason.find_first_not_of(" \t\n") == std::string::npos)
    throw Error("say in --reason why these rows are right and those before them were not");
  AcceptedRows result;
  for (const RowGroup& group : latest_groups(rows))
    result.rows.insert(result.rows.end(), group.rows.begin(), group.rows.end());
  if (result.rows.empty()) throw Error("there are no rows to accept");
  result.experiment = common_at(result.rows, "/experiment", "experiment");
  if (result.experiment.empty() || result.experiment.find_first_of("/.") != std::string::npos)
    throw Error("the rows name no experiment");
  const std::string commit = common_at(result.rows, "/commit", "commit");
  for (Json& row : result.rows) {
    const Json* dirty = find(row, "/dirty");
    if (!dirty || *dirty != false || commit.empty() || commit == "unknown")
      throw Error(
          "the rows are of sources with changes that no commit has: commit them, build and run again");
    const Json* broken = find(row, "/broken");
    if (!with_failures && find(row, "/failed"))
      throw Error("a row failed, which --with-failures would accept: " + cell_name(row) + ": " +
                  text_at(row, "/failed"));
    if (!with_failures && broken && !broken->empty())
      throw Error("a row broke a promise, which --with-failures would accept: " + cell_name(row) + ": " +
                  broken->front().get<std::string>());
    row["accepted"] = {{"reason", reason}, {"date", now()}, {"commit", commit}};
  }
  return result;
}

std::filesystem::path write_baseline(const AcceptedRows& accepted, const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / accepted.experiment / "rows.jsonl";
  std::filesystem::path draft = file;
  draft += ".draft";
  std::error_code error;
  std::filesystem::create_directories(file.parent_path(), error);
  {
    std::ofstream out(draft);
    for (const Json& row : accepted.rows)
      out << row.dump(-1, ' ', false, Json::error_handler_t::replace) << '\n';
    out.close();
    if (!out) throw Error("cannot write " + draft.string());
  }
  std::filesystem::rename(draft, file, error);
  if (error) throw Error("cannot write " + file.string() + ": " + error.message());
  return file;
}

}  // namespace hermesh
