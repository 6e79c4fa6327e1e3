#include "experiments/ledger/pages.h"

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "algorithms/core/error.h"
#include "experiments/ablations/effect_report.h"
#include "experiments/ablations/prediction.h"
#include "experiments/cases/case_file.h"
#include "experiments/harness/harness.h"
#include "experiments/harness/rows.h"
#include "experiments/harness/sha256.h"
#include "experiments/harness/table.h"
#include "experiments/harness/toml_section.h"
#include "experiments/ledger/claims.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBegin = "<!--=", kClose = "-->", kEnd = "<!--/-->";

std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw Error("cannot read " + path.string());
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write_page(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  if (!(file << text << std::flush)) throw Error("cannot write " + path.string());
}

std::size_t line_of(const std::string& text, std::size_t at) {
  return 1 + static_cast<std::size_t>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

/// A marker of a page: what it names, and the bytes that it encloses.
struct Marker {
  std::string name;
  std::size_t begin, end;  ///< of the content
};

/// @throws Error for a marker that does not end before the next one begins.
std::vector<Marker> markers_of(const std::string& text, const std::string& page) {
  std::vector<Marker> markers;
  for (std::size_t at = text.find(kBegin); at != std::string::npos; at = text.find(kBegin, at)) {
    const std::size_t close = text.find(kClose, at), content = close + kClose.size(), end = text.find(kEnd, at);
    if (close == std::string::npos || end == std::string::npos || end < content || text.find(kBegin, at + 1) < end)
      throw Error(page + ":" + std::to_string(line_of(text, at)) + ": this marker has no end " + std::string(kEnd));
    markers.push_back({text.substr(at + kBegin.size(), close - at - kBegin.size()), content, end});
    at = end;
  }
  return markers;
}

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

/// "%.2f" and the like, and nothing else that printf knows.
bool is_format(const std::string& format) {
  const std::size_t percent = format.find('%');
  if (percent == std::string::npos || format.find('%', percent + 1) != std::string::npos) return false;
  const std::size_t last = format.find_first_not_of("0123456789.+", percent + 1);
  return last != std::string::npos && (format[last] == 'f' || format[last] == 'g' || format[last] == 'e');
}

std::string formatted(const Json& value, const std::string& format) {
  if (value.is_string()) return value.get<std::string>();
  if (format.empty()) return readable(value.get<double>());
  std::array<char, 128> text{};
  // is_format() has seen to it that the format takes one double.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
  std::snprintf(text.data(), text.size(), format.c_str(), value.get<double>());
#pragma GCC diagnostic pop
  return text.data();
}

std::string markdown_of(const std::vector<RowGroup>& groups) {
  std::ostringstream out;
  for (const RowGroup& group : groups) write_markdown(group, out);
  std::string text = out.str();
  // Headings belong to a report of their own; within a page a table's title is a line.
  for (std::size_t at = text.find("### "); at != std::string::npos; at = text.find("### ", at)) {
    const std::size_t end = text.find('\n', at);
    text = text.substr(0, at) + "**" + text.substr(at + 4, end - at - 4) + "**" + text.substr(end);
  }
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

std::vector<Json> rows_of(const fs::path& results, const std::string& folder) {
  if (!fs::exists(results / folder / "rows.jsonl")) throw Error("there is no results/" + folder + "/rows.jsonl");
  return read_rows(results / folder / "rows.jsonl");
}

/// Whether what stands before a number says that it counts places of a text: "table 9.2", "§5.2", "figures 9.8 to".
bool names_a_place(const std::string& text, std::size_t at) {
  static const std::set<std::string> places = {"chapter", "chapters", "section", "sections", "table", "tables", "figure",
                                               "figures", "fig.", "figs", "eq.", "eqs", "equation", "equations",
                                               "algorithm", "algorithms", "trap", "step", "steps", "Table", "Figure", "Chapter"};
  if (at >= 2 && text.compare(at - 2, 2, "§") == 0) return true;
  std::vector<std::string> words = words_of(text.substr(at > 40 ? at - 40 : 0, std::min<std::size_t>(at, 40)));
  // "tables 9.1 to 9.4", "figures 9.4, 9.5 and 9.6": the word stands before the first of several.
  while (!words.empty()) {
    if (places.contains(words.back())) return true;
    const std::string& last = words.back();
    const bool between = last == "to" || last == "and" || last == "or" || last == "–" ||
                         (std::isdigit(static_cast<unsigned char>(last[0])) != 0 && last.find_first_not_of("0123456789.,") == std::string::npos);
    if (!between) return false;
    words.pop_back();
  }
  return false;
}

bool is_year(const std::string& number) {
  return number.size() == 4 && number.find_first_not_of("0123456789") == std::string::npos &&
         (number.starts_with("19") || number.starts_with("20"));
}

/// The text with everything between `open` and `close` made blank; line breaks stay.
void blank(std::string& text, std::string_view open, std::string_view close) {
  for (std::size_t at = text.find(open); at != std::string::npos; at = text.find(open, at)) {
    std::size_t end = text.find(close, at + open.size());
    end = end == std::string::npos ? text.size() : end + close.size();
    for (; at < end; ++at)
      if (text[at] != '\n') text[at] = ' ';
  }
}

void blank_phrase(std::string& text, const std::string& phrase) {
  for (std::size_t at = text.find(phrase); at != std::string::npos; at = text.find(phrase, at))
    for (const std::size_t end = at + phrase.size(); at < end; ++at)
      if (text[at] != '\n') text[at] = ' ';
}

}  // namespace

std::vector<std::string> orphans(const std::string& page, const std::vector<std::string>& plain) {
  std::string text = page;
  for (const Marker& marker : markers_of(text, "page"))
    for (std::size_t at = marker.begin; at < marker.end; ++at)
      if (text[at] != '\n') text[at] = ' ';
  blank(text, "<!--", "-->");
  blank(text, "```", "```");
  blank(text, "`", "`");
  blank(text, "](", ")");
  for (const std::string& phrase : plain) blank_phrase(text, phrase);
  std::vector<std::string> found;
  const auto is_digit = [&](std::size_t i) { return i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])) != 0; };
  for (std::size_t at = 0; at < text.size();) {
    if (!is_digit(at)) {
      ++at;
      continue;
    }
    std::size_t end = at;
    while (is_digit(end) || ((text[end] == '.' || text[end] == ',') && is_digit(end + 1))) ++end;
    const std::string number = text.substr(at, end - at);
    // Digits in a name, such as x86-64 or C++20, are none.
    const bool in_name = at > 0 && (std::isalpha(static_cast<unsigned char>(text[at - 1])) != 0 || text[at - 1] == '+' ||
                                    (text[at - 1] == '-' && at > 1 && text[at - 2] != ' '));
    if (!in_name && !is_year(number) && !names_a_place(text, at))
      found.push_back(std::to_string(line_of(text, at)) + ": " + number);
    at = end;
  }
  return found;
}

NumbersFile read_numbers(const fs::path& path) {
  const std::string file = path.filename().string();
  const toml::table document = parse_toml(path);
  const Section section(file, document, "the file", {"pages", "numbers", "tables", "plain"});
  NumbersFile result;
  for (const toml::node& node : section.list("pages"))
    if (const auto* page = node.as_string()) result.pages.emplace_back(page->get());
  if (const toml::table* numbers = section.optional_table("numbers"))
    for (const auto& [key, node] : *numbers) {
      Number number;
      if (const auto* query = node.as_string()) {
        number.query = query->get();
      } else {
        const Section entry(file, section.table(node, "a number"), "the number", {"query", "format"});
        number = {entry.text("query"), entry.text_or("format", "")};
        if (!number.format.empty() && !is_format(number.format))
          entry.fail_at("format", "\"format\" must hold one of printf's %f, %g or %e");
      }
      result.numbers[std::string(key.str())] = number;
    }
  if (const toml::table* tables = section.optional_table("tables"))
    for (const auto& [key, node] : *tables) {
      const auto* query = node.as_string();
      if (!query) section.fail(node.source().begin.line, "a query should stand here");
      result.tables[std::string(key.str())] = query->get();
    }
  if (const toml::table* plain = section.optional_table("plain"))
    for (const auto& [key, node] : *plain) {
      const toml::array* const list = node.as_array();
      if (!list) section.fail(node.source().begin.line, "a list of phrases should stand here");
      const std::string page = key.str() == "all" ? "" : std::string(key.str());
      for (const toml::node& phrase : *list)
        if (const auto* text = phrase.as_string()) result.plain[page].push_back(text->get());
    }
  return result;
}

std::string text_of(const Number& number, const RowDatabase& rows) {
  const auto row = rows.first_row(number.query);
  if (row.empty()) throw Error("there is no row for: " + number.query);
  std::string text;
  for (const auto& [column, value] : row) {
    if (value.is_null()) throw Error("the rows give no " + column + " for: " + number.query);
    const std::string part = formatted(value, number.format);
    if (!text.empty() && part == text) continue;  // both ends of a range are alike
    text += (text.empty() ? "" : " to ") + part;
  }
  return text;
}

std::string table_of(const std::string& query, const RowDatabase& rows) {
  constexpr std::size_t kMost = 1000;  // more is no table for a page
  const std::vector<RowDatabase::Row> found = rows.rows(query, kMost);
  if (found.empty()) throw Error("there is no row for: " + query);
  std::string text, rule;
  for (const auto& [column, value] : found[0]) {
    text += "| " + column + " ";
    rule += value.is_number() ? "| --: " : "| --- ";
  }
  text = "\n" + text + "|\n" + rule + "|\n";
  for (const RowDatabase::Row& row : found) {
    for (const auto& [column, value] : row) text += "| " + (value.is_null() ? "–" : formatted(value, "")) + " ";
    text += "|\n";
  }
  return text;
}

Pages::Pages(fs::path root) : root_(std::move(root)), numbers_(read_numbers(root_ / "paper" / "numbers.toml")) {
  rows_.add_folders(root_ / "results");
}

std::string Pages::content_of(const std::string& marker) const {
  const std::vector<std::string> words = words_of(marker);
  const std::string kind = words.empty() ? "" : words[0];
  if (kind == "table" && (words.size() == 3 || words.size() == 4)) {
    std::vector<RowGroup> chosen;
    for (RowGroup& group : latest_groups(rows_of(root_ / "results", words[1]))) {
      const Json& first = group.rows.front();
      if (text_at(first, "/case/name") == words[2] && (words.size() == 3 || text_at(first, "/resolution") == words[3]))
        chosen.push_back(std::move(group));
    }
    if (chosen.empty()) throw Error("there is no such table");
    return "\n" + markdown_of(chosen) + "\n";
  }
  if (kind == "legend" && words.size() == 2) {
    std::ostringstream out;
    write_legend(rows_of(root_ / "results", words[1]), out);
    std::string text = out.str();
    while (text.ends_with('\n')) text.pop_back();
    return "\n" + text + "\n";
  }
  if (kind == "ablations" && words.size() == 1) {
    std::vector<JudgedAblation> ablations;
    for (const auto& [file, text] : tables())
      for (JudgedAblation& judged : judge_ablations(read_rows(root_ / fs::path(file).parent_path() / "rows.jsonl")))
        if (judged.tier == "full") ablations.push_back(std::move(judged));
    return summary_of(ablations);
  }
  if (kind == "claims" || kind == "count") {
    const std::vector<Claim> claims = read_claims(root_ / "paper" / "claims.toml");
    std::vector<Judged> verdicts;
    for (const Claim& claim : claims) verdicts.push_back(judge(claim, rows_));
    if (kind == "count") {
      const std::string wanted = marker.size() > 6 ? marker.substr(6) : "";
      return std::to_string(std::ranges::count_if(
          verdicts, [&](const Judged& each) { return wanted.empty() || name(each.verdict) == wanted; }));
    }
    std::ostringstream out;
    write_claims(claims, verdicts, "md", out);
    return "\n" + out.str();
  }
  if (const auto table = numbers_.tables.find(marker); table != numbers_.tables.end()) return table_of(table->second, rows_);
  const auto number = numbers_.numbers.find(marker);
  if (number == numbers_.numbers.end()) throw Error("paper/numbers.toml has no number " + marker);
  return text_of(number->second, rows_);
}

std::string Pages::filled(const fs::path& page) const {
  const std::string text = read_text(root_ / page);
  std::string result;
  std::size_t done = 0;
  for (const Marker& marker : markers_of(text, page.string())) {
    try {
      result += text.substr(done, marker.begin - done) + content_of(marker.name);
    } catch (const Error& error) {
      throw Error(page.string() + ":" + std::to_string(line_of(text, marker.begin)) + ": " + error.what());
    }
    done = marker.end;
  }
  return result + text.substr(done);
}

/// The table.md of each folder, by its path from the root.
std::map<std::string, std::string> Pages::tables() const {
  std::map<std::string, std::string> tables;
  for (const auto& entry : fs::directory_iterator(root_ / "results")) {
    if (!fs::exists(entry.path() / "rows.jsonl") || entry.path().filename() == "local") continue;
    std::ostringstream out;
    write_report(entry.path(), "md", out);
    tables["results/" + entry.path().filename().string() + "/table.md"] = out.str();
  }
  return tables;
}

/// The hashes of all rows.jsonl, as sha256sum writes them.
std::string Pages::sums() const {
  std::set<std::string> files;
  for (const auto& entry : fs::directory_iterator(root_ / "results"))
    if (fs::exists(entry.path() / "rows.jsonl") && entry.path().filename() != "local")
      files.insert(entry.path().filename().string() + "/rows.jsonl");
  std::string text;
  for (const std::string& file : files) text += sha256_of_file(root_ / "results" / file) + "  " + file + "\n";
  return text;
}

std::vector<std::string> Pages::fill() const {
  std::vector<std::string> changed;
  const auto put = [&](const std::string& file, const std::string& text) {
    if (fs::exists(root_ / file) && read_text(root_ / file) == text) return;
    write_page(root_ / file, text);
    changed.push_back(file);
  };
  for (const auto& [file, text] : tables()) put(file, text);
  put("results/SHA256SUMS", sums());
  for (const fs::path& page : numbers_.pages) put(page.string(), filled(page));
  return changed;
}

std::vector<std::string> Pages::problems() const {
  std::vector<std::string> found;
  for (const fs::path& page : numbers_.pages) {
    const std::string text = read_text(root_ / page);
    for (const Marker& marker : markers_of(text, page.string())) {
      const std::string where = page.string() + ":" + std::to_string(line_of(text, marker.begin)) + ": ";
      try {
        const std::string right = content_of(marker.name), is = text.substr(marker.begin, marker.end - marker.begin);
        if (is == right) continue;
        const bool is_short = right.size() + is.size() < 200;
        found.push_back(where + marker.name + (is_short ? " is \"" + is + "\", by the rows \"" + right + "\"" : " differs from the rows"));
      } catch (const Error& error) {
        found.push_back(where + error.what());
      }
    }
    std::vector<std::string> plain;
    for (const std::string& key : {std::string(), page.string()})
      if (const auto phrases = numbers_.plain.find(key); phrases != numbers_.plain.end())
        plain.insert(plain.end(), phrases->second.begin(), phrases->second.end());
    for (const std::string& orphan : orphans(text, plain))
      found.push_back(page.string() + ":" + orphan + " comes from no row: give it a marker, or name the phrase in paper/numbers.toml");
  }
  for (const auto& [file, text] : tables())
    if (!fs::exists(root_ / file) || read_text(root_ / file) != text) found.push_back(file + " is not what `hermesh report` makes of its rows");
  if (!fs::exists(root_ / "results" / "SHA256SUMS") || read_text(root_ / "results" / "SHA256SUMS") != sums())
    found.push_back("results/SHA256SUMS: rows differ from the hashes that were written when they were accepted");
  std::set<std::string> known;
  for (const CaseRecipe& recipe : read_case_file(root_ / "experiments" / "cases.toml")) {
    known.insert(recipe.sha256);
    for (const CaseFile& file : recipe.files) known.insert(file.sha256);
  }
  std::set<std::string> strange;
  std::set<std::pair<std::string, std::string>> predictions;  // those looked at, for git is slow
  for (const auto& [file, text] : tables()) {
    const fs::path folder = fs::path(file).parent_path();
    for (const Json& row : read_rows(root_ / folder / "rows.jsonl")) {
      if (predictions.emplace(text_at(row, "/ablation/prediction"), text_at(row, "/commit")).second)
        if (const std::string problem = prediction_problem(row, root_); !problem.empty()) strange.insert(folder.string() + ": " + problem);
      std::vector<Json> inputs{row.value("case", Json::object())};
      if (const Json* more = find(row, "/inputs")) inputs.insert(inputs.end(), more->begin(), more->end());
      for (const Json& input : inputs) {
        const std::string origin = input.value("origin", ""), sha256 = input.value("sha256", "");
        if ((origin == "data folder" || origin == "package registry") && !known.contains(sha256))
          strange.insert(folder.string() + ": the input " + input.value("name", "") + " has the SHA-256 " + sha256 + ", which experiments/cases.toml does not name");
      }
    }
  }
  found.insert(found.end(), strange.begin(), strange.end());
  return found;
}

}  // namespace hermesh
