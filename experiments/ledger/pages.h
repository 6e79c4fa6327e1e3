// Numbers of the text that come from rows: pages hold markers, which are filled from the rows and checked against them.
//
//   <!--=NAME-->8.9 to 10.8<!--/-->                     the number or the table NAME of paper/numbers.toml
//   <!--=table FOLDER SUBJECT [RESOLUTION]-->…<!--/-->  the tables of results/FOLDER with that case (or table), as
//                                                       `hermesh report` writes them
//   <!--=legend FOLDER-->…<!--/-->                      what their headers mean
//   <!--=claims-->…<!--/-->                             the claims of paper/claims.toml with their verdicts
//   <!--=ablations-->…<!--/-->                          the effects of the full tiers of all ablations, with their verdicts
//   <!--=count VERDICT-->…<!--/-->                      how many claims have that verdict; without one how many there are
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "experiments/ledger/row_database.h"

namespace hermesh {

/// How a number of the text is made.
struct Number {
  std::string query;   ///< gives one number, or the two ends of a range
  std::string format;  ///< as printf's, for one floating-point value; empty for three significant digits
};

/// paper/numbers.toml.
struct NumbersFile {
  std::vector<std::filesystem::path> pages;  ///< from the project's root
  std::map<std::string, Number> numbers;
  std::map<std::string, std::string> tables;  ///< queries, whose rows and columns are those of the table
  /// Phrases of a page whose digits are no results (versions, names, exit codes), by page; "" for all pages.
  std::map<std::string, std::vector<std::string>> plain;
};

/// @throws Error "numbers.toml:12: …" for a mistake in the file.
NumbersFile read_numbers(const std::filesystem::path& path);

/// The text of a number: "8.9", or "8.9 to 10.8". @throws Error if the query gives no row, or a NULL.
std::string text_of(const Number& number, const RowDatabase& rows);

/// The rows that a query gives as a table of Markdown, its columns named as the query names them.
/// @throws Error if there are none.
std::string table_of(const std::string& query, const RowDatabase& rows);

/// The project's pages with their sources: `root` has paper/numbers.toml, paper/claims.toml and results/.
class Pages {
 public:
  /// @throws Error for a mistake in one of these files.
  explicit Pages(std::filesystem::path root);

  /// The page's text with its markers filled. @throws Error "README.md:12: …" for a marker without an end, or of an unknown
  /// name, or whose rows are missing.
  std::string filled(const std::filesystem::path& page) const;
  /// Writes all pages and the table.md of each folder of results, and results/SHA256SUMS; returns those that changed.
  std::vector<std::string> fill() const;
  /// What is wrong, a sentence each: pages and tables that differ from the rows, numbers in the text of a page that no
  /// marker explains, rows that differ from results/SHA256SUMS, inputs of rows whose hash is not the one of
  /// cases.toml, and rows of ablations whose prediction was not committed before them.
  std::vector<std::string> problems() const;

 private:
  std::string content_of(const std::string& marker) const;
  std::string sums() const;
  std::map<std::string, std::string> tables() const;

  std::filesystem::path root_;
  NumbersFile numbers_;
  RowDatabase rows_;
};

/// The numbers of a page's text that stand outside of markers, code, links, and the phrases `plain`; "line: number" each.
/// Years, and numbers of chapters, sections, tables, figures, equations and algorithms, are none.
std::vector<std::string> orphans(const std::string& text, const std::vector<std::string>& plain);

}  // namespace hermesh
