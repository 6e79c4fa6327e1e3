// The methods of fracture against one another, interleaved, so that a slow minute of the machine hits all
// alike.
#include <algorithm>

#include "experiments/fracture/fracture_subjects.h"
#include "experiments/harness/cell.h"
#include "experiments/measure.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

constexpr const char* kFractureWays[] = {"labelled", "thesis", "openvdb"};

MeasuredRow race_of(const FractureSubject& subject, std::size_t pieces, const MeasurementInput& input) {
  RunContext child = child_context(input.context, false);
  const PolygonMesh mesh = load_subject(subject, input);
  const FractureObject object =
      sample_subject(mesh, input.parameters.number("scale") * subject.longest, input).object;
  CutterChoices choices;
  choices.seed = input.seed;
  const MadeCutters cutters =
      make_cutters(parse_cutters("voronoi:" + std::to_string(pieces)), object.hermite, choices, child);
  MeasuredRow row{"speed", subject.label + ", " + std::to_string(pieces), Json::object()};
  std::vector<Contender> contenders;
  for (const char* method : kFractureWays)
    contenders.push_back({.run =
                              [&, method] {
                                const FractureSummary summary = run_fracture(
                                    object, cutters, {.name = method, .options = {}}, [](PieceOutput&&) {},
                                    child);
                                row.values[std::string(method) + "_pieces"] = summary.pieces;
                                return summary.seconds;
                              },
                          .budget_seconds = input.parameters.number("budget"),
                          .repetitions = static_cast<int>(input.parameters.number("rounds")),
                          .seconds = {}});
  race(contenders);
  for (std::size_t i = 0; i < contenders.size(); ++i) {
    const std::string method = kFractureWays[i];
    row.values[method] = median(contenders[i].seconds);
    row.values[method + "_least"] = std::ranges::min(contenders[i].seconds);
  }
  row.values["rounds"] = contenders.back().seconds.size();
  row.values["openvdb_over_labelled"] =
      row.values["openvdb"].get<double>() / row.values["labelled"].get<double>();
  return row;
}

std::vector<MeasuredRow> measure_fracture_speed(const MeasurementInput& input) {
  std::vector<MeasuredRow> rows;
  const auto pieces = static_cast<std::size_t>(input.parameters.number("pieces"));
  for (const FractureSubject& subject : fracture_subjects()) {
    const std::string label = subject.label + ", " + std::to_string(pieces);
    if (!input.wants("speed", label)) continue;
    input.context.progress(label, 0.0);
    if (const auto failure = attempt([&] { rows.push_back(race_of(subject, pieces, input)); }))
      rows.push_back({"speed", label, Json::object(), {*failure}});
  }
  return rows;
}

std::vector<MeasuredColumn> fracture_speed_columns() {
  return {{"labelled", "labelled [s]",
           "median; the object's Hermite data and writing left out, as everywhere here"},
          {"labelled_least", "least", "of the rounds"},
          {"thesis", "thesis [s]", "median, by the printed rule, cutters' Hermite data included"},
          {"thesis_least", "least", "of the rounds"},
          {"openvdb", "OpenVDB [s]", "median, cutters' level sets included, their polygons left out"},
          {"openvdb_least", "least", "of the rounds"},
          {"openvdb_over_labelled", "OpenVDB / labelled", "of the medians"},
          {"rounds", "rounds", "of OpenVDB, the others interleaved with it"},
          {"labelled_pieces", "pieces", "of labelled, parts that hang together nowhere being several"},
          {"thesis_pieces", "of thesis", "pieces, one a cutter"},
          {"openvdb_pieces", "of OpenVDB", "pieces"}};
}

}  // namespace

Measurement fracture_speed_measurement() {
  return {.name = "fracture_speed",
          .summary = "times of the methods of fracture, interleaved",
          .parameters = {{"pieces", "50", "cells with plane walls", {}, 2, 1000},
                         {"scale", "1", "of the resolutions", {}, 0.05, 4.0},
                         {"rounds", "3", "repetitions", {}, 1, 100},
                         {"budget", "600", "seconds that a method may use up", {}, 1, 1e6}},
          .tables = {{"speed", "how long does a fracture take?", "object, cells", fracture_speed_columns()}},
          .measure = measure_fracture_speed};
}

}  // namespace hermesh
