// Table 9.2 of the thesis: adaptive dual contouring of a large level set by threshold.

#include "experiments/harness/facts.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

/// Published values of the new method.
struct Printed {
  double threshold, points, polygons, seconds;
};
constexpr Printed kPrinted[] = {{0, 7'918'578, 7'918'809, 14.61},   {50, 1'889'460, 2'185'352, 13.93},
                                {150, 1'138'554, 1'320'249, 11.40}, {250, 900'261, 1'043'377, 10.82},
                                {500, 672'221, 778'715, 10.20},     {2000, 370'424, 427'738, 9.24}};

/// The old method of the table, Houdini's, and the thresholds of figures 9.8 to 9.10.
constexpr Printed kPrintedOld{0, 7'857'493, 7'873'279, 32.38};
constexpr double kDrawn[] = {50, 500, 2000};
constexpr const char* kOldLabel = "openvdb";

/// Loads the Happy Buddha of the thesis if available, else a decimated one, else the dragon.
LoadedCase load_model(const MeasurementInput& input) {
  if (!input.parameters.is("case", "happy-buddha"))
    return input.tables.load(input.parameters.text("case"), input.context);
  if (is_at_hand("happy-buddha-full", input.context))
    return input.tables.load("happy-buddha-full", input.context);
  LoadedCase decimated = input.tables.load("happy-buddha", input.context);
  return decimated.origin.starts_with("stand-in") ? input.tables.load("dragon", input.context) : decimated;
}

LevelSet level_set_of(const LoadedCase& model, const MeasurementInput& input) {
  return voxelized(model.mesh, {.resolution = input.parameters.number("resolution")}, input);
}

std::string input_label(const LoadedCase& model) {
  return std::filesystem::path(model.name).filename().string() + ", " + model.origin;
}

MeasuredRow input_row(const LoadedCase& model, const LevelSet& level_set) {
  return {"input",
          input_label(model),
          {{"triangles", model.mesh.triangle_count()},
           {"dimensions", dimensions_of(level_set)},
           {"active", level_set.active_voxels()}}};
}

/// Sets the counts of a mesh of triangles and quads, of which 2(F − V) are triangles if it is closed.
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

  /// Returns the wanted rows and always the first, with which the others are compared.
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
    RepeatedExtraction extraction = extract_repeatedly(level_set_, recipe, input_);
    MeasuredRow made = describe(printed, threshold, extraction);
    PolygonMesh& mesh = extraction.mesh;
    if (input_.parameters.number("pixels") > 0 &&
        std::ranges::find(kDrawn, printed.threshold) != std::end(kDrawn))
      pictures_.push_back(
          {"threshold " + readable(printed.threshold),
           {std::to_string(mesh.points.size()) + " points, printed " + readable(printed.points),
            readable(extraction.seconds) + " s, printed " + readable(printed.seconds) + " s"},
           [mesh = std::move(mesh)] { return mesh; }});
    return made;
  }

  MeasuredRow describe(const Printed& printed, double threshold, const RepeatedExtraction& extraction) {
    const PolygonMesh& mesh = extraction.mesh;
    const auto points = double(mesh.points.size()),
               polygons = double(mesh.quads.size() + mesh.triangles.size());
    if (printed.threshold == 0) {
      finest_ = points;
      RunContext child = child_context(input_.context, true);
      uniform_ = judge(to_mesh_file(mesh), {}, kCounts, child).report;
    }
    MeasuredRow row{representation_, readable(printed.threshold)};
    row.values["threshold"] = threshold;
    set_counts(row.values, points, polygons, finest_, "");
    row.values["share_made"] = 100.0 * double(mesh.triangles.size()) / polygons;
    row.values["seconds"] = extraction.seconds;
    row.values["peak"] = extraction.peak ? Json(*extraction.peak) : Json(nullptr);
    for (const auto& [name, value] : extraction.context.figures)
      if (name == "largest_plane_distance" || name == "escaped" || name == "lost_crossings")
        row.values[name] = value;
    set_counts(row.values, printed.points, printed.polygons, kPrinted[0].points, "printed_");
    row.values["printed_seconds"] = printed.seconds;
    return row;
  }

  const LevelSet& level_set_;
  const std::string representation_;
  const MeasurementInput& input_;
  double finest_ = 0.0;
  std::optional<validation::MeshReport> uniform_;
  std::vector<Picture> pictures_;
};

/// Runs OpenVDB's mesher, which stands in for the old method; `first` is the new method's row at threshold 0.
MeasuredRow old_method_row(const LevelSet& level_set, const MeasuredRow* first,
                           const MeasurementInput& input) {
  const ExtractRecipe recipe{.chosen = choose(input.tables.extractors, kOldLabel)};
  const auto [mesh, context, seconds, peak] = extract_repeatedly(level_set, recipe, input);
  MeasuredRow row{"old-method", kOldLabel};
  row.values = {{"points", mesh.points.size()},
                {"polygons", mesh.quads.size() + mesh.triangles.size()},
                {"seconds", seconds},
                {"printed_points", kPrintedOld.points},
                {"printed_polygons", kPrintedOld.polygons},
                {"printed_seconds", kPrintedOld.seconds},
                {"printed_points_of_new", kPrintedOld.points / kPrinted[0].points},
                {"printed_seconds_of_new", kPrintedOld.seconds / kPrinted[0].seconds}};
  if (peak) row.values["peak"] = *peak;
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
  return {"topology",
          label,
          {{"difference", report.points - report.quads - report.triangles},
           {"components", report.components},
           {"euler", report.euler_characteristic},
           {"open", report.boundary_edges},
           {"edges", report.non_manifold_edges},
           {"vertices", report.non_manifold_vertices},
           {"genus", report.genus ? Json(*report.genus) : Json(nullptr)}}};
}

/// Adds a row of the same extraction for another model.
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

}  // namespace

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
  topology.push_back({"topology", "printed", {{"difference", kPrinted[0].points - kPrinted[0].polygons}}});
  rows.insert(rows.end(), topology.begin(), topology.end());
  return rows;
}

}  // namespace hermesh
