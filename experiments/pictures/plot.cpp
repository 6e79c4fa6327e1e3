#include "experiments/pictures/plot.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <ostream>
#include <set>
#include <sstream>

#include "algorithms/core/error.h"
#include "experiments/pictures/curves.h"
#include "experiments/pictures/gnuplot.h"
#include "experiments/pictures/plot_axis.h"
#include "experiments/pictures/plot_style.h"

namespace hermesh {
namespace {

std::string quoted_for_gnuplot(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

/// Code points, since no wide or combining letters occur.
std::size_t letters(const std::string& text) {
  return std::size_t(std::ranges::count_if(text, [](unsigned char c) { return (c & 0xc0) != 0x80; }));
}

std::vector<std::string> broken(const std::string& text, std::size_t most) {
  std::vector<std::string> lines;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (lines.empty() || letters(lines.back()) + 1 + letters(word) > most)
      lines.push_back(word);
    else
      lines.back() += " " + word;
  }
  return lines;
}

struct DrawnCurve {
  Curve curve;
  CurveStyle style;
  bool emphasised;

  bool has_intervals() const {
    return std::ranges::any_of(curve.points, [](const CurvePoint& point) { return point.low.has_value(); });
  }
};

/// Everything that a script draws.
struct Drawing {
  const Plot& plot;
  std::vector<DrawnCurve>
      curves;  ///< those that are emphasised come first, so that they lie below the others
  std::vector<std::string> labels;  ///< of the categories, by their number
  std::string title;
  std::vector<std::string> subtitle;  ///< lines

  /// Labels that are long are read at the left of lying bars, short ones below.
  bool lies() const {
    return plot.categories &&
           (labels.size() > 16 ||
            std::ranges::any_of(labels, [](const std::string& label) { return letters(label) > 6; }));
  }
};

/// A name stands for itself and for what begins with it, as "openvdb" for "openvdb, 1 thread".
bool is_emphasised(const Plot& plot, const std::string& label) {
  return std::ranges::any_of(plot.emphasised, [&](const std::string& name) {
    return label.starts_with(name) &&
           (label.size() == name.size() || label[name.size()] == ' ' || label[name.size()] == ',');
  });
}

/// Whether the numbers of this column depend on the machine.
bool is_of_time(const std::string& column) {
  return column.find("second") != std::string::npos || column.find("speed") != std::string::npos;
}

/// What a reader has to know of the rows that the curves come from: the plot's note, stand-ins, machines, the
/// tier.
std::string circumstances(const Plot& plot, const std::vector<Curve>& curves, const std::vector<Json>& rows) {
  std::set<std::string> machines, stand_ins, tiers;
  for (const Curve& curve : curves)
    for (const CurvePoint& point : curve.points) {
      const Json& row = rows[point.row];
      if (const std::string cpu = text_at(row, "/machine/cpu"); !cpu.empty())
        machines.insert(cpu + ", " + text_at(row, "/machine/cores") + " cores");
      if (text_at(row, "/case/origin").starts_with("stand-in")) stand_ins.insert(text_at(row, "/case/name"));
      if (const Json* inputs = find(row, "/inputs"))
        for (const Json& input : *inputs)
          if (text_at(input, "/origin").starts_with("stand-in")) stand_ins.insert(text_at(input, "/name"));
      tiers.insert(text_at(row, "/tier"));
    }
  const auto list = [](const std::set<std::string>& names) {
    std::string all;
    for (const std::string& name : names) all += (all.empty() ? "" : " and ") + name;
    return all;
  };
  std::vector<std::string> parts;
  if (!plot.note.empty()) parts.push_back(plot.note);
  if (!stand_ins.empty()) parts.push_back("with a stand-in for " + list(stand_ins));
  if (is_of_time(plot.y.front()) && !machines.empty()) parts.push_back("measured on " + list(machines));
  if (tiers.contains("quick")) parts.push_back("quick tier");
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "" : "; ") + part;
  return text;
}

std::string full_title(const Plot& plot) {
  if (plot.resolution == 0 || plot.title.find(std::to_string(plot.resolution)) != std::string::npos)
    return plot.title;
  return plot.title + " at " + std::to_string(plot.resolution) + " voxels";
}

void write_data(const std::filesystem::path& file, const Drawing& drawing) {
  std::ofstream out(file);
  out << std::setprecision(10);
  for (const DrawnCurve& drawn : drawing.curves) {
    out << "# " << drawn.curve.label << "\n";
    for (const CurvePoint& point : drawn.curve.points) {
      out << point.x << ' ' << point.y;
      // Beside points with an interval one without has an interval of no length.
      if (drawn.has_intervals())
        out << ' ' << point.low.value_or(point.y) << ' ' << point.high.value_or(point.y);
      out << "\n";
    }
    out << "\n\n";
  }
  if (!out.flush()) throw Error("cannot write " + file.string());
}

PlotAxis axis_of_categories(const std::vector<std::string>& labels) {
  PlotAxis axis{-0.5, double(labels.size()) - 0.5, {}};
  for (std::size_t i = 0; i < labels.size(); ++i) axis.ticks.push_back({double(i), labels[i]});
  return axis;
}

PlotAxis axis_of_x(const Drawing& drawing) {
  if (drawing.plot.categories) return axis_of_categories(drawing.labels);
  std::vector<double> values;
  for (const DrawnCurve& drawn : drawing.curves)
    for (const CurvePoint& point : drawn.curve.points) values.push_back(point.x);
  return plot_axis(values, drawing.plot.log_x, false, true);
}

/// The axis of the numbers that are compared holds the ends of their intervals.
PlotAxis axis_of_y(const Drawing& drawing) {
  std::vector<double> values;
  for (const DrawnCurve& drawn : drawing.curves)
    for (const CurvePoint& point : drawn.curve.points) {
      values.push_back(point.y);
      for (const auto& end : {point.low, point.high})
        if (end && (!drawing.plot.log_y || *end > 0.0)) values.push_back(*end);
    }
  return plot_axis(values, drawing.plot.log_y, !drawing.lies(), false);
}

void write_axis(std::ostream& out, const char* name, const PlotAxis& axis, bool logarithmic, bool reversed) {
  if (logarithmic) out << "set logscale " << name << "\n";
  out << "set " << name << "range [" << (reversed ? axis.high : axis.low) << ':'
      << (reversed ? axis.low : axis.high) << "]\nset " << name << "tics noenhanced (";
  for (std::size_t i = 0; i < axis.ticks.size(); ++i)
    out << (i ? ", " : "") << quoted_for_gnuplot(axis.ticks[i].text) << ' ' << axis.ticks[i].at
        << (axis.ticks[i].text.empty() ? " 1" : "");
  out << ")\n";
}

/// Where the key stands: below the picture while it takes few lines there, else at the right, never over the
/// curves. An axis of categories has the labels already.
struct Key {
  bool shown, right;
  std::size_t columns, lines;

  explicit Key(const Drawing& drawing) {
    std::size_t longest = 0;
    for (const DrawnCurve& drawn : drawing.curves) longest = std::max(longest, letters(drawn.curve.label));
    const std::size_t count = drawing.curves.size();
    columns = std::clamp<std::size_t>(80 / (longest + 8), 1, 5);
    shown = !drawing.plot.categories || count > 1;
    lines = (count + columns - 1) / columns;
    right = shown && lines > 3;
  }
};

struct Terminal {
  const char* extension;
  const char* name;
  const char* rest;
  double width, height;  ///< pixels, or centimetres of a PDF
  const char* unit;
  double small_font, mark;  ///< mark: factor on sizes
};
constexpr double kRightKey = 1.3;  ///< how much wider a picture with a key at its right is
const std::vector<Terminal> kTerminals = {
    {"png", "pngcairo", "font 'DejaVu Sans,17'", 1200, 840, "", 13, 1.0},
    {"pdf", "pdfcairo", "font 'DejaVu Sans,9.5'", 16.8, 11.76, "cm", 7.2, 0.4},
    {"svg", "svg", "dynamic font 'DejaVu Sans,13' background '#ffffff'", 800, 560, "", 10, 0.7}};

/// Curves that coincide are common (all zero, say), so that the marks of each are smaller than those below
/// it. A further column, which this program did not measure, is dashed.
std::string style_of(const Drawing& drawing, std::size_t i, double factor) {
  const DrawnCurve& drawn = drawing.curves[i];
  const double curves = double(drawing.curves.size());
  const double above = curves > 1 ? (curves - 1 - double(i)) / (curves - 1) : 0.5;
  std::ostringstream text;
  text << "lc rgb '" << drawn.style.colour << "' lw "
       << (drawn.emphasised ? 5.5 : 2.2) * std::max(factor, 0.6) << " pt " << drawn.style.mark << " ps "
       << factor * (1.3 + 0.8 * above + (drawn.emphasised ? 0.5 : 0.0));
  if (!drawing.plot.categories && drawn.curve.column != drawing.plot.y.front()) text << " dt (12,6)";
  return text.str();
}

void write_curves(std::ostream& out, const Drawing& drawing, const std::string& stem, double factor) {
  const bool lies = drawing.lies();
  const char* separator = "plot ";
  for (std::size_t i = 0; i < drawing.curves.size(); ++i) {
    const DrawnCurve& drawn = drawing.curves[i];
    const std::string data =
        "'" + stem + ".dat' index " + std::to_string(i) + " using " + (lies ? "2:1" : "1:2");
    if (drawn.has_intervals()) {
      out << separator << data << ":3:4 with " << (lies ? "xerrorbars" : "yerrorbars") << " lc rgb '"
          << drawn.style.colour << "' lw " << 1.6 * std::max(factor, 0.6) << " pt 0 notitle";
      separator = ", \\\n     ";
    }
    const bool joined = drawn.curve.points.size() > 1 && !drawing.plot.categories;
    std::string style = style_of(drawing, i, factor);
    out << separator << data << " with " << (joined ? "linespoints " : "points ") << style << " title "
        << quoted_for_gnuplot(drawn.curve.label) << " noenhanced";
    separator = ", \\\n     ";
  }
  out << "\n";
}

/// Writes the script that draws the curves. Paths in it are relative to its folder, so that it can be run
/// again anywhere.
void write_script(const std::filesystem::path& file, const Drawing& drawing) {
  const Plot& plot = drawing.plot;
  const std::string stem = file.stem().string();
  const Key key(drawing);
  const bool lies = drawing.lies();
  std::ofstream out(file);
  out << std::setprecision(10) << "# gnuplot " << file.filename().string() << R"(
set encoding utf8
set border 3 lw 1.2
set grid lc rgb '#dddddd' lt 1 lw 1
set tics nomirror out
)";
  if (!key.shown)
    out << "unset key\nset rmargin 3\n";
  else if (key.right)
    out << "set key outside right center vertical maxcols 1 Left reverse samplen 2 spacing 1.25\n";
  else
    out << "set key bmargin center horizontal maxcols " << key.columns
        << " Left reverse samplen 2 spacing 1.25\nset rmargin 3\nset bmargin "
        << 4.0 + 1.4 * double(key.lines) << "\n";
  out << "set xlabel " << quoted_for_gnuplot(lies ? plot.y_label : plot.x_label) << " noenhanced\n";
  if (!lies) out << "set ylabel " << quoted_for_gnuplot(plot.y_label) << " noenhanced\n";
  write_axis(out, lies ? "y" : "x", axis_of_x(drawing), !plot.categories && plot.log_x, lies);
  write_axis(out, lies ? "x" : "y", axis_of_y(drawing), plot.log_y, false);
  // Labels in place of a title, for they may have another size; the last line stands right above the picture.
  const double lines = double(drawing.subtitle.size());
  out << "set tmargin " << 2.2 + 1.1 * lines << "\nset label 1 " << quoted_for_gnuplot(drawing.title)
      << " at graph 0.5,1 center offset 0," << 1.0 + 1.1 * lines << " noenhanced\n";
  for (const Terminal& terminal : kTerminals) {
    const double wider = key.right ? kRightKey : 1.0;
    // An axis of many lines needs room for each.
    const double higher = lies ? std::max(1.0, double(drawing.labels.size()) / 18) : 1.0;
    out << "set terminal " << terminal.name << " size " << terminal.width * wider << terminal.unit << ','
        << terminal.height * higher << terminal.unit << ' ' << terminal.rest << "\nset output '" << stem
        << '.' << terminal.extension << "'\n";
    for (std::size_t i = 0; i < drawing.subtitle.size(); ++i)
      out << "set label " << i + 2 << ' ' << quoted_for_gnuplot(drawing.subtitle[i]) << " at graph 0.5,1 center offset 0,"
          << 1.0 + 1.1 * (lines - 1 - double(i)) << " font '," << terminal.small_font
          << "' textcolor rgb '#555555' noenhanced\n";
    write_curves(out, drawing, stem, terminal.mark);
  }
  out << "set output\n";
  if (!out.flush()) throw Error("cannot write " + file.string());
}

/// Numbers the labels of an experiment, so that each looks the same in all of its plots.
class Styles {
 public:
  std::size_t of(const std::string& label) { return numbers_.emplace(label, numbers_.size()).first->second; }

 private:
  std::map<std::string, std::size_t> numbers_;
};

std::vector<std::string> labels_of(const Plot& plot, const std::vector<Curve>& curves,
                                   const std::vector<Json>& rows) {
  std::vector<std::string> labels;
  for (const Curve& curve : curves)
    for (const CurvePoint& point : curve.points) {
      const auto place = std::size_t(point.x);
      if (labels.size() <= place) labels.resize(place + 1);
      labels[place] = text_at(rows[point.row], plot.by_variant ? "/variant/name" : "/variant/label");
    }
  return labels;
}

Drawing drawing_of(const Plot& plot, const std::vector<Curve>& curves, const std::vector<Json>& rows,
                   Styles& styles) {
  Drawing drawing{plot, {}, {}, full_title(plot), broken(circumstances(plot, curves, rows), 105)};
  // An experiment may have more labels than there are styles, while its plots do not.
  const bool of_experiment =
      std::ranges::all_of(curves, [&](const Curve& c) { return styles.of(c.label) < kPlotStyles; });
  for (std::size_t i = 0; i < curves.size(); ++i)
    drawing.curves.push_back({curves[i], curve_style(of_experiment ? styles.of(curves[i].label) : i),
                              is_emphasised(plot, curves[i].label)});
  std::ranges::stable_partition(drawing.curves, [](const DrawnCurve& drawn) { return drawn.emphasised; });
  if (plot.categories) drawing.labels = labels_of(plot, curves, rows);
  return drawing;
}

}  // namespace

Json to_json(const Plot& plot) {
  Json json = {{"name", plot.name},
               {"title", plot.title},
               {"case", plot.case_name},
               {"x", plot.x},
               {"y", plot.y},
               {"x_label", plot.x_label},
               {"y_label", plot.y_label},
               {"log_x", plot.log_x},
               {"log_y", plot.log_y},
               {"percent", plot.percent},
               {"by_variant", plot.by_variant},
               {"resolution", plot.resolution}};
  // Rows without these stay the bytes that they were.
  if (plot.categories) json["categories"] = true;
  if (!plot.emphasised.empty()) json["emphasised"] = plot.emphasised;
  if (!plot.note.empty()) json["note"] = plot.note;
  return json;
}

Plot plot_from_json(const Json& json) {
  return {json.at("name"),
          json.at("title"),
          json.at("case"),
          json.at("x"),
          json.at("y"),
          json.at("x_label"),
          json.at("y_label"),
          json.at("log_x"),
          json.at("log_y"),
          json.at("percent"),
          json.value("by_variant", false),
          json.value("resolution", 0),
          json.value("categories", false),
          json.value("emphasised", std::vector<std::string>()),
          json.value("note", "")};
}

void write_plots(const std::vector<Json>& rows, const std::filesystem::path& folder, std::ostream& out) {
  for (const PlottedRows& own : plotted_rows(rows)) {
    Styles styles;
    for (const Plot& plot : own.plots) {
      const std::vector<Curve> curves = curves_of(plot, own.rows);
      if (curves.empty()) continue;
      const std::filesystem::path stem = folder / (own.experiment + "-" + plot.name);
      if (curves.size() > kPlotStyles) {
        out << "Not drawn: " << stem.string() << " has " << curves.size() << " curves, and a plot tells "
            << kPlotStyles << " apart\n";
        continue;
      }
      const Drawing drawing = drawing_of(plot, curves, own.rows, styles);
      write_data(stem.string() + ".dat", drawing);
      write_script(stem.string() + ".gp", drawing);
      draw_with_gnuplot(stem, out);
    }
  }
}

}  // namespace hermesh
