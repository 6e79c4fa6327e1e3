// Consistency and times of fractures by all methods: figures 9.15 and 9.16 of the thesis.
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

#include "algorithms/fracture/scatter.h"
#include "experiments/fracture/fracture_folder.h"
#include "experiments/fracture/fracture_subjects.h"
#include "experiments/fracture/fracture_tags.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pictures/exploded.h"

namespace hermesh {
namespace {

std::string three_digits(double milliseconds) {
  std::ostringstream text;
  text.precision(3);
  text << milliseconds;
  return text.str();
}

struct Range {
  double least = std::numeric_limits<double>::infinity(), greatest = 0.0;
  /// Ignores 0, the time of a stage that did not run.
  void add(double x) {
    if (x > 0) least = std::min(least, x), greatest = std::max(greatest, x);
  }
  std::string in_milliseconds() const {
    return greatest == 0.0 ? "–" : three_digits(1000 * least) + "–" + three_digits(1000 * greatest);
  }
};

/// A method with its label; the thesis's by either rule.
struct Named {
  const char *label, *method;
  ThesisFractureOptions::Rule rule = ThesisFractureOptions::Rule::repaired;
};
constexpr std::array<Named, 4> kCutterMethods = {
    {{"labelled", "labelled"},
     {"thesis printed", "thesis", ThesisFractureOptions::Rule::printed},
     {"thesis repaired", "thesis", ThesisFractureOptions::Rule::repaired},
     {"openvdb", "openvdb"}}};

class FractureBooks {
 public:
  explicit FractureBooks(const MeasurementInput& input) : input_(input) {}

  std::vector<MeasuredRow> run() {
    const double scale = input_.parameters.number("scale");
    for (const FractureSubject& subject : fracture_subjects()) {
      if (!input_.parameters.is("cases", "all") && !input_.parameters.is("cases", subject.source)) continue;
      const std::vector<Cell> cells = cells_of(subject);
      if (cells.empty()) continue;
      const PolygonMesh mesh = load_subject(subject, input_);
      const FractureObject object = sampled(mesh, scale * subject.longest);
      tag_oracle_.emplace(triangles_in_voxels(mesh, object.level_set.voxel_size()));
      tag_origin_ = mesh.origin;
      for (const Cell& cell : cells) add_row(subject, object, cell);
    }
    if (input_.parameters.is("order", "yes")) measure_order();
    std::ranges::move(tag_rows_, std::back_inserter(rows_));
    return std::move(rows_);
  }

 private:
  /// Returns the tolerances of a method (FractureMethod); OpenVDB's adaptivity is not a tolerance, so it runs
  /// at its finest.
  std::vector<double> tolerances_of(const std::string& method) const {
    if (method == "openvdb") return {0.0};
    return numbers_in(input_.parameters.text(method == "thesis" ? "thesis_tolerances" : "tolerances"));
  }

  struct Cell {
    std::string label;
    std::size_t count;
    Named method;
    double tolerance;
  };
  /// The cells that the filter leaves.
  std::vector<Cell> cells_of(const FractureSubject& subject) const {
    std::vector<Cell> cells;
    for (const double count : numbers_in(input_.parameters.text("pieces")))
      for (const Named& method : kCutterMethods)
        for (const double tolerance : tolerances_of(method.method)) {
          std::string label = subject.label + ", " + std::to_string(std::size_t(count)) + ", " + method.label;
          if (tolerance > 0) label += " " + readable(tolerance);
          if (input_.wants("ledger", label) || input_.wants("tags", label))
            cells.push_back({label, std::size_t(count), method, tolerance});
        }
    return cells;
  }

  FractureObject sampled(const PolygonMesh& mesh, double longest) {
    RunContext child = child_context(input_.context, false);
    SampledSubject made = sample_subject(mesh, longest, input_, input_.parameters.text("voxelizer"));
    conversion_ = made.hermite_seconds;
    FractureObject object = std::move(made.object);
    uncut_ = uncut_mesh(object, child);
    uncut_volume_ = mass_properties(uncut_).volume;
    return object;
  }

  void add_row(const FractureSubject& subject, const FractureObject& object, const Cell& cell) {
    input_.context.progress(cell.label, 0.0);
    MeasuredRow row{"ledger", cell.label, Json::object()};
    const auto failure = attempt([&] { fill(row, subject, object, cell); });
    if (failure) row.broken.push_back(*failure);
    rows_.push_back(std::move(row));
  }

  void fill(MeasuredRow& row, const FractureSubject& subject, const FractureObject& object,
            const Cell& cell) {
    const auto& [label, count, named, tolerance] = cell;
    const std::string method = named.method;
    RunContext child = child_context(input_.context, false);
    CutterChoices choices;
    choices.seed = input_.seed;
    const std::string spec = input_.parameters.text("cutters") + ":" + std::to_string(count);
    const MadeCutters cutters = make_cutters(parse_cutters(spec), object.hermite, choices, child);
    std::string name = subject.source + "-" + std::to_string(count) + "-" + named.label;
    std::ranges::replace(name, ' ', '-');
    if (tolerance > 0) name += "-" + readable(tolerance);
    std::filesystem::remove_all(input_.out / name);
    FractureFolder folder(input_.out / name);
    Range conversion, csg, extraction;
    double volume = 0.0;
    // Walls of plain cells are known in closed form, displaced ones are not.
    const bool tagged = method != "thesis" && input_.parameters.is("cutters", "voronoi");
    TagJudge tags(*tag_oracle_, tag_origin_, object.level_set.voxel_size(), cutters.seeds);
    const FractureSummary summary = run_fracture(
        object, cutters, {.name = method, .tolerance = tolerance, .options = {}, .rule = named.rule},
        [&](PieceOutput&& piece) {
          conversion.add(piece.conversion_seconds);
          csg.add(piece.csg_seconds);
          extraction.add(piece.extraction_seconds);
          volume += piece.mass.volume;
          if (tagged) tags.add(piece.mesh);
          folder.add(std::move(piece), child);
        },
        child);
    const validation::FractureReport ledger = folder.judge(
        child, uncut_, reach_of_pieces(object, {.tolerance = tolerance, .options = {}}, summary));
    // The printed pieces are also written, for their picture.
    if (method == "labelled" || (method == "thesis" && named.rule == ThesisFractureOptions::Rule::printed))
      folder.commit(
          {{"object", subject.source}, {"seed", input_.seed}}, summary,
          [&](const std::filesystem::path& made) { draw_exploded(made, child); }, child);
    Json& values = row.values;
    values = {{"pieces", ledger.pieces},
              {"triangles", ledger.triangles},
              {"seams", ledger.seam_triangles},
              {"open", ledger.rest_open_edges},
              {"crossing", ledger.intersecting_pairs},
              {"nested", ledger.nested_components},
              {"broken", ledger.broken_pieces},
              {"uncut", volume / uncut_volume_ - 1.0},
              {"seconds", summary.seconds},
              {"object", conversion_},
              {"conversion", conversion.in_milliseconds()},
              {"csg", csg.in_milliseconds()},
              {"extraction", extraction.in_milliseconds()}};
    for (const auto& [figure, value] : child.figures)
      if (figure == "lost_crossings" || figure == "needless_crossings" || figure == "escaped")
        values[figure] = value;
    // Without tags everything but seams counts as original, and the difference is meaningless.
    if (ledger.gaps_checked) {
      values["unmatched"] = ledger.unmatched_cut;
      values["volume"] = ledger.volume_difference();
    }
    if (summary.labelled) add_stages(values, child, double(ledger.pieces));
    if (summary.labelled) values["changed"] = summary.labelled->repair.changed_samples;
    if (method == "labelled" && !ledger.is_valid()) row.broken = ledger.sentences();
    if (tagged)
      tag_rows_.push_back({"tags",
                           row.label,
                           {{"polygons", tags.counts().polygons},
                            {"left_out", 100.0 * tags.counts().share_left_out()},
                            {"precision", 100.0 * tags.counts().precision()},
                            {"recall", 100.0 * tags.counts().recall()}}});
  }

  /// All pieces go through these stages together; each takes an even share.
  static void add_stages(Json& values, const RunContext& context, double pieces) {
    const auto share = [&](std::initializer_list<const char*> names) {
      double sum = 0.0;
      for (const auto& [stage, seconds] : context.stage_seconds)
        if (std::ranges::count(names, stage) > 0) sum += seconds;
      return three_digits(1000 * sum / pieces);
    };
    values["csg"] = share(
        {"blocks of the solid", "label samples", "find pieces", "repair labels", "crossings of the cuts"});
    values["extraction"] = share({"find cells", "place points", "let points leave", "connect", "quadrics",
                                  "decimate", "certify", "sides of the triangles"}) +
                           " + " + values["extraction"].get<std::string>();
  }

  /// Measures the order in the voxel size of the volume that the cuts remove.
  void measure_order() {
    const FractureSubject& subject = fracture_subjects()[1];
    constexpr std::array kResolutions = {50, 100, 200};
    const auto label = [&](int resolution) {
      return subject.label + ", 20, at " + std::to_string(resolution);
    };
    if (std::ranges::none_of(kResolutions, [&](int each) { return input_.wants("order", label(each)); }))
      return;
    const PolygonMesh mesh = load_subject(subject, input_);
    std::optional<double> before;
    std::optional<FloatHermite> coarsest;
    for (const int resolution : kResolutions) {
      RunContext child = child_context(input_.context, false);
      const FractureObject object = sampled(mesh, resolution);
      CutterChoices choices;
      choices.seed = input_.seed;
      // Seeds are scattered at the coarsest resolution, so that the cuts are the same.
      if (!coarsest) coarsest = object.hermite;
      const LabelledSolid solid = whole_solid(*coarsest, child);
      const std::vector<Eigen::Vector3d> seeds = scatter(solid, 20, {choices.seed, {}}, child);
      const MadeCutters cutters{voronoi_cutters(seeds, {}, object.hermite.placement), {}};
      double volume = 0.0;
      run_fracture(
          object, cutters, {}, [&](PieceOutput&& piece) { volume += piece.mass.volume; }, child);
      const double difference = std::abs(volume / uncut_volume_ - 1.0);
      MeasuredRow row{"order", label(resolution), {{"difference", difference}}};
      if (before && difference > 0) row.values["order"] = std::log2(*before / difference);
      before = difference;
      rows_.push_back(std::move(row));
    }
  }

  const MeasurementInput& input_;
  double conversion_ = 0.0, uncut_volume_ = 0.0;
  PolygonMesh uncut_;
  std::optional<DistanceOracle> tag_oracle_;  ///< of the subject's input
  Eigen::Vector3d tag_origin_ = Eigen::Vector3d::Zero();
  std::vector<MeasuredRow> rows_, tag_rows_;
};

}  // namespace

std::vector<MeasuredRow> measure_fracture(const MeasurementInput& input) {
  return FractureBooks(input).run();
}

}  // namespace hermesh
