// Figures 9.4 and 9.5 of the thesis: a statue as a level set of 200 and of 1586 voxels.
#include <algorithm>
#include <array>
#include <cmath>

#include "experiments/cases/cases.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/level_set_facts.h"
#include "experiments/harness/run_cells.h"
#include "experiments/measure.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pictures/render.h"
#include "experiments/pipeline.h"

namespace hermesh {
namespace {

constexpr std::array<const char*, 2> kVoxelizers = {"thesis", "hermesh"};

/// The Thai Statue where its file is at hand, else the stand-in that the parameter names.
LoadedCase load_statue(const MeasurementInput& input) {
  return input.tables.load(
      is_at_hand("thai-statue", input.context) ? "thai-statue" : input.parameters.text("stand_in"),
      input.context);
}

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
    statue_ = load_statue(input_);
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
    // One voxel of band on either side, as table 9.1's dimensions have it.
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
    validation::JudgeOptions options;
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
    // Two printed rows of table 9.1 belong to the figures.
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

std::vector<MeasuredRow> measure_figure_9_4(const MeasurementInput& input) {
  return Figure94Measurer(input).run();
}

}  // namespace

Measurement figure_9_4_measurement() {
  return {.name = "figure-9-4",
          .summary = "a statue as a level set at two resolutions, rendered (figures 9.4 and 9.5)",
          .parameters = {{"coarse", "200", "voxels along the longest side, figure 9.4", {}, 8, 20000},
                         {"fine", "1586", "the same, figure 9.5", {}, 8, 20000},
                         {"stand_in", "dragon", "model where xyzrgb_statuette.ply is not in the data folder",
                          case_choices()},
                         {"samples", "50000", "on each surface, for the distances", {}, 100, 1e8},
                         {"pixels", "400", "width of a picture; 0 draws none", {}, 0, 4000}},
          .tables = {{"statue",
                      "level sets of the statue",
                      "voxelizer, voxels",
                      {{"origin", "origin", "the model and where it comes from"},
                       {"source_triangles", "of", "triangles of the model"},
                       {"dimensions", "voxels", "dimensions of the active voxels' box"},
                       {"active", "active voxels", "of the level set, half width 1.5"},
                       {"seconds", "time [s]", "to voxelize, one run"},
                       {"printed_seconds", "printed [s]", "figure's time: 16 cores of 2011, another model"},
                       {"triangles", "triangles", "of the zero set by marching cubes"},
                       {"lost_rms", "from rms [vx]",
                        "root mean square distance from the model to the zero set, voxels"},
                       {"lost_rms_share", "of the size", "the same over the model's longest side"},
                       {"open", "open", "boundary edges of the zero set"},
                       {"components", "components", "of the zero set"}}}},
          .measure = measure_figure_9_4};
}

}  // namespace hermesh
