// The columns that an experiment file may ask for: where each finds its value in a row, and how it is
// written.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

namespace hermesh {

using Json = nlohmann::ordered_json;  ///< keys stay in the order in which they were added

/// What a column shows of a row.
struct Column {
  enum class Unit {
    kNone,
    kVoxel,  ///< the row has world units, the table divides by the voxel size
    kMebibyte,
  };
  std::string name;     ///< as experiment files and the CSV's head say it
  std::string header;   ///< short, with the unit in brackets
  std::string meaning;  ///< for the legend
  std::string pointer;  ///< JSON pointer (RFC 6901) of the value in a row
  Unit unit = Unit::kNone;
};

/// In the order of the CSV report.
std::span<const Column> all_columns();
std::vector<std::string> column_names();

/// The columns that a row of a measurement brings along (measurements.h), none for other rows.
std::vector<Column> own_columns(const Json& row);

/// What a JSON pointer leads to; null where that is nothing, or JSON's null.
const Json* find(const Json& row, const std::string& pointer);
/// 0 where there is no number.
double number_at(const Json& row, const std::string& pointer);
/// A text as it is, anything else as JSON; empty where there is nothing.
std::string text_at(const Json& row, const std::string& pointer);

/// The column's value in its unit; JSON's null where the row has none.
Json value_of(const Column& column, const Json& row);
/// The text of that for a reader, "–" where the row has none.
std::string cell_text(const Column& column, const Json& row);

/// 1234567 → "1,234,567"; numbers that are not whole with three significant digits.
std::string readable(double value);

}  // namespace hermesh
