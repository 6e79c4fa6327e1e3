// Rows: one JSON object for every cell of an experiment's matrix, one line each in rows.jsonl.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "experiments/harness/columns.h"

namespace hermesh {

/// Sets `time_over_openvdb` in every timed row: its median time divided by that of the first row of variant
/// "openvdb", below 1 where it is faster. The rows must be of one run, one case, one resolution. Without such
/// a row, nothing.
void add_time_ratios(std::vector<Json>& rows);

/// Compares voxelizers, the other way round: sets `openvdb_over_time` (above 1 is faster) and
/// `peak_over_openvdb` in every timed row, relative to the row of variant "openvdb" with its default options.
void add_voxelizer_ratios(std::vector<Json>& rows);

/// The options of a row by name, from the text that Options::canonical() wrote; a value may have spaces.
std::map<std::string, std::string> options_in(const std::string& canonical);

/// Appends one line in a single write, so that two runs at once do not tear each other's rows.
/// @throws Error if the file cannot be written.
void append_row(const std::filesystem::path& file, const Json& row);

/// Appends the rows in a single write, so that all of them are there or none.
/// @throws Error if the file cannot be written.
void append_rows(const std::filesystem::path& file, const std::vector<Json>& rows);

/// Cuts off a last line without an end, as a program that was killed while it wrote leaves it; returns whether there was one.
/// @throws Error if the file cannot be written.
bool drop_torn_row(const std::filesystem::path& file);

/// All rows of the .jsonl files under a folder (or of the one file given), files in the order of their names.
/// @throws Error if there are none, or naming file and line of one that is no JSON object.
std::vector<Json> read_rows(const std::filesystem::path& folder);

}  // namespace hermesh
