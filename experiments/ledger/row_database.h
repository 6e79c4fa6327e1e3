// Rows as tables of SQL, so that a claim or a number of the text is a query that anybody can read and repeat.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "experiments/harness/columns.h"

struct sqlite3;

namespace hermesh {

/// A database in memory (SQLite). Each folder of rows is a table of its name, and of the rows of a folder those that
/// `hermesh report` shows: of cells that ran several times the last run. Its columns:
///   - experiment, tier, run, made_at (the commit), dirty, date, cpu, cores, threads;
///   - subject (the case, or of a measurement its table), resolution, label, method (name of the variant), options,
///     voxelizer, input (SHA-256 of the case), input_triangles, stand_in (1 for a case that is one), failed, broken (how many promises);
///   - the columns of reports under their names and in their units (columns.h), and those that measurements bring along.
///     Where a measurement has a column of one of the names above, that is it;
///   - row: all of it as JSON.
/// A value that a row lacks is NULL, true is 1. Besides SQLite's functions there is the aggregate median().
class RowDatabase {
 public:
  RowDatabase();
  ~RowDatabase();
  RowDatabase(const RowDatabase&) = delete;
  RowDatabase& operator=(const RowDatabase&) = delete;

  /// Adds the table `name` of `rows`. @throws Error if there is one of that name.
  void add(const std::string& name, const std::vector<Json>& rows);
  /// Adds each folder right below `results` that has rows, except "local". @throws Error naming a file that cannot be read.
  void add_folders(const std::filesystem::path& results);

  using Row = std::vector<std::pair<std::string, Json>>;
  /// All rows that the query gives, at most `most`, each with its columns in their order. @throws Error as first_row().
  std::vector<Row> rows(const std::string& query, std::size_t most, const std::map<std::string, Json>& bound = {}) const;
  /// The columns of the first row that the query gives, in their order; empty if it gives none. `bound` are the values of
  /// the query's parameters such as :printed. @throws Error with SQLite's sentence.
  Row first_row(const std::string& query, const std::map<std::string, Json>& bound = {}) const;
  /// Runs what changes rows, and returns how many rows it changed. @throws Error.
  int execute(const std::string& statement);
  /// The names of all tables.
  const std::vector<std::string>& tables() const { return tables_; }
  /// The names of the tables that occur in a query, sorted.
  std::vector<std::string> tables_in(const std::string& query) const;

 private:
  struct Close {
    void operator()(sqlite3* connection) const;
  };
  std::unique_ptr<sqlite3, Close> connection_;
  std::vector<std::string> tables_;
};

}  // namespace hermesh
