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

/// The columns of an interval are not demanded, unlike those that a plot names.
std::optional<double> number_if_known(const std::string& name, const Json& row) {
  for (const Column& column : own_columns(row))
    if (column.name == name) return number_in(name, row);
  return std::nullopt;
}

void add_interval(CurvePoint& point, const std::string& column, const Json& row, double scale) {
  auto low = number_if_known(column + "_low", row), high = number_if_known(column + "_high", row);
  const Json* all = find(row, "/seconds/all");
  if (column == "seconds" && !find(row, "/measurement") && all && all->size() > 1) {
    const auto [shortest, longest] = std::minmax_element(all->begin(), all->end());
    low = shortest->get<double>();
    high = longest->get<double>();
  }
  if (!low || !high) return;
  point.low = scale * *low;
  point.high = scale * *high;
}

bool is_of(const Plot& plot, const Json& row) {
  return (plot.case_name.empty() || text_at(row, "/case/name") == plot.case_name) &&
         (plot.resolution == 0 || row.value("resolution", 0) == plot.resolution);
}

/// Where each label stands on an axis of categories.
std::map<std::string, double> places(const Plot& plot, const std::vector<Json>& rows, const char* who) {
  std::vector<std::pair<double, std::string>> order;
  for (const Json& row : rows) {
    if (!is_of(plot, row)) continue;
    const std::string label = text_at(row, who);
    const double x = number_in(plot.x, row).value_or(0.0);
    const auto known = std::ranges::find(order, label, &std::pair<double, std::string>::second);
    if (known == order.end())
      order.emplace_back(x, label);
    else
      known->first = std::min(known->first, x);
  }
  std::ranges::stable_sort(order, {}, &std::pair<double, std::string>::first);
  std::map<std::string, double> result;
  for (std::size_t i = 0; i < order.size(); ++i) result[order[i].second] = double(i);
  return result;
}

}  // namespace

std::vector<Curve> curves_of(const Plot& plot, const std::vector<Json>& rows) {
  std::vector<Curve> curves;
  const char* const who = plot.by_variant ? "/variant/name" : "/variant/label";
  const std::string first_label = rows.empty() ? "" : text_at(rows.front(), who);
  const std::map<std::string, double> place =
      plot.categories ? places(plot, rows, who) : std::map<std::string, double>();
  const double scale = plot.percent ? 100.0 : 1.0;
  const auto curve = [&](const std::string& label, const std::string& column) -> Curve& {
    const auto known =
        std::find_if(curves.begin(), curves.end(), [&](const Curve& c) { return c.label == label; });
    return known != curves.end() ? *known : curves.emplace_back(Curve{label, column, {}});
  };
  for (std::size_t at = 0; at < rows.size(); ++at) {
    const Json& row = rows[at];
    if (!is_of(plot, row)) continue;
    const std::string label = text_at(row, who);
    const auto x = plot.categories ? std::optional(place.at(label)) : number_in(plot.x, row);
    if (!x || (plot.log_x && !plot.categories && *x <= 0.0)) continue;
    for (std::size_t i = 0; i < plot.y.size(); ++i) {
      const auto y = number_in(plot.y[i], row);
      if (!y || (plot.log_y && *y <= 0.0)) continue;
      if (i > 0 && label != first_label && !plot.categories) continue;
      const bool by_label = i == 0 && !plot.categories;
      CurvePoint point{*x, scale * *y, at};
      add_interval(point, plot.y[i], row, scale);
      curve(by_label ? label : column_of(row, plot.y[i]).header, plot.y[i]).points.push_back(point);
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
