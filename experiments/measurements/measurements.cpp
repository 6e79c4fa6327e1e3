#include "experiments/measurements/measurements.h"

#include <toml++/toml.h>

#include <map>

#include "experiments/cases/cases.h"

namespace hermesh {
namespace {

const std::map<std::string, Measure*>& functions() {
  static const std::map<std::string, Measure*> table = {{"normal-codes", measure_normal_codes},
                                                        {"lost-crossings", measure_lost_crossings},
                                                        {"bounded", measure_bounded},
                                                        {"hermite-memory", measure_hermite_memory},
                                                        {"hermite-csg", measure_hermite_csg},
                                                        {"hermite-speed", measure_hermite_speed},
                                                        {"table-9-2", measure_table_9_2},
                                                        {"tables-9-3-and-9-4", measure_tables_9_3_and_9_4},
                                                        {"volumes", measure_volumes},
                                                        {"guarantee", measure_guarantee},
                                                        {"fracture", measure_fracture},
                                                        {"fracture_speed", measure_fracture_speed},
                                                        {"fracture_guarantee", measure_fracture_guarantee},
                                                        {"digests", measure_digests},
                                                        {"figure-9-1", measure_figure_9_1},
                                                        {"figure-9-3", measure_figure_9_3},
                                                        {"figure-9-4", measure_figure_9_4},
                                                        {"figure-9-6", measure_figure_9_6},
                                                        {"threads", measure_threads},
                                                        {"sampling", measure_sampling},
                                                        {"surface-noise", measure_surface_noise},
                                                        {"order", measure_order},
                                                        {"arithmetic", measure_arithmetic},
                                                        {"boolean-rule", measure_boolean_rule}};
  return table;
}

std::string text(const toml::node& node) { return node.value<std::string>().value(); }

OptionSpec parameter_of(const toml::array& entry) {
  OptionSpec parameter{text(entry[0]), text(entry[1]), text(entry[2])};
  const toml::array& range = *entry[3].as_array();
  if (range[0].is_number()) {
    parameter.minimum = range[0].value<double>().value();
    parameter.maximum = range[1].value<double>().value();
    return parameter;
  }
  for (const toml::node& choice : range)
    if (text(choice) == "<cases>")
      std::ranges::copy(case_choices(), std::back_inserter(parameter.choices));
    else
      parameter.choices.push_back(text(choice));
  return parameter;
}

/// `sets`: lists of columns that several tables share, by name.
void add_columns(const toml::array& list, const toml::table& sets, std::vector<MeasuredColumn>& columns) {
  for (const toml::node& each : list)
    if (each.is_string())
      add_columns(*sets.at(text(each)).as_array(), sets, columns);
    else
      columns.push_back(
          {text((*each.as_array())[0]), text((*each.as_array())[1]), text((*each.as_array())[2])});
}

/// @throws std::exception for a file that cannot be parsed or lacks a key.
std::vector<Measurement> read_measurements(const std::filesystem::path& path) {
  const toml::table document = toml::parse_file(path.string());
  std::vector<Measurement> result;
  for (const toml::node& node : *document.at("measurement").as_array()) {
    const toml::table& entry = *node.as_table();
    Measurement& measurement = result.emplace_back();
    measurement.name = text(entry.at("name"));
    measurement.measure = functions().at(measurement.name);
    for (const toml::node& each : *entry.at("parameters").as_array())
      measurement.parameters.push_back(parameter_of(*each.as_array()));
    for (const toml::node& each : *entry.at("table").as_array()) {
      const toml::table& table = *each.as_table();
      measurement.tables.push_back({.name = text(table.at("name")),
                                    .title = text(table.at("title")),
                                    .first_column = text(table.at("rows")),
                                    .columns = {},
                                    .printed = !table["plotted_only"].value_or(false),
                                    .additive = table["additive"].value_or(false)});
      add_columns(*table.at("columns").as_array(), *document.at("columns").as_table(),
                  measurement.tables.back().columns);
    }
  }
  return result;
}

}  // namespace

std::span<const Measurement> all_measurements() {
  static const std::vector<Measurement> table = read_measurements(experiments_folder() / "measurements.toml");
  return table;
}

}  // namespace hermesh
