#include "experiments/harness/table_text.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

namespace hermesh {
namespace {

/// Which of the table's cells a row is, where a table has several.
std::string cell_text_of(const Json& row) {
  if (find(row, "/sweep"))
    return " at " + text_at(row, "/sweep/parameter") + " " + text_at(row, "/sweep/value");
  return find(row, "/nominal_voxel_size") ? " at voxel " + text_at(row, "/nominal_voxel_size") : "";
}

/// The program that made the first row, and when; a long experiment is made in pieces, so that other rows may be of others.
std::string run_fact(const RowGroup& group) {
  const Json& row = group.rows.front();
  const std::string commit = text_at(row, "/commit");
  std::string run = "run: commit " + commit.substr(0, 12);
  if (const Json* dirty = find(row, "/dirty"); dirty && *dirty == true) run += " with changes";
  run += ", " + text_at(row, "/date") + ", " + text_at(row, "/machine/cpu") + ", " +
         text_at(row, "/threads") + " threads";
  if (const Json* load = find(row, "/load")) run += ", load " + readable(load->at(0).get<double>());
  std::map<std::string, int> others;
  for (const Json& other : group.rows) ++others[text_at(other, "/commit")];
  others.erase(commit);
  for (const auto& [of, rows] : others) run += "; " + std::to_string(rows) + " rows of commit " + of.substr(0, 12);
  return run;
}

std::vector<std::string> joined_list(const Json& row, const std::string& pointer) {
  std::vector<std::string> items;
  if (const Json* list = find(row, pointer))
    for (const Json& item : *list) items.push_back(item.get<std::string>());
  return items;
}

}  // namespace

std::vector<Column> shown_columns(const std::vector<Json>& rows) {
  if (rows.empty()) return {};
  if (find(rows.front(), "/measurement")) return own_columns(rows.front());
  const Json* names = find(rows.front(), "/columns");
  if (!names) return {all_columns().begin(), all_columns().end()};
  std::vector<Column> shown;
  for (const Json& name : *names)
    for (const Column& column : all_columns())
      if (name == column.name) shown.push_back(column);
  return shown;
}

bool is_printed(const std::vector<Json>& rows) {
  return !rows.empty() && text_at(rows.front(), "/table/printed") != "false";
}

bool is_left_aligned(const Column& column) {
  return column.name == "promises" || column.name == "options" || column.name == "fingerprint";
}

std::string group_title(const Json& row) {
  std::string title = text_at(row, "/case/name");
  if (find(row, "/measurement"))
    return find(row, "/table/title") ? title + ": " + text_at(row, "/table/title") : title;
  if (find(row, "/sweep")) title += " by " + text_at(row, "/sweep/parameter");
  if (find(row, "/resolution")) return title + " at resolution " + text_at(row, "/resolution");
  return title + (find(row, "/sweep") ? " at voxel size " + text_at(row, "/nominal_voxel_size")
                                      : " at several voxel sizes");
}

std::string first_column(const Json& row) {
  return find(row, "/table/first_column") ? text_at(row, "/table/first_column") : "variant";
}

std::vector<std::string> group_facts(const RowGroup& group) {
  const Json& row = group.rows.front();
  if (find(row, "/measurement"))
    return {
        "measured: " + text_at(row, "/measurement/parameters") + " seed=" + text_at(row, "/measurement/seed"),
        run_fact(group)};
  std::string input = "input: " + text_at(row, "/case/origin") + ", sha256 " +
                      text_at(row, "/case/sha256").substr(0, 12) + ", " +
                      readable(number_at(row, "/case/triangles")) + " triangles";
  if (text_at(row, "/case/origin").starts_with("stand-in"))
    input = "STAND-IN DATA, not the original; " + input;
  std::string grid = "grid: ";
  if (find(row, "/band"))
    grid += "band " + readable(number_at(row, "/band/exterior")) + " voxels outside and " +
            readable(number_at(row, "/band/interior")) + " inside";
  else
    grid += "voxelizer " + text_at(row, "/voxelization/label");
  if (find(row, "/resolution")) grid += ", voxel " + readable(number_at(row, "/voxel_size"));
  if (!find(row, "/band") && find(row, "/voxelization/active_voxels"))
    grid += ", " + readable(number_at(row, "/voxelization/active_voxels")) + " active voxels, " +
            readable(number_at(row, "/voxelization/memory_bytes") / (1 << 20)) + " MiB, made in " +
            readable(number_at(row, "/voxelization/seconds/median")) + " s";
  std::vector<std::string> facts = {input, grid, run_fact(group)};
  if (find(row, "/judged_by"))
    facts.push_back("signs: judged by the " + text_at(row, "/judged_by/signs") + " of " +
                    text_at(row, "/judged_by/solid"));
  return facts;
}

std::vector<std::string> stage_sentences(const RowGroup& group) {
  std::vector<std::string> sentences;
  for (const Json& row : group.rows) {
    const Json* stages = find(row, "/stage_seconds");
    const double total = number_at(row, "/seconds/median");
    if (!find(row, "/band") || find(row, "/sweep") || !stages || stages->size() < 2 || total <= 0.0) continue;
    std::string text;
    double claimed = 0.0;
    const auto part = [&](const std::string& name, double seconds) {
      text += (text.empty() ? "" : ", ") + name + " " + readable(seconds) + " s (" +
              readable(std::round(100.0 * seconds / total)) + " %)";
    };
    for (const auto& [name, seconds] : stages->items()) {
      part(name, seconds.get<double>());
      claimed += seconds.get<double>();
    }
    if (total - claimed > 0.02 * total) part("rest", total - claimed);
    sentences.push_back("time of " + text_at(row, "/variant/label") + cell_text_of(row) + ": " + text);
  }
  return sentences;
}

std::vector<std::string> alarms(const Json& row) {
  std::vector<std::string> sentences;
  const std::string who =
      text_at(row, "/variant/label") + " on " + group_title(row) + cell_text_of(row) + ": ";
  if (find(row, "/absent"))
    sentences.push_back("NOTE: " + who + text_at(row, "/failed"));
  else if (find(row, "/failed"))
    sentences.push_back("FAILED: " + who + text_at(row, "/failed"));
  for (const std::string& broken : joined_list(row, "/broken"))
    sentences.push_back("BROKEN: " + who + broken);
  for (const std::string& unchecked : joined_list(row, "/unchecked"))
    sentences.push_back("UNCHECKED: " + who + "the promise of " + unchecked);
  for (const std::string& disagreement : joined_list(row, "/disagreements"))
    sentences.push_back("DISAGREEMENT of the judges: " + who + disagreement);
  if (const Json* differ = find(row, "/repetitions_differ"); differ && *differ == true)
    sentences.push_back("NOT DETERMINISTIC: " + who + "repetitions gave different " +
                        (find(row, "/band") ? "level sets" : "meshes"));
  if (find(row, "/not_judged")) sentences.push_back("NOT JUDGED: " + who + text_at(row, "/not_judged"));
  return sentences;
}

std::vector<std::string> alarms(const RowGroup& group) {
  std::vector<std::string> sentences;
  for (const Json& row : group.rows)
    for (std::string& sentence : alarms(row)) sentences.push_back(std::move(sentence));
  return sentences;
}

}  // namespace hermesh
