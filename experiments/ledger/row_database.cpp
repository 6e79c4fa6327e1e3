#include "experiments/ledger/row_database.h"

#include <sqlite3.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <set>

#include "algorithms/core/error.h"
#include "experiments/harness/measure.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/table.h"

namespace hermesh {
namespace {

/// Where the columns that every table has find their values.
const std::vector<std::pair<std::string, std::string>>& common_columns() {
  static const std::vector<std::pair<std::string, std::string>> columns = {
      {"experiment", "/experiment"}, {"tier", "/tier"},
      {"run", "/run"},               {"made_at", "/commit"},
      {"dirty", "/dirty"},           {"date", "/date"},
      {"cpu", "/machine/cpu"},       {"cores", "/machine/cores"},
      {"threads", "/threads"},       {"subject", "/case/name"},
      {"resolution", "/resolution"}, {"label", "/variant/label"},
      {"method", "/variant/name"},   {"options", "/variant/options"},
      {"voxelizer", "/voxelization/label"}, {"input", "/case/sha256"},
      {"input_triangles", "/case/triangles"}, {"failed", "/failed"}};
  return columns;
}

std::string quoted(const std::string& name) {
  std::string text = "\"";
  for (const char c : name) text += c == '"' ? std::string("\"\"") : std::string(1, c);
  return text + "\"";
}

/// A statement that is ready to be stepped through.
class Statement {
 public:
  Statement(sqlite3* connection, const std::string& text) : connection_(connection) {
    const char* rest = nullptr;
    if (sqlite3_prepare_v2(connection, text.c_str(), -1, &statement_, &rest) != SQLITE_OK) fail(text);
    if (!statement_) throw Error("an empty query");
    while (*rest != '\0' && (std::isspace(static_cast<unsigned char>(*rest)) != 0 || *rest == ';')) ++rest;
    if (*rest != '\0') {
      sqlite3_finalize(statement_);
      throw Error("more than one statement in: " + text);
    }
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void bind(int at, const Json& value) {
    if (value.is_boolean())
      sqlite3_bind_int64(statement_, at, value.get<bool>() ? 1 : 0);
    else if (value.is_number_integer())
      sqlite3_bind_int64(statement_, at, value.get<std::int64_t>());
    else if (value.is_number())
      sqlite3_bind_double(statement_, at, value.get<double>());
    else if (value.is_null())
      sqlite3_bind_null(statement_, at);
    else {
      const std::string text =
          value.is_string() ? value.get<std::string>() : value.dump(-1, ' ', false, Json::error_handler_t::replace);
      sqlite3_bind_text(statement_, at, text.c_str(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
    }
  }
  void bind(const std::map<std::string, Json>& values) {
    for (const auto& [name, value] : values)
      if (const int at = sqlite3_bind_parameter_index(statement_, (":" + name).c_str())) bind(at, value);
  }
  /// Whether there is one more row.
  bool step() {
    const int code = sqlite3_step(statement_);
    if (code != SQLITE_ROW && code != SQLITE_DONE) fail(sqlite3_sql(statement_));
    return code == SQLITE_ROW;
  }
  void reset() { sqlite3_reset(statement_); }
  int columns() const { return sqlite3_column_count(statement_); }
  std::string name(int column) const { return sqlite3_column_name(statement_, column); }
  Json value(int column) const {
    switch (sqlite3_column_type(statement_, column)) {
      case SQLITE_INTEGER: return sqlite3_column_int64(statement_, column);
      case SQLITE_FLOAT: return sqlite3_column_double(statement_, column);
      case SQLITE_NULL: return nullptr;
      default: return reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    }
  }

 private:
  [[noreturn]] void fail(const std::string& text) const {
    throw Error(std::string(sqlite3_errmsg(connection_)) + " in: " + text);
  }
  sqlite3* connection_;
  sqlite3_stmt* statement_ = nullptr;
};

/// median(): the numbers so far are kept in a vector that the aggregate's memory points to.
void median_step(sqlite3_context* context, int, sqlite3_value** arguments) {
  auto** const numbers =
      static_cast<std::vector<double>**>(sqlite3_aggregate_context(context, sizeof(std::vector<double>*)));
  if (!numbers || sqlite3_value_type(arguments[0]) == SQLITE_NULL) return;
  if (!*numbers) *numbers = new std::vector<double>;
  (*numbers)->push_back(sqlite3_value_double(arguments[0]));
}
void median_final(sqlite3_context* context) {
  auto** const numbers = static_cast<std::vector<double>**>(sqlite3_aggregate_context(context, 0));
  if (!numbers || !*numbers) return sqlite3_result_null(context);
  sqlite3_result_double(context, median(**numbers));
  delete *numbers;
}

/// What a table has to hold: the common columns, those of reports that some row has, and the rows' own.
std::vector<std::string> names_of_columns(const std::vector<Json>& rows) {
  std::vector<std::string> names;
  // SQL does not tell capitals from small letters.
  const auto add = [&](const std::string& name) {
    const auto same = [&](const std::string& other) { return sqlite3_stricmp(name.c_str(), other.c_str()) == 0; };
    if (std::ranges::none_of(names, same)) names.push_back(name);
  };
  for (const auto& [name, pointer] : common_columns()) add(name);
  for (const char* name : {"stand_in", "broken", "row"}) add(name);
  for (const Column& column : all_columns())
    if (std::ranges::any_of(rows, [&](const Json& row) { return find(row, column.pointer) != nullptr; })) add(column.name);
  for (const Json& row : rows)
    for (const Column& column : own_columns(row)) add(column.name);
  return names;
}

bool is_stand_in(const Json& row) {
  if (text_at(row, "/case/origin").starts_with("stand-in")) return true;
  const Json* const inputs = find(row, "/inputs");
  return inputs && std::ranges::any_of(*inputs, [](const Json& input) {
           return input.value("origin", "").starts_with("stand-in");
         });
}

/// The value of the column `name`; `own` are the columns that the row brings along.
Json value_in(const Json& row, const std::vector<Column>& own, const std::string& name) {
  for (const Column& column : own)
    if (sqlite3_stricmp(column.name.c_str(), name.c_str()) == 0)
      if (Json value = value_of(column, row); !value.is_null()) return value;
  if (name == "row") return row.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (name == "stand_in") return is_stand_in(row) ? 1 : 0;
  if (name == "broken") return row.contains("broken") ? Json(row.at("broken").size()) : Json(0);
  for (const auto& [common, pointer] : common_columns())
    if (common == name)
      if (const Json* value = find(row, pointer)) return *value;
  for (const Column& column : all_columns())
    if (column.name == name) return value_of(column, row);
  return nullptr;
}

}  // namespace

void RowDatabase::Close::operator()(sqlite3* connection) const { sqlite3_close_v2(connection); }

RowDatabase::RowDatabase() {
  sqlite3* connection = nullptr;
  const int code = sqlite3_open_v2(":memory:", &connection, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, nullptr);
  connection_.reset(connection);
  if (code != SQLITE_OK) throw Error("cannot make a database in memory");
  // A name that is no column must not pass for a text.
  sqlite3_db_config(connection, SQLITE_DBCONFIG_DQS_DML, 0, nullptr);
  sqlite3_create_function_v2(connection, "median", 1, SQLITE_UTF8 | SQLITE_DETERMINISTIC, nullptr, nullptr, median_step,
                             median_final, nullptr);
}

RowDatabase::~RowDatabase() = default;

void RowDatabase::add(const std::string& name, const std::vector<Json>& rows) {
  if (std::ranges::find(tables_, name) != tables_.end()) throw Error("there is a table " + name + " already");
  std::vector<Json> shown;
  for (const RowGroup& group : latest_groups(rows)) shown.insert(shown.end(), group.rows.begin(), group.rows.end());
  const std::vector<std::string> names = names_of_columns(shown);
  std::string columns, marks;
  for (const std::string& column : names) {
    columns += (columns.empty() ? "" : ", ") + quoted(column);
    marks += marks.empty() ? "?" : ", ?";
  }
  Statement(connection_.get(), "CREATE TABLE " + quoted(name) + " (" + columns + ")").step();
  Statement insert(connection_.get(), "INSERT INTO " + quoted(name) + " VALUES (" + marks + ")");
  for (const Json& row : shown) {
    const std::vector<Column> own = own_columns(row);
    for (std::size_t i = 0; i < names.size(); ++i) insert.bind(static_cast<int>(i) + 1, value_in(row, own, names[i]));
    insert.step();
    insert.reset();
  }
  tables_.push_back(name);
}

void RowDatabase::add_folders(const std::filesystem::path& results) {
  std::error_code error;
  std::set<std::filesystem::path> folders;
  for (const auto& entry : std::filesystem::directory_iterator(results, error))
    if (entry.is_directory() && entry.path().filename() != "local" && exists(entry.path() / "rows.jsonl"))
      folders.insert(entry.path());
  if (error) throw Error("cannot read the folder " + results.string() + ": " + error.message());
  Statement(connection_.get(), "BEGIN").step();
  for (const auto& folder : folders) add(folder.filename().string(), read_rows(folder / "rows.jsonl"));
  Statement(connection_.get(), "COMMIT").step();
}

std::vector<RowDatabase::Row> RowDatabase::rows(const std::string& query, std::size_t most,
                                                const std::map<std::string, Json>& bound) const {
  Statement statement(connection_.get(), query);
  statement.bind(bound);
  std::vector<Row> result;
  while (result.size() < most && statement.step()) {
    result.emplace_back();
    for (int column = 0; column < statement.columns(); ++column)
      result.back().emplace_back(statement.name(column), statement.value(column));
  }
  return result;
}

RowDatabase::Row RowDatabase::first_row(const std::string& query, const std::map<std::string, Json>& bound) const {
  std::vector<Row> found = rows(query, 1, bound);
  return found.empty() ? Row() : std::move(found[0]);
}

int RowDatabase::execute(const std::string& text) {
  Statement statement(connection_.get(), text);
  while (statement.step()) {
  }
  return sqlite3_changes(connection_.get());
}

std::vector<std::string> RowDatabase::tables_in(const std::string& query) const {
  std::set<std::string> found;
  std::string word;
  for (const char c : query + " ") {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_') {
      word += c;
      continue;
    }
    if (std::ranges::find(tables_, word) != tables_.end()) found.insert(word);
    word.clear();
  }
  return {found.begin(), found.end()};
}

}  // namespace hermesh
