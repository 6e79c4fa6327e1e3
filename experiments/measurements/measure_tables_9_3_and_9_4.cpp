// Tables 9.3 and 9.4 of the thesis, and their figures: a large level set contoured finely only where a camera looks.
#include <openvdb/tools/Composite.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/frustum.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/measure.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pipeline.h"
#include "experiments/cases/recipes.h"
#include "experiments/pictures/render.h"
#include "experiments/harness/run_cells.h"

namespace hermesh {
namespace {

using Outside = AdaptivityField::Outside;

/// What the thesis printed; nothing without a mask in table 9.4.
struct Printed {
  std::optional<double> points, seconds;
};
struct Treatment {
  const char* label;
  Outside outside;
  Printed table_9_3, table_9_4;
};
const Treatment kTreatments[] = {
    {"none", Outside::everywhere, {2'366'433, 10.86}, {}},
    {"max simplification outside", Outside::simplify, {1'227'972, 7.05}, {6'845'410, 37.99}},
    {"no mesh outside", Outside::nothing, {1'052'087, 5.64}, {6'196'708, 29.6}}};
constexpr int kMaskResolution = 84;  ///< longest side of the printed mask, 84 x 72 x 63
constexpr double kTable93Resolution = 2671.0, kTable94Resolution = 5337.0;

/// A camera within the splash that looks along it. Its frustum has the printed mask's proportions and sees somewhat less than
/// half of the surface, as the printed points say: 1 052 087 of 2 366 433.
Frustum camera(double length) {
  constexpr double kFar = 0.62, kShare = 0.285;
  const Eigen::Vector3d position(0.0, 0.02, 0.45);
  return {.position = length * position,
          .look_at = length * (position - Eigen::Vector3d::UnitZ()),
          .field_of_view = 45.0,
          .aspect = 84.0 / 72.0,
          .near = kShare * kFar * length,
          .far = kFar * length};
}

std::string dimensions_of(const LevelSet& level_set) {
  std::string text;
  for (const int width : level_set.dimensions()) text += (text.empty() ? "" : " × ") + std::to_string(width);
  return text;
}

LevelSet united(const LevelSet& a, const LevelSet& b) {
  const openvdb::FloatGrid::Ptr all = a.grid().grid->deepCopy(), other = b.grid().grid->deepCopy();
  openvdb::tools::csgUnion(*all, *other);
  return make_level_set(all);
}

class Measurer {
 public:
  explicit Measurer(const MeasurementInput& input)
      : input_(input),
        resolution_(input.parameters.number("resolution")),
        pixels_(static_cast<int>(input.parameters.number("pixels"))) {}

  std::vector<MeasuredRow> run() {
    const bool adaptive = wants("adaptive-dual-contouring");
    const bool guaranteed = input_.parameters.is("guaranteed", "yes") && wants("manifold-dual-contouring");
    if (adaptive || guaranteed || input_.wants("input", splash_label())) make_level_set();
    if (adaptive || guaranteed || input_.wants("input", kMaskLabel)) make_mask();
    const double threshold = 250.0 / input_.parameters.number("units_per_square_voxel");
    if (adaptive)
      measure("adaptive-dual-contouring", {{"threshold", std::to_string(threshold)}, {"hermite", "level-set"}});
    if (guaranteed)
      measure("manifold-dual-contouring",
              {{"tolerance", input_.parameters.text("tolerance")}, {"hermite", "level-set"}});
    if (!meshes_.empty()) draw();
    return std::move(rows_);
  }

 private:
  static constexpr const char* kMaskLabel = "frustum mask; printed: 84 × 72 × 63, 159 ms";
  std::string splash_label() const { return "splash, procedural, seed " + std::to_string(input_.seed); }
  bool wants(const std::string& table) const {
    return std::ranges::any_of(kTreatments, [&](const Treatment& each) { return input_.wants(table, each.label); });
  }

  /// The parts one by one, and their union: within a part next to nothing overlaps, and what lies inside others need not be
  /// looked for among the polygons.
  void make_level_set() {
    const VoxelizeRecipe recipe{.chosen = choose(input_.tables.voxelizers, "hermesh"), .voxel_size = 1.0};
    std::size_t triangles = 0;
    double seconds = 0.0;
    for (const double part : {1.0, 2.0, 3.0, 4.0}) {
      const PolygonMesh mesh = make_recipe(
          "splash", {{"length", resolution_}, {"seed", double(input_.seed)}, {"part", part}}, input_.context);
      triangles += mesh.triangle_count();
      const Bounds box = bounds(mesh);
      box_.add(box.lower);
      box_.add(box.upper);
      seconds += timed([&] {
        const LevelSet made = voxelize(mesh, recipe, input_.context);
        level_set_ = part == 1.0 ? made : united(level_set_, made);
      });
    }
    MeasuredRow row{"input", splash_label()};
    row.values["triangles"] = triangles;
    row.values["dimensions"] = dimensions_of(level_set_);
    row.values["active"] = level_set_.active_voxels();
    row.values["seconds"] = seconds;
    rows_.push_back(std::move(row));
  }

  void make_mask() {
    std::vector<double> seconds;
    for (int i = 0; i < repetitions(); ++i)
      seconds.push_back(
          timed([&] { mask_ = frustum_mask(camera(resolution_), kMaskResolution, input_.context); }));
    MeasuredRow row{"input", kMaskLabel};
    row.values["dimensions"] = dimensions_of(mask_);
    row.values["active"] = mask_.active_voxels();
    row.values["seconds"] = median(seconds);
    rows_.push_back(std::move(row));
  }

  int repetitions() const { return static_cast<int>(input_.parameters.number("repetitions")); }

  /// What is wanted, and always the first, which the others are set against.
  void measure(const std::string& name, const GivenOptions& options) {
    double all = 0.0;
    for (const Treatment& treatment : kTreatments) {
      if (treatment.outside != Outside::everywhere && !input_.wants(name, treatment.label)) continue;
      MeasuredRow row = measure(name, options, treatment);
      if (treatment.outside == Outside::everywhere) all = row.values["points"].get<double>();
      row.values["share"] = 100.0 * row.values["points"].get<double>() / all;
      rows_.push_back(std::move(row));
    }
  }

  MeasuredRow measure(const std::string& name, const GivenOptions& given, const Treatment& treatment) {
    const AdaptivityField field{.mask = mask_, .outside = treatment.outside, .scale = {}};
    const ExtractRecipe recipe{.chosen = choose(input_.tables.extractors, name, given), .field = &field};
    std::vector<double> seconds;
    std::optional<std::int64_t> peak;
    PolygonMesh mesh;
    for (int i = 0; i < repetitions(); ++i) {
      input_.context.check();
      mesh = {};
      RunContext child = child_context(input_.context, false);
      const PeakMemory memory;
      seconds.push_back(timed([&] { mesh = extract(level_set_, nullptr, recipe, child).mesh; }));
      if (i == 0) peak = memory.bytes();
    }
    MeasuredRow row{name, treatment.label};
    row.values["points"] = mesh.points.size();
    row.values["polygons"] = mesh.triangles.size() + mesh.quads.size();
    row.values["seconds"] = median(seconds);
    if (peak) row.values["peak"] = double(*peak) / (1 << 20);
    const Printed printed = resolution_ == kTable93Resolution   ? treatment.table_9_3
                            : resolution_ == kTable94Resolution ? treatment.table_9_4
                                                                : Printed();
    if (printed.points) row.values["printed_points"] = *printed.points;
    if (printed.seconds) row.values["printed_seconds"] = *printed.seconds;
    if (name == "adaptive-dual-contouring" && pixels_ > 0) meshes_.emplace_back(treatment.label, std::move(mesh));
    return row;
  }

  /// Figures 9.12 and 9.14 on one sheet, the whole with a close-up of the frustum's border; figure 9.13 on another.
  void draw() const {
    Sheet whole;
    whole.title = "Figures 9.12 and 9.14: the threshold holds within a camera's view alone";
    whole.subtitle = dimensions_of(level_set_) + " voxels; close-up where the view ends";
    whole.frame = box_;
    whole.viewpoint = {55.0, 25.0};
    whole.close_up = {{0.5, 0.3, 0.34}, 0.1};
    whole.cell_pixels = pixels_;
    Sheet view;
    view.title = "Figure 9.13: what the camera sees";
    view.subtitle = "along its axis; before and beside the view cells are merged, or there is nothing";
    view.viewpoint = {0.0, 4.0};
    view.cell_pixels = pixels_;
    const double length = resolution_;
    view.frame.add((length * Eigen::Vector3d(-0.134, -0.17, -0.17)));
    view.frame.add((length * Eigen::Vector3d(0.134, 0.17, 0.27)));
    view.close_up = {{0.5, 0.35, 0.9}, 0.2};
    for (const auto& [label, mesh] : meshes_) {
      const Picture picture{label, {std::to_string(mesh.points.size()) + " points"}, [&mesh = mesh] { return mesh; }};
      whole.pictures.push_back(picture);
      view.pictures.push_back(picture);
    }
    const std::string name = "splash-" + std::to_string(static_cast<int>(resolution_));
    render_sheet(input_.out / (name + "-whole.png"), whole, input_.context);
    render_sheet(input_.out / (name + "-view.png"), view, input_.context);
  }

  const MeasurementInput& input_;
  const double resolution_;
  const int pixels_;
  Bounds box_;
  LevelSet level_set_, mask_;
  std::vector<std::pair<std::string, PolygonMesh>> meshes_;
  std::vector<MeasuredRow> rows_;
};

std::vector<MeasuredRow> measure(const MeasurementInput& input) { return Measurer(input).run(); }

}  // namespace

Measurement tables_9_3_and_9_4_measurement() {
  const std::vector<MeasuredColumn> columns = {
      {"points", "points", "points of the mesh"},
      {"printed_points", "printed", "those of the thesis, of another splash"},
      {"share", "of none [%]", "points over those without a mask; printed: 51.9 and 44.5 %"},
      {"polygons", "polygons", "triangles and quads"},
      {"seconds", "time [s]", "median, Hermite data included"},
      {"printed_seconds", "printed [s]", "16 cores of 2011, the copy to a host included"},
      {"peak", "peak [MiB]", "resident memory beyond the level set"}};
  return {.name = "tables-9-3-and-9-4",
          .summary = "a frustum as a mask of adaptive extraction, on a procedural splash",
          .parameters = {{"resolution", "2671", "voxels along the longest side; 5337 for table 9.4", {}, 100, 20000},
                         {"units_per_square_voxel", "1000", "see table_9_2.toml", {}, 1e-6, 1e12},
                         {"repetitions", "3", "timed runs", {}, 1, 100},
                         {"guaranteed", "no", "whether manifold-dual-contouring runs beside it", {"yes", "no"}},
                         {"tolerance", "0.25", "its tolerance, voxels", {}, 1e-3, 100},
                         {"pixels", "600", "width of a picture; 0 draws none", {}, 0, 4000}},
          .tables = {{"input",
                      "the level sets",
                      "what",
                      {{"triangles", "triangles", "that it was made from"},
                       {"dimensions", "voxels", "dimensions of the active voxels' box"},
                       {"active", "active voxels", "of the level set"},
                       {"seconds", "time [s]", "to make it"}}},
                     {"adaptive-dual-contouring", "the thesis's method, threshold 250", "mask", columns},
                     {"manifold-dual-contouring", "ours, with its guarantees", "mask", columns}},
          .measure = measure};
}

}  // namespace hermesh
