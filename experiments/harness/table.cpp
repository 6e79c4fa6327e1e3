#include "experiments/harness/table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

namespace hermesh {
namespace {

std::vector<Column> shown_columns(const std::vector<Json>& rows) {
  if (rows.empty()) return {};
  if (find(rows.front(), "/measurement")) return own_columns(rows.front());
  const Json* names = find(rows.front(), "/columns");
  if (!names) return {all_columns().begin(), all_columns().end()};
  std::vector<Column> shown;
  for (const Json& name : *names)
    for (const Column& column : all_columns())
      if (name == column.name) shown.push_back(column);
  return shown;
}

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

/// Rows of some tables are only there to be plotted.
bool is_printed(const std::vector<Json>& rows) {
  return !rows.empty() && text_at(rows.front(), "/table/printed") != "false";
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

/// "dragon at resolution 400" and what that was.
std::string group_title(const Json& row) {
  std::string title = text_at(row, "/case/name");
  if (find(row, "/measurement"))
    return find(row, "/table/title") ? title + ": " + text_at(row, "/table/title") : title;
  if (find(row, "/sweep")) title += " by " + text_at(row, "/sweep/parameter");
  if (find(row, "/resolution")) return title + " at resolution " + text_at(row, "/resolution");
  return title + (find(row, "/sweep") ? " at voxel size " + text_at(row, "/nominal_voxel_size")
                                      : " at several voxel sizes");
}

/// Which of the table's cells a row is, where a table has several.
std::string cell_text_of(const Json& row) {
  if (find(row, "/sweep"))
    return " at " + text_at(row, "/sweep/parameter") + " " + text_at(row, "/sweep/value");
  return find(row, "/nominal_voxel_size") ? " at voxel " + text_at(row, "/nominal_voxel_size") : "";
}

std::string run_fact(const Json& row) {
  std::string run = "run: commit " + text_at(row, "/commit").substr(0, 12);
  if (const Json* dirty = find(row, "/dirty"); dirty && *dirty == true) run += " with changes";
  run += ", " + text_at(row, "/date") + ", " + text_at(row, "/machine/cpu") + ", " +
         text_at(row, "/threads") + " threads";
  if (const Json* load = find(row, "/load")) run += ", load " + readable(load->at(0).get<double>());
  return run;
}

std::vector<std::string> group_facts(const Json& row) {
  if (find(row, "/measurement"))
    return {
        "measured: " + text_at(row, "/measurement/parameters") + " seed=" + text_at(row, "/measurement/seed"),
        run_fact(row)};
  std::string input = "input: " + text_at(row, "/case/origin") + ", sha256 " +
                      text_at(row, "/case/sha256").substr(0, 12) + ", " +
                      readable(number_at(row, "/case/triangles")) + " triangles";
  if (text_at(row, "/case/origin").starts_with("stand-in"))
    input = "STAND-IN DATA, not the original; " + input;
  std::string grid = "grid: ";
  if (find(row, "/band"))
    grid += "band " + readable(number_at(row, "/band/exterior")) + " voxels outside and " +
            readable(number_at(row, "/band/interior")) + " inside";
  else
    grid += "voxelizer " + text_at(row, "/voxelization/label");
  if (find(row, "/resolution")) grid += ", voxel " + readable(number_at(row, "/voxel_size"));
  if (!find(row, "/band") && find(row, "/voxelization/active_voxels"))
    grid += ", " + readable(number_at(row, "/voxelization/active_voxels")) + " active voxels, " +
            readable(number_at(row, "/voxelization/memory_bytes") / (1 << 20)) + " MiB, made in " +
            readable(number_at(row, "/voxelization/seconds/median")) + " s";
  std::vector<std::string> facts = {input, grid, run_fact(row)};
  if (find(row, "/judged_by"))
    facts.push_back("signs: judged by the " + text_at(row, "/judged_by/signs") + " of " +
                    text_at(row, "/judged_by/solid"));
  return facts;
}

/// Where the time goes, a line for every row of voxelizers: "hermesh: band 0.4 s (80 %), …", and what no
/// stage claims.
std::vector<std::string> stage_sentences(const RowGroup& group) {
  std::vector<std::string> sentences;
  for (const Json& row : group.rows) {
    const Json* stages = find(row, "/stage_seconds");
    const double total = number_at(row, "/seconds/median");
    if (!find(row, "/band") || find(row, "/sweep") || !stages || stages->size() < 2 || total <= 0.0) continue;
    std::string text;
    double claimed = 0.0;
    const auto part = [&](const std::string& name, double seconds) {
      text += (text.empty() ? "" : ", ") + name + " " + readable(seconds) + " s (" +
              readable(std::round(100.0 * seconds / total)) + " %)";
    };
    for (const auto& [name, seconds] : stages->items()) {
      part(name, seconds.get<double>());
      claimed += seconds.get<double>();
    }
    if (total - claimed > 0.02 * total) part("rest", total - claimed);
    sentences.push_back("time of " + text_at(row, "/variant/label") + cell_text_of(row) + ": " + text);
  }
  return sentences;
}

/// The header above the labels.
std::string first_column(const Json& row) {
  return find(row, "/table/first_column") ? text_at(row, "/table/first_column") : "variant";
}

std::vector<std::string> joined_list(const Json& row, const std::string& pointer) {
  std::vector<std::string> items;
  if (const Json* list = find(row, pointer))
    for (const Json& item : *list) items.push_back(item.get<std::string>());
  return items;
}

/// What nobody may overlook in a group, one sentence each.
std::vector<std::string> alarms(const RowGroup& group) {
  std::vector<std::string> sentences;
  for (const Json& row : group.rows) {
    const std::string who =
        text_at(row, "/variant/label") + " on " + group_title(row) + cell_text_of(row) + ": ";
    if (find(row, "/failed")) sentences.push_back("FAILED: " + who + text_at(row, "/failed"));
    for (const std::string& broken : joined_list(row, "/broken"))
      sentences.push_back("BROKEN: " + who + broken);
    for (const std::string& unchecked : joined_list(row, "/unchecked"))
      sentences.push_back("UNCHECKED: " + who + "the promise of " + unchecked);
    for (const std::string& disagreement : joined_list(row, "/disagreements"))
      sentences.push_back("DISAGREEMENT of the judges: " + who + disagreement);
    if (const Json* differ = find(row, "/repetitions_differ"); differ && *differ == true)
      sentences.push_back("NOT DETERMINISTIC: " + who + "repetitions gave different " +
                          (find(row, "/band") ? "level sets" : "meshes"));
    if (find(row, "/not_judged")) sentences.push_back("NOT JUDGED: " + who + text_at(row, "/not_judged"));
  }
  return sentences;
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
    const std::string run = text_at(row, "/run");
    auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& g) { return g.first == run; });
    if (group == groups.end()) {
      RowGroup before{{}, static_cast<int>(groups.size())};
      if (find(row, "/table/additive") && !groups.empty()) before = groups.back().second;
      group = groups.insert(groups.end(), {run, std::move(before)});
    }
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
  for (const std::string& fact : group_facts(group.rows.front())) out << "- " << fact << "\n";
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
    return c == 0 || shown[c - 1].name == "promises" || shown[c - 1].name == "options" ||
           shown[c - 1].name == "fingerprint";
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
  for (const std::string& fact : group_facts(group.rows.front())) out << " " << for_latex(fact) << ".";
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
