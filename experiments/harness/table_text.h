// What the tables of rows say in words, whatever they are written as: titles, facts, columns, and what nobody may
// overlook.
#pragma once

#include <string>
#include <vector>

#include "experiments/harness/table.h"

namespace hermesh {

/// The columns that the table of these rows shows: those that its first row brings along or names, else all.
std::vector<Column> shown_columns(const std::vector<Json>& rows);
/// Whether the column holds words, which start at the left, unlike numbers.
bool is_left_aligned(const Column& column);
/// The header above the labels.
std::string first_column(const Json& row);
/// Whether the rows make a table: those of some are only there to be plotted.
bool is_printed(const std::vector<Json>& rows);

/// The title of the table that a row belongs to, "dragon at resolution 400".
std::string group_title(const Json& row);
/// What a table was measured on, by which program and when; the commits of further programs that its rows are of, too.
std::vector<std::string> group_facts(const RowGroup& group);
/// Where the time goes, a line for every row of voxelizers: "hermesh: band 0.4 s (80 %), …", and what no
/// stage claims.
std::vector<std::string> stage_sentences(const RowGroup& group);

/// What nobody may overlook in a row, one sentence each, which begins with a word in capitals.
std::vector<std::string> alarms(const Json& row);
/// The sentences of all rows of a group.
std::vector<std::string> alarms(const RowGroup& group);

}  // namespace hermesh
