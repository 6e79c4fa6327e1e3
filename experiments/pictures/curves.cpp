#include "experiments/pictures/curves.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <tuple>

#include "algorithms/core/error.h"
#include "experiments/harness/table.h"

namespace hermesh {
namespace {

Column column_of(const Json& row, const std::string& name) {
  for (const Column& column : own_columns(row))
    if (column.name == name) return column;
  for (const Column& column : all_columns())
    if (column.name == name) return column;
  throw Error("there is no column \"" + name + "\"");
}

std::optional<double> number_in(const std::string& column, const Json& row) {
  const Json value = value_of(column_of(row, column), row);
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

}  // namespace

std::vector<Curve> curves_of(const Plot& plot, const std::vector<Json>& rows) {
  std::vector<Curve> curves;
  const char* const who = plot.by_variant ? "/variant/name" : "/variant/label";
  const std::string first_label = rows.empty() ? "" : text_at(rows.front(), who);
  const auto curve = [&](const std::string& label, const std::string& column) -> Curve& {
    const auto known =
        std::find_if(curves.begin(), curves.end(), [&](const Curve& c) { return c.label == label; });
    return known != curves.end() ? *known : curves.emplace_back(Curve{label, column, {}});
  };
  for (std::size_t at = 0; at < rows.size(); ++at) {
    const Json& row = rows[at];
    if (!plot.case_name.empty() && text_at(row, "/case/name") != plot.case_name) continue;
    if (plot.resolution != 0 && row.value("resolution", 0) != plot.resolution) continue;
    const auto x = number_in(plot.x, row);
    if (!x || (plot.log_x && *x <= 0.0)) continue;
    for (std::size_t i = 0; i < plot.y.size(); ++i) {
      const auto y = number_in(plot.y[i], row);
      if (!y || (plot.log_y && *y <= 0.0)) continue;
      const std::string label = text_at(row, who);
      if (i > 0 && label != first_label) continue;
      auto& points = curve(i == 0 ? label : column_of(row, plot.y[i]).header, plot.y[i]).points;
      points.push_back({*x, plot.percent ? 100.0 * *y : *y, at});
    }
  }
  for (Curve& c : curves)
    std::ranges::sort(c.points, {},
                      [](const CurvePoint& point) { return std::tuple(point.x, point.y, point.row); });
  return curves;
}

std::vector<PlottedRows> plotted_rows(const std::vector<Json>& rows) {
  std::map<std::string, PlottedRows> latest;
  for (const RowGroup& group : latest_groups(rows))
    for (const Json& row : group.rows) latest[text_at(row, "/experiment")].rows.push_back(row);
  std::vector<PlottedRows> result;
  for (auto& [experiment, own] : latest) {
    own.experiment = experiment;
    if (const Json* plots = find(own.rows.back(), "/plots"))
      for (const Json& plot : *plots) own.plots.push_back(plot_from_json(plot));
    result.push_back(std::move(own));
  }
  return result;
}

}  // namespace hermesh
