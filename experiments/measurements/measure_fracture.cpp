// The books of fractures by all methods, and their times: figures 9.15 and 9.16 of the thesis.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "algorithms/fracture/scatter.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/fracture/fracture_folder.h"
#include "experiments/fracture/fracture_subjects.h"
#include "experiments/fracture/fracture_tags.h"
#include "experiments/harness/cell.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pictures/exploded.h"

namespace hermesh {
namespace {

struct Range {
  double least = std::numeric_limits<double>::infinity(), greatest = 0.0;
  /// What was not done took no time, and does not count.
  void add(double x) {
    if (x <= 0) return;
    least = std::min(least, x), greatest = std::max(greatest, x);
  }
  std::string in_milliseconds() const {
    if (greatest == 0.0) return "–";
    std::ostringstream text;
    text.precision(3);
    text << 1000 * least << "–" << 1000 * greatest;
    return text.str();
  }
};

/// A method as a row names it: the thesis's by either rule.
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
  /// What each method calls its tolerance (FractureMethod); OpenVDB's adaptivity is something else, so it
  /// runs at its finest.
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

  CutterSpec spec(std::size_t count) const {
    return parse_cutters(input_.parameters.text("cutters") + ":" + std::to_string(count));
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
    const MadeCutters cutters = make_cutters(spec(count), object.hermite, choices, child);
    std::string name = subject.source + "-" + std::to_string(count) + "-" + named.label;
    std::ranges::replace(name, ' ', '-');
    if (tolerance > 0) name += "-" + readable(tolerance);
    std::filesystem::remove_all(input_.out / name);
    FractureFolder folder(input_.out / name);
    Range conversion, csg, extraction;
    double volume = 0.0;
    // Displaced walls are known only where they are sought; those of plain cells in closed form.
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
    const validation::FractureLedger ledger = folder.judge(
        child, uncut_, reach_of_pieces(object, {.tolerance = tolerance, .options = {}}, summary));
    // The printed pieces are kept, too, for their picture.
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
    // Without tags what is no seam counts as original, and the difference says nothing.
    if (ledger.gaps_can_be_judged) {
      values["unmatched"] = ledger.unmatched_cut;
      values["volume"] = ledger.volume_difference();
    }
    if (summary.labelled) add_stages(values, child, double(ledger.pieces));
    if (summary.labelled) values["changed"] = summary.labelled->repair.changed_samples;
    if (method == "labelled" && !ledger.balances()) row.broken = ledger.sentences();
    if (tagged) add_tags(row.label, tags.counts());
  }

  void add_tags(const std::string& label, const TagCounts& tags) {
    tag_rows_.push_back({"tags",
                         label,
                         {{"polygons", tags.polygons},
                          {"left_out", 100.0 * tags.share_left_out()},
                          {"precision", 100.0 * tags.precision()},
                          {"recall", 100.0 * tags.recall()}}});
  }

  /// All pieces go through these stages together; each has an even share.
  static void add_stages(Json& values, const RunContext& context, double pieces) {
    const auto share = [&](std::initializer_list<const char*> names) {
      double sum = 0.0;
      for (const auto& [stage, seconds] : context.stage_seconds)
        if (std::ranges::count(names, stage) > 0) sum += seconds;
      std::ostringstream text;
      text.precision(3);
      text << 1000 * sum / pieces;
      return text.str();
    };
    values["csg"] = share(
        {"blocks of the solid", "label samples", "find pieces", "repair labels", "crossings of the cuts"});
    values["extraction"] = share({"find cells", "place points", "let points leave", "connect", "quadrics",
                                  "decimate", "certify", "sides of the triangles"}) +
                           " + " + values["extraction"].get<std::string>();
  }

  /// How fast what the cuts take from the uncut volume falls with the size of voxels.
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
    for (const int resolution : kResolutions) {
      RunContext child = child_context(input_.context, false);
      const FractureObject object = sampled(mesh, resolution);
      CutterChoices choices;
      choices.seed = input_.seed;
      // Seeds as scattered at the coarsest, so that the cuts are the same.
      if (!order_cutters_) order_object_ = object.hermite, order_cutters_ = true;
      const LabelledSolid solid = whole_solid(order_object_, child);
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
  bool order_cutters_ = false;
  FloatHermite order_object_;
  std::vector<MeasuredRow> rows_, tag_rows_;
};

std::vector<MeasuredColumn> ledger_columns() {
  return {
      {"pieces", "pieces", "with a surface"},
      {"triangles", "triangles", "of all pieces"},
      {"seams", "seams", "triangles that stand reversed in exactly one other piece"},
      {"unmatched", "no other side", "triangles tagged cut without one"},
      {"open", "open", "open edges of the original surface of all pieces together"},
      {"crossing", "crossing", "intersecting pairs of triangles of all pieces, each seam once"},
      {"nested", "nested", "components inside another piece"},
      {"broken", "broken", "pieces not closed, manifold, oriented and free of self-intersection"},
      {"volume", "Δ volume",
       "between the sum of the pieces' volumes and that within the original surface, relative"},
      {"uncut", "Δ uncut", "sum of the pieces' volumes less that of the uncut mesh, relative"},
      {"lost_crossings", "lost",
       "crossings that the thesis's 10 bytes lose in all pieces, which leave holes"},
      {"needless_crossings", "needless",
       "data that eq. 7.1 leaves between samples of one sign, which are polygons that bound nothing"},
      {"escaped", "escaped", "points outside their cell or region"},
      {"changed", "changed", "samples that changed their piece so that all are manifold"},
      {"seconds", "time [s]", "of the fracture, the object's Hermite data and writing left out"},
      {"object", "object [s]", "the object's Hermite data"},
      {"conversion", "conversion [ms]", "least and greatest of a cutter; 9.15: 874–3120, 9.16: 1030–5840"},
      {"csg", "CSG [ms]",
       "of a piece; 9.15: 80–190, 9.16: 215–714; labelled: a piece's share of labels and crossings"},
      {"extraction", "extraction [ms]",
       "of a piece; 9.15: 450–779; labelled: a piece's share of the joint mesh, and taking it out of that"}};
}

std::vector<MeasuredColumn> tag_columns() {
  return {
      {"polygons", "polygons", "of all pieces"},
      {"left_out", "at rims [%]", "left out: their middle is within a voxel of the input and of a wall"},
      {"precision", "precision [%]", "of the polygons tagged cut, those nearer to a wall than to the input"},
      {"recall", "recall [%]", "of the polygons nearer to a wall, those tagged cut"}};
}

}  // namespace

Measurement fracture_measurement() {
  return {
      .name = "fracture",
      .summary = "the books of fractures by all methods, and their times",
      .parameters =
          {{"cases", "all", "all, or one", {"all", "dragon", "fandisk", "noise-sphere-1m", "armadillo"}},
           {"pieces", "20", "numbers of cells", {"2", "20", "50", "200", "2 20", "2 20 200"}},
           {"tolerances", "0", "of the method labelled, voxels", {"0", "0.2", "1", "0 0.2", "0 0.2 1"}},
           {"thesis_tolerances",
            "0 0.3",
            "of the method thesis: roots of its threshold, voxels",
            {"0", "0.3", "0 0.3"}},
           {"voxelizer",
            "hermesh",
            "that the object's signs are from; thesis is chapter 5",
            {"hermesh", "thesis"}},
           {"cutters", "voronoi", "cells with plane or rough walls", {"voronoi", "chunks"}},
           {"scale", "1", "of the resolutions", {}, 0.05, 4.0},
           {"order", "yes", "whether the order of the volume's difference is measured", {"yes", "no"}}},
      .tables = {{"ledger", "do the books balance?", "object, cells, method", ledger_columns()},
                 {"order",
                  "what the cuts take from the volume of the uncut mesh",
                  "object, cells, voxels",
                  {{"difference", "difference", "relative"},
                   {"order", "order", "exponent of the voxel size, from the row above"}}},
                 {"tags", "are polygons tagged as what they are?", "object, cells, method", tag_columns()}},
      .measure = [](const MeasurementInput& input) { return FractureBooks(input).run(); }};
}

}  // namespace hermesh
