// The formats of a comparison.
#include <nlohmann/json.hpp>

#include "experiments/ledger/compare.h"

namespace hermesh {
namespace {

using TextState = CellVerdict::State;

const char* word(TextState state) {
  switch (state) {
    case TextState::kMissing:
      return "missing";
    case TextState::kNew:
      return "new";
    case TextState::kRenamed:
      return "renamed";
    case TextState::kBoth:
      break;
  }
  return "both";
}

std::size_t values(const Comparison& comparison) {
  std::size_t count = 0;
  for (const CellVerdict& cell : comparison.cells) count += cell.compared;
  return count;
}

std::size_t compared(const Comparison& comparison) {
  return comparison.count(TextState::kBoth) + comparison.count(TextState::kRenamed);
}

std::size_t improved(const Comparison& comparison) {
  std::size_t count = 0;
  for (const CellVerdict& cell : comparison.cells) count += !cell.better.empty();
  return count;
}

/// Why a cell counts as a regression, in one line; empty where it does not.
std::string reason(const Comparison& comparison, const CellVerdict& cell) {
  if (!comparison.is_regression(cell)) return {};
  std::string text;
  if (cell.state == TextState::kMissing) text = "the candidate has no row of it";
  if (cell.state == TextState::kRenamed) text = "it is called " + cell.label;
  for (const std::string& sentence : cell.regressions) text += (text.empty() ? "" : "; ") + sentence;
  return text;
}

std::string in_one_line(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences) text += (text.empty() ? "" : "; ") + sentence;
  return text;
}

std::string counted(std::size_t count, const std::string& one, const std::string& many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

std::string markdown(const Comparison& comparison) {
  std::string text = counted(compared(comparison), "cell was", "cells were") + " compared in " +
                     counted(values(comparison), "value", "values") + ": " +
                     counted(comparison.regressions(), "regression", "regressions") + ", " +
                     std::to_string(improved(comparison)) + " better, " +
                     std::to_string(comparison.count(TextState::kMissing)) + " missing, " +
                     std::to_string(comparison.count(TextState::kRenamed)) + " renamed, " +
                     std::to_string(comparison.count(TextState::kNew)) + " new.\n";
  if (values(comparison) == 0)
    text += "\nNothing was compared, which proves nothing: do the rows belong together? Cells are matched by the experiment, which "
            "is its file's name, by tier, case, resolution and variant.\n";
  const auto section = [&](const std::string& title, const std::vector<std::string>& lines) {
    if (lines.empty()) return;
    text += "\n### " + title + "\n";
    for (const std::string& line : lines) text += "- " + line + "\n";
  };
  std::vector<std::string> regressions, better, renamed, missing, added;
  for (const CellVerdict& cell : comparison.cells) {
    if (comparison.is_regression(cell))
      regressions.push_back(cell.cell + ": " + reason(comparison, cell));
    else if (cell.state == TextState::kMissing)
      missing.push_back(cell.cell);
    else if (cell.state == TextState::kRenamed)
      renamed.push_back(cell.cell + ": now " + cell.label);
    if (!cell.better.empty()) better.push_back(cell.cell + ": " + in_one_line(cell.better));
    if (cell.state == TextState::kNew) added.push_back(cell.cell);
  }
  section("Regressions", regressions);
  section("Better", better);
  section("Missing, as allowed", missing);
  section("Renamed, as allowed", renamed);
  section("New", added);
  section("Notes", comparison.notes);
  return text;
}

Json json(const Comparison& comparison) {
  Json cells = Json::array();
  for (const CellVerdict& cell : comparison.cells) {
    cells.push_back({{"cell", cell.cell},
                     {"state", word(cell.state)},
                     {"regression", comparison.is_regression(cell)},
                     {"compared", cell.compared},
                     {"regressions", cell.regressions},
                     {"better", cell.better}});
    if (cell.state == TextState::kRenamed) cells.back()["label"] = cell.label;
  }
  return {{"fine", comparison.fine()},
          {"tolerance", comparison.settings.tolerance},
          {"cells_compared", compared(comparison)},
          {"values_compared", values(comparison)},
          {"regressions", comparison.regressions()},
          {"better", improved(comparison)},
          {"missing", comparison.count(TextState::kMissing)},
          {"renamed", comparison.count(TextState::kRenamed)},
          {"new", comparison.count(TextState::kNew)},
          {"notes", comparison.notes},
          {"cells", cells}};
}

/// Text as XML has it; characters that XML 1.0 cannot hold become a question mark.
std::string xml(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '"')
      result += "&quot;";
    else
      result += static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t' ? '?' : c;
  }
  return result;
}

std::string junit(const Comparison& comparison) {
  // A comparison of nothing must not pass for one that went well.
  const bool nothing = values(comparison) == 0;
  std::string text =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites>\n<testsuite name=\"hermesh compare\" "
      "tests=\"" +
      std::to_string(comparison.cells.size() + nothing) + "\" failures=\"" +
      std::to_string(comparison.regressions() + nothing) + "\">\n";
  if (nothing)
    text +=
        "<testcase classname=\"compare\" name=\"anything\"><failure message=\"nothing was "
        "compared\"/></testcase>\n";
  for (const CellVerdict& cell : comparison.cells) {
    const std::size_t colon = cell.cell.find(": ");
    text += "<testcase classname=\"" + xml(cell.cell.substr(0, colon)) + "\" name=\"" +
            xml(colon == std::string::npos ? cell.cell : cell.cell.substr(colon + 2)) + "\">";
    if (const std::string why = reason(comparison, cell); !why.empty())
      text += "<failure message=\"" + xml(why) + "\"/>";
    else if (cell.state == TextState::kMissing)
      text += "<skipped message=\"the candidate has no row of it\"/>";
    std::string said = in_one_line(cell.better);
    if (!said.empty()) said = "better: " + said;
    if (cell.state == TextState::kNew) said = "new: the baseline has no row of it";
    if (!said.empty()) text += "<system-out>" + xml(said) + "</system-out>";
    text += "</testcase>\n";
  }
  if (!comparison.notes.empty()) text += "<system-out>" + xml(in_one_line(comparison.notes)) + "</system-out>\n";
  return text + "</testsuite>\n</testsuites>\n";
}

}  // namespace

std::string text(const Comparison& comparison, const std::string& format) {
  if (format == "json") return json(comparison).dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
  return format == "junit" ? junit(comparison) : markdown(comparison);
}

}  // namespace hermesh
