// Figures 9.4 and 9.5 of the thesis: a statue as a level set of 200 and of 1586 voxels.
#include <array>

#include "experiments/harness/facts.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

constexpr std::array<const char*, 2> kVoxelizers = {"thesis", "hermesh"};

class Figure94Measurer {
 public:
  explicit Figure94Measurer(const MeasurementInput& input) : input_(input) {}

  std::vector<MeasuredRow> run() {
    std::vector<double> resolutions = {input_.parameters.number("coarse"), input_.parameters.number("fine")};
    const auto wanted = [&](double resolution) {
      return std::ranges::any_of(
          kVoxelizers, [&](const char* name) { return input_.wants("statue", label(name, resolution)); });
    };
    std::erase_if(resolutions, [&](double resolution) { return !wanted(resolution); });
    if (resolutions.empty()) return {};
    const bool available = is_at_hand("thai-statue", input_.context);
    statue_ =
        input_.tables.load(available ? "thai-statue" : input_.parameters.text("stand_in"), input_.context);
    reference_ = to_mesh_file(statue_.mesh);
    for (const double resolution : resolutions)
      for (const char* name : kVoxelizers)
        if (input_.wants("statue", label(name, resolution))) measure(name, resolution);
    draw();
    return std::move(rows_);
  }

 private:
  static std::string label(const std::string& voxelizer, double resolution) {
    return voxelizer + ", " + readable(resolution);
  }

  void measure(const std::string& name, double resolution) {
    input_.context.check();
    RunContext child = child_context(input_.context, false);
    // One voxel of band on either side, as in the dimensions of table 9.1.
    const VoxelizeRecipe recipe{.chosen = choose(input_.tables.voxelizers, name),
                                .resolution = resolution,
                                .exterior_band = 1.5,
                                .interior_band = 1.5};
    LevelSet level_set;
    const double seconds = timed([&] { level_set = voxelize(statue_.mesh, recipe, child); });
    const ExtractRecipe extraction{.chosen = choose(input_.tables.extractors, "marching-cubes")};
    PolygonMesh mesh = extract(level_set, nullptr, extraction, child).mesh;
    MeasuredRow row{"statue", label(name, resolution)};
    row.values = {{"origin", statue_.name + ", " + statue_.origin},
                  {"source_triangles", statue_.mesh.triangle_count()},
                  {"dimensions", dimensions_of(level_set)},
                  {"active", level_set.active_voxels()},
                  {"seconds", seconds},
                  {"triangles", mesh.triangle_count()}};
    validation::CheckOptions options;
    options.self_intersections = options.libraries = false;
    options.reference = &reference_;
    options.solid_samples = 0;
    options.samples = std::int64_t(input_.parameters.number("samples"));
    const validation::MeshReport report = judge(to_mesh_file(mesh), {}, options, child).report;
    const double voxel = level_set.voxel_size();
    if (report.from_reference) {
      row.values["lost_rms"] = report.from_reference->rms / voxel;
      row.values["lost_rms_share"] = report.from_reference->rms / bounds(statue_.mesh).size().maxCoeff();
    }
    row.values["open"] = report.boundary_edges;
    row.values["components"] = report.components;
    // Two published rows of table 9.1 belong to the figures.
    if (resolution == 200) row.values["printed_seconds"] = 4.09;
    if (resolution == 1586) row.values["printed_seconds"] = 19.93;
    if (input_.parameters.number("pixels") > 0)
      pictures_.push_back({row.label + " voxels",
                           {dimensions_of(level_set), readable(seconds) + " s to voxelize",
                            std::to_string(mesh.triangle_count()) + " triangles"},
                           [mesh = std::move(mesh)] { return mesh; }});
    rows_.push_back(std::move(row));
  }

  void draw() {
    if (pictures_.empty()) return;
    Sheet sheet;
    sheet.title = "Figures 9.4 and 9.5: " + statue_.name + " as a level set";
    sheet.subtitle =
        statue_.origin + "; the zero set, polygonised by marching cubes, each polygon in one tone";
    sheet.frame = bounds(statue_.mesh);
    sheet.close_up = {{0.12, 0.78, 0.62}, 0.2, false};
    sheet.cell_pixels = int(input_.parameters.number("pixels"));
    sheet.columns = int(kVoxelizers.size()) * 2;
    sheet.pictures = std::move(pictures_);
    render_sheet(input_.out / ("figure-9-4-" + statue_.name + ".png"), std::move(sheet), input_.context);
  }

  const MeasurementInput& input_;
  LoadedCase statue_;
  MeshFile reference_;
  std::vector<Picture> pictures_;
  std::vector<MeasuredRow> rows_;
};

}  // namespace

std::vector<MeasuredRow> measure_figure_9_4(const MeasurementInput& input) {
  return Figure94Measurer(input).run();
}

}  // namespace hermesh
