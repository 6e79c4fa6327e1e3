#include "experiments/page/page_data.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "experiments/harness/table_text.h"
#include "experiments/page/page_figures.h"

namespace hermesh {
namespace {

Json cell_json(const Column& column, const Json& row) {
  const Json value = value_of(column, row);
  if (value.is_number()) return {cell_text(column, row), value};
  return value.is_null() ? Json(nullptr) : Json(value.is_string() ? value.get<std::string>() : value.dump());
}

Json columns_json(const std::vector<Column>& columns) {
  Json list = Json::array();
  for (const Column& column : columns)
    list.push_back({{"header", column.header},
                    {"meaning", column.meaning},
                    {"pointer", column.pointer},
                    {"left", is_left_aligned(column)}});
  return list;
}

Json table_json(const RowGroup& group) {
  const Json& first = group.rows.front();
  const std::vector<Column> columns = shown_columns(group.rows);
  Json table = {{"experiment", text_at(first, "/experiment")},
                {"tier", text_at(first, "/tier")},
                {"question", text_at(first, "/question")},
                {"title", group_title(first)},
                {"case", text_at(first, "/case/name")},
                {"resolution", text_at(first, "/resolution")},
                {"facts", group_facts(group)},
                {"sentences", stage_sentences(group)},
                {"earlier", group.earlier_runs},
                {"first_column", first_column(first)},
                {"columns", columns_json(columns)},
                {"rows", Json::array()}};
  for (const Json& row : group.rows) {
    Json cells = Json::array();
    for (const Column& column : columns) cells.push_back(cell_json(column, row));
    table["rows"].push_back({{"row", page_row(row)},
                             {"label", text_at(row, "/variant/label")},
                             {"variant", text_at(row, "/variant/name")},
                             {"cells", std::move(cells)},
                             {"trouble", alarms(row)}});
  }
  return table;
}

/// A table's rows of all runs.
struct History {
  std::vector<Json> rows;
  std::set<std::string> runs;
};

/// What makes rows of two runs the same cell of a table, besides their places among the rows that agree in
/// all of this.
std::string cell_key(const Json& row) {
  std::string key;
  for (const char* part :
       {"/variant/label", "/sweep/value", "/nominal_voxel_size", "/values/resolution", "/values/threads"})
    key += text_at(row, part) + "\n";
  return key;
}

std::string cell_label(const Json& row, int place) {
  std::string label = text_at(row, "/variant/label");
  if (find(row, "/sweep"))
    label += ", " + text_at(row, "/sweep/parameter") + " " + text_at(row, "/sweep/value");
  if (find(row, "/nominal_voxel_size")) label += ", voxel " + text_at(row, "/nominal_voxel_size");
  if (find(row, "/values/resolution")) label += ", resolution " + text_at(row, "/values/resolution");
  if (find(row, "/values/threads")) label += ", threads " + text_at(row, "/values/threads");
  return place == 0 ? label : label + " (" + std::to_string(place + 1) + ")";
}

/// Null if no cell has rows of two runs.
Json history_json(const History& history) {
  std::vector<std::pair<std::string, const Json*>> runs;  // by date, and by name where that is one
  for (const Json& row : history.rows)
    if (std::ranges::find(runs, text_at(row, "/run"),
                          [](const auto& run) { return text_at(*run.second, "/run"); }) == runs.end())
      runs.emplace_back(text_at(row, "/date"), &row);
  std::ranges::stable_sort(runs, {}, &std::pair<std::string, const Json*>::first);

  const std::vector<Column> columns = shown_columns({history.rows.back()});
  const Json& last = history.rows.back();
  Json result = {{"title", group_title(last)},
                 {"experiment", text_at(last, "/experiment")},
                 {"tier", text_at(last, "/tier")},
                 {"case", text_at(last, "/case/name")},
                 {"resolution", text_at(last, "/resolution")},
                 {"columns", columns_json(columns)},
                 {"runs", Json::array()},
                 {"series", Json::array()}};
  std::map<std::string, std::map<std::string, Json>> cells;
  std::vector<std::string> order;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const Json& row = *runs[i].second;
    const std::string run = text_at(row, "/run");
    const Json* dirty = find(row, "/dirty");
    result["runs"].push_back({{"run", run},
                              {"date", text_at(row, "/date")},
                              {"commit", text_at(row, "/commit")},
                              {"dirty", dirty && *dirty == true},
                              {"cpu", text_at(row, "/machine/cpu")}});
    std::map<std::string, int> places;
    for (const Json& own : history.rows) {
      if (text_at(own, "/run") != run) continue;
      const int place = places[cell_key(own)]++;
      const std::string label = cell_label(own, place);
      Json numbers = Json::array();
      for (const Column& column : columns) {
        const Json value = value_of(column, own);
        numbers.push_back(value.is_number() ? value : Json(nullptr));
      }
      if (!cells.contains(label)) order.push_back(label);
      Json& points = cells[label]["points"];
      points.push_back({{"row", page_row(own)}, {"run", i}, {"cells", std::move(numbers)}});
    }
  }
  for (const std::string& label : order)
    if (cells[label]["points"].size() > 1)
      result["series"].push_back(
          {{"label", label}, {"style", result["series"].size()}, {"points", cells[label]["points"]}});
  return result["series"].empty() ? Json(nullptr) : result;
}

Json histories_of(const std::vector<Json>& rows) {
  std::vector<std::string> order;
  std::map<std::string, History> histories;
  for (const Json& row : rows) {
    std::string key;
    for (const char* part :
         {"/experiment", "/tier", "/case/name", "/resolution", "/voxelization/label", "/sweep/parameter"})
      key += text_at(row, part) + "\n";
    if (!histories.contains(key)) order.push_back(key);
    histories[key].rows.push_back(row);
    histories[key].runs.insert(text_at(row, "/run"));
  }
  Json list = Json::array();
  for (const std::string& key : order) {
    if (histories[key].runs.size() < 2) continue;
    if (Json history = history_json(histories[key]); !history.is_null()) list.push_back(std::move(history));
  }
  return list;
}

}  // namespace

Json page_data(const std::vector<Json>& rows) {
  std::vector<Json> numbered = rows;
  for (std::size_t i = 0; i < numbered.size(); ++i) numbered[i][kPageRow] = i;
  Json data = {{"rows", rows},
               {"tables", Json::array()},
               {"figures", figures_of(numbered)},
               {"histories", histories_of(numbered)}};
  for (const RowGroup& group : latest_groups(numbered))
    if (is_printed(group.rows)) data["tables"].push_back(table_json(group));
  return data;
}

}  // namespace hermesh
