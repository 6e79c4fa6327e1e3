#include "experiments/harness/table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "experiments/harness/table_text.h"

namespace hermesh {
namespace {

/// The columns of the CSV: those that the rows bring along, and the common ones unless no row has them.
std::vector<Column> csv_columns(const std::vector<Json>& rows) {
  std::vector<Column> columns;
  bool common = rows.empty();
  for (const Json& row : rows) {
    common = common || !find(row, "/measurement");
    for (const Column& own : own_columns(row))
      if (std::ranges::find(columns, own.name, &Column::name) == columns.end()) columns.push_back(own);
  }
  if (common) columns.insert(columns.begin(), all_columns().begin(), all_columns().end());
  return columns;
}

/// Columns on a terminal: one for each code point, since no wide or combining letters occur in tables.
std::size_t display_width(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](unsigned char c) { return (c & 0xc0) != 0x80; }));
}

std::string replaced(std::string text, const std::vector<std::pair<std::string, std::string>>& pairs) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const auto pair = std::find_if(pairs.begin(), pairs.end(), [&](const auto& p) {
      return text.compare(i, p.first.size(), p.first) == 0;
    });
    result += pair == pairs.end() ? std::string(1, text[i]) : pair->second;
    i += pair == pairs.end() ? 1 : pair->first.size();
  }
  return result;
}

std::string for_markdown(const std::string& text) { return replaced(text, {{"|", "\\|"}, {"\n", " "}}); }

std::string for_latex(const std::string& text) {
  return replaced(text, {{"\\", "\\textbackslash{}"},
                         {"&", "\\&"},
                         {"%", "\\%"},
                         {"$", "\\$"},
                         {"#", "\\#"},
                         {"_", "\\_"},
                         {"{", "\\{"},
                         {"}", "\\}"},
                         {"~", "\\textasciitilde{}"},
                         {"^", "\\textasciicircum{}"},
                         {"÷", "$\\div$"},
                         {"×", "$\\times$"},
                         {"°", "$^\\circ$"},
                         {"–", "--"},
                         {"·", "$\\cdot$"},
                         {"→", "$\\to$"}});
}

std::string for_csv(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  quoted += replaced(text, {{"\"", "\"\""}});
  quoted += '"';
  return quoted;
}

/// In the order in which labels first appear, whichever run their rows are of.
void put_labels_together(std::vector<Json>& rows) {
  std::map<std::string, std::size_t> first;
  for (std::size_t i = 0; i < rows.size(); ++i) first.emplace(text_at(rows[i], "/variant/label"), i);
  std::ranges::stable_sort(rows, {}, [&](const Json& row) { return first[text_at(row, "/variant/label")]; });
}

}  // namespace

std::vector<RowGroup> latest_groups(const std::vector<Json>& rows) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<std::pair<std::string, RowGroup>>> runs;
  const auto resolution = [](const Json& row) {
    const Json* value = find(row, "/values/resolution");
    return value ? *value : Json();
  };
  for (const Json& row : rows) {
    std::string key;
    for (const char* part :
         {"/experiment", "/tier", "/case/name", "/resolution", "/voxelization/label", "/sweep/parameter"})
      key += text_at(row, part) + "\n";
    if (!runs.contains(key)) order.push_back(key);
    auto& groups = runs[key];
    // The rows of an additive table are one group, in whatever order its runs stand in the file.
    const std::string run = text_at(row, "/run"), of = find(row, "/table/additive") ? "" : run;
    auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& g) { return g.first == of; });
    if (group == groups.end())
      group = groups.insert(groups.end(), {of, RowGroup{{}, static_cast<int>(groups.size())}});
    std::erase_if(group->second.rows, [&](const Json& old) {
      return text_at(old, "/run") != run && text_at(old, "/variant/label") == text_at(row, "/variant/label") &&
             resolution(old) == resolution(row);
    });
    group->second.rows.push_back(row);
  }
  std::vector<RowGroup> result;
  for (const std::string& key : order) {
    result.push_back(std::move(runs[key].back().second));
    if (find(result.back().rows.front(), "/table/additive")) put_labels_together(result.back().rows);
  }
  return result;
}

void write_markdown(const RowGroup& group, std::ostream& out) {
  if (!is_printed(group.rows)) return;
  out << "### " << for_markdown(group_title(group.rows.front())) << "\n\n";
  for (const std::string& fact : group_facts(group)) out << "- " << fact << "\n";
  if (group.earlier_runs > 0)
    out << "- earlier runs of these cells in the same folder, not shown: " << group.earlier_runs << "\n";

  const std::vector<Column> shown = shown_columns(group.rows);
  std::vector<std::vector<std::string>> lines{{first_column(group.rows.front())}};
  for (const Column& column : shown) lines[0].push_back(column.header);
  for (const Json& row : group.rows) {
    lines.push_back({for_markdown(text_at(row, "/variant/label"))});
    for (const Column& column : shown) lines.back().push_back(for_markdown(cell_text(column, row)));
  }
  std::vector<std::size_t> widths(lines[0].size(), 3);
  for (const auto& line : lines)
    for (std::size_t c = 0; c < line.size(); ++c) widths[c] = std::max(widths[c], display_width(line[c]));

  const auto left_aligned = [&](std::size_t c) {
    return c == 0 || is_left_aligned(shown[c - 1]);
  };
  for (std::size_t r = 0; r < lines.size(); ++r) {
    out << (r == 0 ? "\n|" : "|");
    for (std::size_t c = 0; c < widths.size(); ++c) {
      const std::string padding(widths[c] - display_width(lines[r][c]), ' ');
      out << ' ' << (left_aligned(c) ? lines[r][c] + padding : padding + lines[r][c]) << " |";
    }
    out << '\n';
    if (r > 0) continue;
    out << '|';
    for (std::size_t c = 0; c < widths.size(); ++c)
      out << ' ' << (left_aligned(c) ? std::string(widths[c], '-') : std::string(widths[c] - 1, '-') + ":")
          << " |";
    out << '\n';
  }
  const std::vector<std::string> loud = alarms(group), stages = stage_sentences(group);
  if (!loud.empty() || !stages.empty()) out << '\n';
  for (const std::string& sentence : stages) out << "- " << for_markdown(sentence) << "\n";
  for (const std::string& sentence : loud) out << "- **" << for_markdown(sentence) << "**\n";
  out << '\n';
}

void write_legend(const std::vector<Json>& rows, std::ostream& out) {
  if (!is_printed(rows)) return;
  out << "Columns:";
  const char* separator = " ";
  for (const Column& column : shown_columns(rows)) {
    out << separator << "*" << column.header << "* " << column.meaning;
    separator = "; ";
  }
  out << ".\n";
}

void write_latex(const RowGroup& group, std::ostream& out) {
  if (!is_printed(group.rows)) return;
  const std::vector<Column> shown = shown_columns(group.rows);
  out << "\\begin{table}\n\\centering\n\\begin{tabular}{l" << std::string(shown.size(), 'r')
      << "}\n\\toprule\n"
      << for_latex(first_column(group.rows.front()));
  for (const Column& column : shown) out << " & " << for_latex(column.header);
  out << " \\\\\n\\midrule\n";
  for (const Json& row : group.rows) {
    out << for_latex(text_at(row, "/variant/label"));
    for (const Column& column : shown) out << " & " << for_latex(cell_text(column, row));
    out << " \\\\\n";
  }
  out << "\\bottomrule\n\\end{tabular}\n\\caption{" << for_latex(group_title(group.rows.front())) << ".";
  for (const std::string& fact : group_facts(group)) out << " " << for_latex(fact) << ".";
  for (const std::string& sentence : alarms(group)) out << " \\textbf{" << for_latex(sentence) << ".}";
  out << "}\n\\end{table}\n\n";
}

void write_csv(const std::vector<Json>& rows, std::ostream& out) {
  const std::vector<std::pair<std::string, std::string>> keys = {
      {"experiment", "/experiment"},
      {"tier", "/tier"},
      {"run", "/run"},
      {"commit", "/commit"},
      {"dirty", "/dirty"},
      {"date", "/date"},
      {"cpu", "/machine/cpu"},
      {"threads", "/threads"},
      {"case", "/case/name"},
      {"origin", "/case/origin"},
      {"sha256", "/case/sha256"},
      {"resolution", "/resolution"},
      {"voxel_size", "/voxel_size"},
      {"nominal_voxel_size", "/nominal_voxel_size"},
      {"swept", "/sweep/parameter"},
      {"swept_value", "/sweep/value"},
      {"voxelizer", "/voxelization/label"},
      {"variant", "/variant/name"},
      {"label", "/variant/label"},
      {"failed", "/failed"}};
  for (const auto& [name, pointer] : keys) out << name << ',';
  const std::vector<Column> columns = csv_columns(rows);
  for (std::size_t c = 0; c < columns.size(); ++c) out << (c ? "," : "") << columns[c].name;
  out << '\n';
  for (const Json& row : rows) {
    for (const auto& [name, pointer] : keys) out << for_csv(text_at(row, pointer)) << ',';
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const Json value = value_of(columns[c], row);
      out << (c ? "," : "")
          << for_csv(value.is_null()     ? ""
                     : value.is_string() ? value.get<std::string>()
                                         : value.dump());
    }
    out << '\n';
  }
}

}  // namespace hermesh
