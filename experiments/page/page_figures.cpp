#include "experiments/page/page_figures.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "experiments/harness/table_text.h"
#include "experiments/pictures/curves.h"

namespace hermesh {
namespace {

struct Interval {
  std::optional<double> low, high;
};

/// The shortest and the longest of the timed repetitions, where there are several.
Interval spread(const Json& row) {
  const Json* all = find(row, "/seconds/all");
  if (!all || all->size() < 2) return {};
  const auto [low, high] = std::minmax_element(all->begin(), all->end());
  return {low->get<double>(), high->get<double>()};
}

std::optional<double> number_of(const std::vector<Column>& columns, const std::string& name,
                                const Json& row) {
  const auto column = std::ranges::find(columns, name, &Column::name);
  if (column == columns.end()) return std::nullopt;
  const Json value = value_of(*column, row);
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

std::optional<double> number_of(const std::string& name, const Json& row) {
  static const std::vector<Column> columns(all_columns().begin(), all_columns().end());
  return number_of(columns, name, row);
}

Json optional_number(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json point(const Json& row, double x, double y, const Interval& interval = {}) {
  return {page_row(row), x, y, optional_number(interval.low), optional_number(interval.high)};
}

/// What tells the tables of an experiment's rows apart.
std::string group_key(const Json& row, bool with_resolution) {
  std::string key;
  for (const char* part : {"/tier", "/case/name", "/voxelization/label"}) key += text_at(row, part) + "\n";
  if (with_resolution) key += text_at(row, "/resolution") + "\n" + text_at(row, "/nominal_voxel_size");
  return key;
}

/// The rows by their groups, which are in the order in which they first appear.
std::vector<std::vector<Json>> grouped(const std::vector<Json>& rows, bool with_resolution) {
  std::vector<std::string> order;
  std::map<std::string, std::vector<Json>> groups;
  for (const Json& row : rows) {
    const std::string key = group_key(row, with_resolution);
    if (!groups.contains(key)) order.push_back(key);
    groups[key].push_back(row);
  }
  std::vector<std::vector<Json>> result;
  for (const std::string& key : order) result.push_back(std::move(groups[key]));
  return result;
}

/// "dragon at 400, voxelizer openvdb, full": what a group is, with what several groups differ in.
std::string subject(const Json& row, const std::vector<Json>& all, bool with_resolution) {
  const auto several = [&](const char* pointer) {
    return std::ranges::any_of(
        all, [&](const Json& other) { return text_at(other, pointer) != text_at(row, pointer); });
  };
  std::string text = text_at(row, "/case/name");
  if (with_resolution && find(row, "/resolution")) text += " at " + text_at(row, "/resolution");
  if (!find(row, "/band") && several("/voxelization/label"))
    text += ", voxelizer " + text_at(row, "/voxelization/label");
  if (several("/tier")) text += ", " + text_at(row, "/tier");
  return text;
}

class Figures {
 public:
  explicit Figures(const PlottedRows& own) : own_(own) {}

  Json made() {
    for (const Plot& plot : own_.plots) add_plot(plot);
    std::vector<Json> runs, extractions;
    for (const Json& row : own_.rows) {
      if (find(row, "/measurement") || find(row, "/sweep")) continue;
      runs.push_back(row);
      if (!find(row, "/band")) extractions.push_back(row);
    }
    for (const auto& rows : grouped(extractions, true)) add_triangles_and_error(rows, extractions);
    std::set<std::string> scaled;
    for (const auto& rows : grouped(runs, false))
      if (add_scaling(rows, runs)) scaled.insert(group_key(rows.front(), false));
    for (const auto& rows : grouped(runs, true))
      if (!find(rows.front(), "/band") || !scaled.contains(group_key(rows.front(), false)))
        add_times(rows, runs);
    for (const RowGroup& group : latest_groups(own_.rows)) add_intervals(group.rows);
    return std::move(figures_);
  }

 private:
  std::size_t style(const std::string& label) {
    const auto known = std::ranges::find(labels_, label);
    if (known != labels_.end()) return std::size_t(known - labels_.begin());
    labels_.push_back(label);
    return labels_.size() - 1;
  }

  Json figure(const char* kind, const std::string& title, const Json& row) const {
    return {{"kind", kind},
            {"title", title},
            {"experiment", own_.experiment},
            {"case", text_at(row, "/case/name")},
            {"resolution", text_at(row, "/resolution")},
            {"log_x", false},
            {"log_y", false},
            {"zero_y", false},
            {"lines", false},
            {"front", false},
            {"series", Json::array()}};
  }

  Json& series(Json& figure, const std::string& label) {
    for (Json& one : figure["series"])
      if (one["label"] == label) return one;
    figure["series"].push_back({{"label", label}, {"style", style(label)}, {"points", Json::array()}});
    return figure["series"].back();
  }

  static void name_axes(Json& figure, const std::string& x, const std::string& y) {
    figure["x_label"] = x;
    figure["y_label"] = y;
  }

  void add_plot(const Plot& plot) {
    const std::vector<Curve> curves = curves_of(plot, own_.rows);
    if (curves.empty()) return;
    Json made = figure(plot.categories ? "dots" : "curves", plot.title, Json::object());
    made["case"] = plot.case_name;
    if (plot.resolution != 0) made["resolution"] = std::to_string(plot.resolution);
    // What is compared lies along x in a figure of dots.
    plot.categories ? name_axes(made, plot.y_label, "") : name_axes(made, plot.x_label, plot.y_label);
    made["log_x"] = plot.categories ? plot.log_y : plot.log_x;
    made["log_y"] = !plot.categories && plot.log_y;
    made["zero_y"] = !plot.log_y;
    if (!plot.note.empty()) made["note"] = plot.note;
    made["lines"] = true;
    for (const Curve& curve : curves)
      for (const CurvePoint& at : curve.points) {
        const Json& row = own_.rows[at.row];
        if (plot.categories)
          series(made, text_at(row, plot.by_variant ? "/variant/name" : "/variant/label"))["points"].push_back(
              point(row, at.y, 0.0, {at.low, at.high}));
        else
          series(made, curve.label)["points"].push_back(point(row, at.x, at.y, {at.low, at.high}));
      }
    figures_.push_back(std::move(made));
  }

  bool is_shown_by_a_plot(const Json& row) const {
    return std::ranges::any_of(own_.plots, [&](const Plot& plot) {
      return plot.x == "triangles" && plot.y == std::vector<std::string>{"to_rms"} &&
             (plot.case_name.empty() || plot.case_name == text_at(row, "/case/name")) &&
             (plot.resolution == 0 || std::to_string(plot.resolution) == text_at(row, "/resolution"));
    });
  }

  void add_triangles_and_error(const std::vector<Json>& rows, const std::vector<Json>& all) {
    if (is_shown_by_a_plot(rows.front())) return;
    Json made = figure("curves", "Triangles and distance to the input, " + subject(rows.front(), all, true),
                       rows.front());
    name_axes(made, "triangles", "rms distance to the input [voxel]");
    made["log_x"] = made["log_y"] = made["front"] = true;
    std::size_t points = 0;
    for (const Json& row : rows) {
      const auto triangles = number_of("triangles", row), error = number_of("to_rms", row);
      if (!triangles || !error || *triangles <= 0.0 || *error <= 0.0) continue;
      series(made, text_at(row, "/variant/name"))["points"].push_back(point(row, *triangles, *error));
      ++points;
    }
    if (points > 1) figures_.push_back(std::move(made));
  }

  bool shows_seconds(const std::vector<Json>& rows) const {
    return std::ranges::any_of(shown_columns(rows),
                               [](const Column& column) { return column.name == "seconds"; });
  }

  /// @return whether there are two sizes to draw a line between.
  bool add_scaling(const std::vector<Json>& rows, const std::vector<Json>& all) {
    if (!shows_seconds(rows)) return false;
    const bool voxels = std::ranges::all_of(
        rows, [](const Json& row) { return find(row, "/failed") || number_of("active_voxels", row); });
    Json made = figure("curves", "Time and size, " + subject(rows.front(), all, false), rows.front());
    made["resolution"] = "";
    name_axes(made, voxels ? "active voxels" : "resolution", "time [s]");
    made["log_x"] = made["log_y"] = made["lines"] = true;
    std::map<std::string, std::set<double>> sizes;
    for (const Json& row : rows) {
      const auto seconds = number_of("seconds", row);
      const double x = voxels ? number_of("active_voxels", row).value_or(0.0) : number_at(row, "/resolution");
      if (!seconds || *seconds <= 0.0 || x <= 0.0) continue;
      const std::string label = text_at(row, "/variant/label");
      series(made, label)["points"].push_back(point(row, x, *seconds, spread(row)));
      sizes[label].insert(x);
    }
    if (std::ranges::none_of(sizes, [](const auto& own) { return own.second.size() > 1; })) return false;
    for (Json& one : made["series"])
      std::sort(one["points"].begin(), one["points"].end(),
                [](const Json& a, const Json& b) { return a[1] < b[1]; });
    const bool drawn = std::ranges::any_of(own_.plots, [&](const Plot& plot) {
      return plot.x == "active_voxels" && plot.y.front() == "seconds" &&
             (plot.case_name.empty() || plot.case_name == text_at(rows.front(), "/case/name"));
    });
    if (!drawn) figures_.push_back(std::move(made));
    return true;
  }

  void add_times(const std::vector<Json>& rows, const std::vector<Json>& all) {
    if (!shows_seconds(rows)) return;
    Json made = figure("dots", "Time, " + subject(rows.front(), all, true), rows.front());
    name_axes(made, "time [s], median with the shortest and the longest repetition", "");
    made["log_x"] = true;
    for (const Json& row : rows)
      if (const auto seconds = number_of("seconds", row); seconds && *seconds > 0.0)
        series(made, text_at(row, "/variant/label"))["points"].push_back(
            point(row, *seconds, 0.0, spread(row)));
    if (made["series"].size() > 1) figures_.push_back(std::move(made));
  }

  void add_intervals(const std::vector<Json>& rows) {
    const std::vector<Column> columns = own_columns(rows.front());
    for (const Column& column : columns) {
      const bool is_end = column.name.ends_with("_low") || column.name.ends_with("_high");
      const bool has_ends =
          std::ranges::find(columns, column.name + "_low", &Column::name) != columns.end() &&
          std::ranges::find(columns, column.name + "_high", &Column::name) != columns.end();
      if (is_end || (!has_ends && column.name.find("slope") == std::string::npos)) continue;
      Json made = figure("dots", group_title(rows.front()) + ", " + column.header, rows.front());
      name_axes(made, column.header + (has_ends ? " with its interval" : ""), "");
      for (const Json& row : rows)
        if (const auto value = number_of(columns, column.name, row))
          series(made, text_at(row, "/variant/label"))["points"].push_back(
              point(row, *value, 0.0,
                    {number_of(columns, column.name + "_low", row),
                     number_of(columns, column.name + "_high", row)}));
      if (!made["series"].empty()) figures_.push_back(std::move(made));
    }
  }

  const PlottedRows& own_;
  std::vector<std::string> labels_;
  Json figures_ = Json::array();
};

}  // namespace

std::size_t page_row(const Json& row) { return row.at(kPageRow).get<std::size_t>(); }

Json figures_of(const std::vector<Json>& rows) {
  Json figures = Json::array();
  for (const PlottedRows& own : plotted_rows(rows))
    for (Json& figure : Figures(own).made()) figures.push_back(std::move(figure));
  return figures;
}

}  // namespace hermesh
