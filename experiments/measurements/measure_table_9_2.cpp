// Table 9.2 of the thesis: what the threshold of adaptive dual contouring does to a large level set.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "experiments/harness/cell.h"
#include "experiments/harness/run_cells.h"
#include "experiments/measure.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pictures/render.h"
#include "experiments/pipeline.h"

namespace hermesh {
namespace {

/// What the thesis printed for its new method.
struct Printed {
  double threshold, points, polygons, seconds;
};
constexpr Printed kPrinted[] = {{0, 7'918'578, 7'918'809, 14.61},   {50, 1'889'460, 2'185'352, 13.93},
                                {150, 1'138'554, 1'320'249, 11.40}, {250, 900'261, 1'043'377, 10.82},
                                {500, 672'221, 778'715, 10.20},     {2000, 370'424, 427'738, 9.24}};

/// The old method of the table, Houdini's, and the thresholds whose meshes figures 9.8 to 9.10 show.
constexpr Printed kPrintedOld{0, 7'857'493, 7'873'279, 32.38};
constexpr double kDrawn[] = {50, 500, 2000};
constexpr const char* kOldLabel = "openvdb";

/// The Happy Buddha as the thesis had it if the user has that, else decimated, else the dragon.
LoadedCase load_model(const MeasurementInput& input) {
  if (!input.parameters.is("case", "happy-buddha"))
    return input.tables.load(input.parameters.text("case"), input.context);
  if (is_at_hand("happy-buddha-full", input.context))
    return input.tables.load("happy-buddha-full", input.context);
  LoadedCase decimated = input.tables.load("happy-buddha", input.context);
  return decimated.origin.starts_with("stand-in") ? input.tables.load("dragon", input.context) : decimated;
}

LevelSet level_set_of(const LoadedCase& model, const MeasurementInput& input) {
  return voxelize(model.mesh,
                  {.chosen = choose(input.tables.voxelizers, "hermesh"),
                   .resolution = input.parameters.number("resolution")},
                  input.context);
}

std::string input_label(const LoadedCase& model) {
  return std::filesystem::path(model.name).filename().string() + ", " + model.origin;
}

MeasuredRow input_row(const LoadedCase& model, const LevelSet& level_set) {
  const auto dimensions = level_set.dimensions();
  std::string text;
  for (const int width : dimensions) text += (text.empty() ? "" : " × ") + std::to_string(width);
  MeasuredRow row{"input", input_label(model)};
  row.values["triangles"] = model.mesh.triangle_count();
  row.values["dimensions"] = text;
  row.values["active"] = level_set.active_voxels();
  return row;
}

/// The counts of a mesh made of polygons of three and four corners, whose triangles are 2(F − V) if it is
/// closed.
void set_counts(Json& values, double points, double polygons, double finest, const std::string& prefix) {
  values[prefix + "points"] = points;
  values[prefix + "polygons"] = polygons;
  values[prefix + "triangle_share"] = 100.0 * 2.0 * (polygons - points) / polygons;
  values[prefix + "reduction"] = finest / points;
}

class Extraction {
 public:
  Extraction(const LevelSet& level_set, const std::string& representation, const MeasurementInput& input)
      : level_set_(level_set), representation_(representation), input_(input) {}

  /// The rows that are wanted, and always the first, which the others are set against.
  std::vector<MeasuredRow> rows(const std::function<bool(const std::string& label)>& wanted) {
    std::vector<MeasuredRow> rows;
    for (const Printed& printed : kPrinted)
      if (printed.threshold == 0 || wanted(readable(printed.threshold))) rows.push_back(row(printed));
    return rows;
  }
  const validation::MeshReport& uniform() const { return *uniform_; }
  /// The meshes of figures 9.8 to 9.10.
  std::vector<Picture> pictures() { return std::move(pictures_); }

 private:
  MeasuredRow row(const Printed& printed) {
    const double threshold = printed.threshold / input_.parameters.number("units_per_square_voxel");
    const ExtractRecipe recipe{.chosen = choose(input_.tables.extractors, "adaptive-dual-contouring",
                                                {{"threshold", std::to_string(threshold)},
                                                 {"representation", representation_},
                                                 {"hermite", "level-set"}})};
    std::vector<double> seconds;
    RunContext child;
    std::optional<std::int64_t> peak;
    PolygonMesh mesh;
    for (int run = 0; run < int(input_.parameters.number("repetitions")); ++run) {
      input_.context.check();
      mesh = {};
      child = child_context(input_.context, false);
      const PeakMemory memory;
      seconds.push_back(timed([&] { mesh = extract(level_set_, nullptr, recipe, child).mesh; }));
      if (run == 0) peak = memory.bytes();
    }
    MeasuredRow made = describe(printed, threshold, mesh, child, median(seconds), peak);
    if (input_.parameters.number("pixels") > 0 &&
        std::ranges::find(kDrawn, printed.threshold) != std::end(kDrawn))
      pictures_.push_back(
          {"threshold " + readable(printed.threshold),
           {std::to_string(mesh.points.size()) + " points, printed " + readable(printed.points),
            readable(median(seconds)) + " s, printed " + readable(printed.seconds) + " s"},
           [mesh = std::move(mesh)] { return mesh; }});
    return made;
  }

  MeasuredRow describe(const Printed& printed, double threshold, const PolygonMesh& mesh,
                       const RunContext& context, double seconds, const std::optional<std::int64_t>& peak) {
    const auto points = double(mesh.points.size()),
               polygons = double(mesh.quads.size() + mesh.triangles.size());
    if (printed.threshold == 0) {
      finest_ = points;
      judge_uniform(mesh);
    }
    MeasuredRow row{representation_, readable(printed.threshold)};
    row.values["threshold"] = threshold;
    set_counts(row.values, points, polygons, finest_, "");
    row.values["share_made"] = 100.0 * double(mesh.triangles.size()) / polygons;
    row.values["seconds"] = seconds;
    row.values["peak"] = optional_json(peak);
    if (peak) row.values["peak"] = double(*peak) / (1 << 20);
    for (const auto& [name, value] : context.figures)
      if (name == "largest_plane_distance" || name == "escaped" || name == "lost_crossings")
        row.values[name] = value;
    set_counts(row.values, printed.points, printed.polygons, kPrinted[0].points, "printed_");
    row.values["printed_seconds"] = printed.seconds;
    return row;
  }

  /// Other counts than those of the judges would need more memory than the mesh itself.
  void judge_uniform(const PolygonMesh& mesh) {
    RunContext child = child_context(input_.context, true);
    uniform_ = judge(to_mesh_file(mesh), {}, kCounts, child).report;
  }

  const LevelSet& level_set_;
  const std::string representation_;
  const MeasurementInput& input_;
  double finest_ = 0.0;
  std::optional<validation::MeshReport> uniform_;
  std::vector<Picture> pictures_;
};

/// OpenVDB's mesher, which stands in for the old method, on the same level set; `first` is the new method's
/// row at threshold 0.
MeasuredRow old_method_row(const LevelSet& level_set, const MeasuredRow* first,
                           const MeasurementInput& input) {
  const ExtractRecipe recipe{.chosen = choose(input.tables.extractors, kOldLabel)};
  std::vector<double> seconds;
  std::optional<std::int64_t> peak;
  PolygonMesh mesh;
  for (int run = 0; run < int(input.parameters.number("repetitions")); ++run) {
    input.context.check();
    mesh = {};
    RunContext child = child_context(input.context, false);
    const PeakMemory memory;
    seconds.push_back(timed([&] { mesh = extract(level_set, nullptr, recipe, child).mesh; }));
    if (run == 0) peak = memory.bytes();
  }
  MeasuredRow row{"old-method", kOldLabel};
  row.values = {{"points", mesh.points.size()},
                {"polygons", mesh.quads.size() + mesh.triangles.size()},
                {"seconds", median(seconds)},
                {"printed_points", kPrintedOld.points},
                {"printed_polygons", kPrintedOld.polygons},
                {"printed_seconds", kPrintedOld.seconds},
                {"printed_points_of_new", kPrintedOld.points / kPrinted[0].points},
                {"printed_seconds_of_new", kPrintedOld.seconds / kPrinted[0].seconds}};
  if (peak) row.values["peak"] = double(*peak) / (1 << 20);
  if (first)
    for (const std::string what : {"points", "seconds"})
      row.values[what + "_of_new"] = row.values[what].get<double>() / first->values[what].get<double>();
  return row;
}

/// Figures 9.8 to 9.10.
void draw(std::vector<Picture> pictures, const LoadedCase& model, const LevelSet& level_set,
          const MeasurementInput& input) {
  if (pictures.empty()) return;
  Sheet sheet;
  sheet.title = "Figures 9.8 to 9.10: " + std::filesystem::path(model.name).stem().string();
  sheet.subtitle = model.origin + ", " + std::to_string(level_set.active_voxels()) + " active voxels";
  sheet.frame = bounds(model.mesh);
  sheet.close_up = {{0.5, 0.86, 0.6}, 0.07};
  sheet.cell_pixels = int(input.parameters.number("pixels"));
  sheet.pictures = std::move(pictures);
  render_sheet(input.out / ("figures-9-8-to-9-10-" + input.parameters.text("resolution") + ".png"),
               std::move(sheet), input.context);
}

MeasuredRow topology_row(const std::string& label, const validation::MeshReport& report) {
  MeasuredRow row{"topology", label};
  row.values["difference"] = report.points - report.quads - report.triangles;
  row.values["components"] = report.components;
  row.values["euler"] = report.euler_characteristic;
  row.values["open"] = report.boundary_edges;
  row.values["edges"] = report.non_manifold_edges;
  row.values["vertices"] = report.non_manifold_vertices;
  row.values["genus"] = report.genus ? Json(*report.genus) : Json(nullptr);
  return row;
}

/// What the thesis did to its model, to another one.
void add_beside_row(const std::string& name, const MeasurementInput& input, std::vector<MeasuredRow>& rows) {
  const LoadedCase model = input.tables.load(name, input.context);
  MeasuredRow row{"beside", name + ", " + model.origin};
  if (!input.wants(row.table, row.label)) return;
  const LevelSet level_set = level_set_of(model, input);
  Extraction extraction(level_set, "thesis", input);
  row.values["triangles"] = model.mesh.triangle_count();
  for (const MeasuredRow& at : extraction.rows([](const std::string&) { return true; }))
    if (at.label != readable(0))
      for (const std::string what : {"triangle_share", "reduction"})
        row.values[what + "_" + at.label] = at.values[what];
  rows.push_back(std::move(row));
}

std::vector<MeasuredColumn> beside_columns() {
  std::vector<MeasuredColumn> columns = {{"triangles", "triangles", "of the model"}};
  for (const Printed& printed : kPrinted) {
    if (printed.threshold == 0) continue;
    const std::string at = readable(printed.threshold);
    columns.push_back(
        {"triangle_share_" + at, at + ": triangles [%]", "share of triangles at that threshold"});
    columns.push_back({"reduction_" + at, "reduction", "points at threshold 0 over points"});
  }
  return columns;
}

std::vector<MeasuredRow> measure_table_9_2(const MeasurementInput& input) {
  std::vector<MeasuredRow> rows, topology;
  if (input.parameters.is("beside", "dragons"))
    for (const char* name : {"dragon", "dragon-res2"}) add_beside_row(name, input, rows);
  const LoadedCase model = load_model(input);
  const auto wants = [&](const std::string& representation) {
    return input.wants("topology", representation) ||
           std::ranges::any_of(kPrinted, [&](const Printed& printed) {
             return input.wants(representation, readable(printed.threshold));
           });
  };
  std::vector<std::string> representations = {"thesis", "sparse-float"};
  std::erase_if(representations, [&](const std::string& each) { return !wants(each); });
  LevelSet level_set;
  const bool old = input.wants("old-method", kOldLabel);
  if (old || input.wants("input", input_label(model)) || !representations.empty()) {
    level_set = level_set_of(model, input);
    rows.push_back(input_row(model, level_set));
  }
  for (const std::string& representation : representations) {
    Extraction extraction(level_set, representation, input);
    const auto wanted = [&](const std::string& label) { return input.wants(representation, label); };
    for (MeasuredRow& row : extraction.rows(wanted)) rows.push_back(std::move(row));
    topology.push_back(topology_row(representation, extraction.uniform()));
    if (representation == "thesis") draw(extraction.pictures(), model, level_set, input);
  }
  if (old) {
    const auto first =
        std::ranges::find_if(rows, [](const MeasuredRow& row) { return row.table == "thesis"; });
    rows.push_back(old_method_row(level_set, first == rows.end() ? nullptr : &*first, input));
  }
  MeasuredRow printed{"topology", "printed"};
  printed.values["difference"] = kPrinted[0].points - kPrinted[0].polygons;
  topology.push_back(printed);
  rows.insert(rows.end(), topology.begin(), topology.end());
  return rows;
}

std::vector<MeasuredColumn> extraction_columns() {
  return {{"threshold", "E [vx²]", "our threshold: the printed one over the factor units_per_square_voxel"},
          {"points", "points", "points of the mesh"},
          {"printed_points", "printed", "those of the thesis"},
          {"polygons", "polygons", "triangles and quads"},
          {"printed_polygons", "printed", "those of the thesis"},
          {"triangle_share", "2(F−V)/F [%]", "share of triangles as it follows from points and polygons"},
          {"printed_triangle_share", "printed", "that of the thesis"},
          {"share_made", "triangles [%]", "share of triangles counted"},
          {"reduction", "reduction", "points at threshold 0 over points"},
          {"printed_reduction", "printed", "that of the thesis"},
          {"largest_plane_distance", "plane [vx]",
           "largest distance of a merged region's point to one of its planes"},
          {"escaped", "escaped", "points outside their cell or region"},
          {"lost_crossings", "lost",
           "edge crossings that the 10 bytes lose, which leave holes; none are lost as floats"},
          {"seconds", "time [s]", "median, Hermite data included; nothing is copied to a host"},
          {"printed_seconds", "printed [s]", "16 cores of 2011, of which 60 to 70 % copying to the host"},
          {"peak", "peak [MiB]", "resident memory beyond the level set"}};
}

}  // namespace

Measurement table_9_2_measurement() {
  return {
      .name = "table-9-2",
      .summary = "adaptive dual contouring at the thresholds of table 9.2",
      .parameters = {{"case", "happy-buddha",
                      "model; of the happy Buddha happy_vrip.ply if the data folder has it, and the dragon "
                      "if it has none",
                      case_choices()},
                     {"beside",
                      "none",
                      "the dragon in two triangulations, whose triangles are counted, too",
                      {"none", "dragons"}},
                     {"resolution", "1982", "voxels along its longest side", {}, 8, 20000},
                     {"units_per_square_voxel",
                      "1000",
                      "printed threshold that one square voxel stands for",
                      {},
                      1e-6,
                      1e12},
                     {"repetitions", "3", "timed runs", {}, 1, 100},
                     {"pixels", "420", "width of a picture; 0 draws none", {}, 0, 4000}},
      .tables =
          {{"input",
            "the level set",
            "model",
            {{"triangles", "triangles", "of the model"},
             {"dimensions", "voxels", "dimensions of the active voxels' box"},
             {"active", "active voxels", "of the level set"}}},
           {"thesis", "table 9.2 with Hermite data of 10 bytes a voxel, as printed", "threshold",
            extraction_columns()},
           {"sparse-float", "the same with Hermite data in single precision", "threshold",
            extraction_columns()},
           {"old-method",
            "what stands in for the old method, on the same level set",
            "method",
            {{"points", "points", "points of the mesh"},
             {"printed_points", "printed", "those of the thesis"},
             {"polygons", "polygons", "triangles and quads"},
             {"printed_polygons", "printed", "those of the thesis"},
             {"seconds", "time [s]", "median"},
             {"printed_seconds", "printed [s]", "16 cores of 2011"},
             {"points_of_new", "÷ new points", "points over those of the new method at threshold 0"},
             {"printed_points_of_new", "printed", "the same from the print"},
             {"seconds_of_new", "÷ new time", "time over that of the new method at threshold 0"},
             {"printed_seconds_of_new", "printed", "the same from the print, the copy to a host included"},
             {"peak", "peak [MiB]", "resident memory beyond the level set"}}},
           {"topology",
            "threshold 0: why points less polygons may be odd",
            "Hermite data",
            {{"difference", "V−F", "points less polygons; even for a closed orientable manifold of quads"},
             {"components", "components", "connected components"},
             {"euler", "V−E+F", "Euler characteristic of the polygons as they stand"},
             {"open", "open", "boundary edges"},
             {"edges", "nm e", "non-manifold edges"},
             {"vertices", "nm v", "pinched points: non-manifold vertices"},
             {"genus", "genus", "where the mesh is a closed manifold"}}},
           {"beside", "other models: the share of triangles is the model's", "model", beside_columns()}},
      .measure = measure_table_9_2};
}

}  // namespace hermesh
