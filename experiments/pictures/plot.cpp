#include "experiments/pictures/plot.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <ostream>
#include <sstream>

#include "algorithms/core/error.h"
#include "experiments/pictures/curves.h"

namespace hermesh {
namespace {

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

/// Colours that the colour-blind tell apart (Okabe and Ito, 2008). Curves that coincide are common (all zero,
/// say), so that each is thinner and has smaller marks than those below it.
struct Style {
  const char* colour;
  int mark;
};
constexpr std::array<Style, 8> kStyles = {{{"#0072b2", 7},
                                           {"#e69f00", 5},
                                           {"#009e73", 9},
                                           {"#d55e00", 11},
                                           {"#56b4e9", 13},
                                           {"#cc79a7", 15},
                                           {"#666666", 4},
                                           {"#000000", 6}}};

std::string style_of(std::size_t curve, std::size_t curves) {
  const Style& style = kStyles[curve % kStyles.size()];
  const double above = curves > 1 ? double(curves - 1 - curve) / double(curves - 1) : 0.0;
  std::ostringstream text;
  text << "lc rgb '" << style.colour << "' lw " << 2.0 + 3.0 * above << " pt " << style.mark << " ps "
       << 1.3 + 1.1 * above;
  return text.str();
}

constexpr const char* kFrame = R"(
set border lw 1.2
set grid lc rgb '#dddddd' lt 1 lw 1
set tics nomirror
set key tmargin center horizontal Left reverse samplen 2 spacing 1.3
set rmargin 3
set autoscale xfix
set offsets graph 0.03, graph 0.03, 0, 0
)";

void write_data(const std::filesystem::path& file, const std::vector<Curve>& curves) {
  std::ofstream out(file);
  out << std::setprecision(10);
  for (const Curve& curve : curves) {
    out << "# " << curve.label << "\n";
    for (const CurvePoint& point : curve.points) out << point.x << ' ' << point.y << "\n";
    out << "\n\n";
  }
  if (!out.flush()) throw Error("cannot write " + file.string());
}

/// Writes the script that draws the curves. Paths in it are relative to its folder, so that
/// it can be run again anywhere.
void write_script(const std::filesystem::path& file, const Plot& plot, const std::vector<Curve>& curves) {
  std::ofstream out(file);
  out << "# gnuplot " << file.filename().string() << kFrame;
  // Above the picture a long key would leave no room for it.
  if (curves.size() > kStyles.size())
    out << "set key outside right center vertical maxcols 1 samplen 1 spacing 1.1 font ',9'\nset rmargin -1\n";
  out << "set title " << quoted(plot.title)
      << " noenhanced\nset xlabel " << quoted(plot.x_label) << " noenhanced\nset ylabel "
      << quoted(plot.y_label) << " noenhanced\n";
  if (plot.log_x) out << "set logscale x\nset format x '%.0s%c'\n";
  if (plot.log_y) out << "set logscale y\n";
  if (!plot.log_y) out << (plot.percent ? "set yrange [0:5<*<100]\n" : "set yrange [0:*]\n");
  const std::string stem = file.stem().string();
  for (const auto& [terminal, extension] :
       {std::pair("pngcairo size 1200,840 font 'DejaVu Sans,19'", "png"),
        std::pair("svg size 800,560 dynamic font 'DejaVu Sans,14' background '#ffffff'", "svg")}) {
    out << "set terminal " << terminal << "\nset output '" << stem << '.' << extension << "'\nplot ";
    for (std::size_t i = 0; i < curves.size(); ++i)
      out << (i ? ", \\\n     " : "") << "'" << stem << ".dat' index " << i << " with linespoints "
          << style_of(i, curves.size()) << " title " << quoted(curves[i].label) << " noenhanced";
    out << "\n";
  }
  if (!out.flush()) throw Error("cannot write " + file.string());
}

bool run_gnuplot(const std::filesystem::path& script) {
  std::string folder = script.parent_path().empty() ? "." : script.parent_path().string();
  std::string command = "cd '";
  for (const char c : folder) command += c == '\'' ? std::string("'\\''") : std::string(1, c);
  command += "' && gnuplot '" + script.filename().string() + "' >/dev/null 2>&1 </dev/null";
  return std::system(command.c_str()) == 0;
}

}  // namespace

Json to_json(const Plot& plot) {
  return {{"name", plot.name},   {"title", plot.title},     {"case", plot.case_name},  {"x", plot.x},
          {"y", plot.y},         {"x_label", plot.x_label}, {"y_label", plot.y_label}, {"log_x", plot.log_x},
          {"log_y", plot.log_y}, {"percent", plot.percent}, {"by_variant", plot.by_variant},
          {"resolution", plot.resolution}};
}

Plot plot_from_json(const Json& json) {
  return {json.at("name"),    json.at("title"),   json.at("case"),  json.at("x"),     json.at("y"),
          json.at("x_label"), json.at("y_label"), json.at("log_x"), json.at("log_y"), json.at("percent"),
          json.value("by_variant", false), json.value("resolution", 0)};
}

void write_plots(const std::vector<Json>& rows, const std::filesystem::path& folder, std::ostream& out) {
  for (const PlottedRows& own : plotted_rows(rows)) {
    for (const Plot& plot : own.plots) {
      const std::vector<Curve> curves = curves_of(plot, own.rows);
      if (curves.empty()) continue;
      const std::filesystem::path stem = folder / (own.experiment + "-" + plot.name);
      write_data(stem.string() + ".dat", curves);
      write_script(stem.string() + ".gp", plot, curves);
      const bool drawn = run_gnuplot(stem.string() + ".gp");
      out << (drawn ? "Plot: " + stem.string() + ".png, .svg\n"
                    : "Not drawn, because gnuplot is missing or failed: " + stem.string() + ".gp\n");
    }
  }
}

}  // namespace hermesh
