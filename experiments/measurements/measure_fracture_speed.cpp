// Interleaved timing of the methods of fracture.

#include "experiments/fracture/fracture_subjects.h"
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
  std::vector<std::function<double()>> work;
  for (const char* method : kFractureWays)
    work.push_back([&, method] {
      const FractureSummary summary = run_fracture(
          object, cutters, {.name = method, .options = {}}, [](PieceOutput&&) {}, child);
      row.values[std::string(method) + "_pieces"] = summary.pieces;
      return summary.seconds;
    });
  const auto seconds = race(work, int(input.parameters.number("rounds")), input.parameters.number("budget"));
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    const std::string method = kFractureWays[i];
    row.values[method] = median(seconds[i]);
    row.values[method + "_least"] = std::ranges::min(seconds[i]);
  }
  row.values["rounds"] = seconds.back().size();
  row.values["openvdb_over_labelled"] =
      row.values["openvdb"].get<double>() / row.values["labelled"].get<double>();
  return row;
}

}  // namespace

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

}  // namespace hermesh
