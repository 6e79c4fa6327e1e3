// Figures 9.1 and 9.2 of the thesis: slices through the level set of a self-intersecting model, and through
// one whose interior band fills the solid.
#include <cmath>

#include "algorithms/core/level_set_grid.h"
#include "experiments/measurements/measurements.h"
#include "experiments/pictures/slice.h"
#include "reference/level_set_judge.h"

namespace hermesh {
namespace {

constexpr double kUsualBand = 3.0;  // voxels
constexpr std::array<const char*, 2> kIntersecting = {"sphere-cluster", "openscad"};
/// The interior bands of figure 9.2, in voxels; 0 stands for one that reaches the middle of the solid.
constexpr std::array<double, 3> kInteriors = {3.0, 10.0, 0.0};
constexpr std::array<const char*, 2> kFillers = {"thesis", "hermesh"};

/// A voxelizer as a panel of figure 9.1.
struct CleanUpWay {
  std::string label, name;
  GivenOptions options = {};
};

/// The thesis's voxelizer without and with its clean-up, ours, and the oracle.
const std::vector<CleanUpWay> kCleanUpWays = {{"thesis, clean_up=false", "thesis", {{"clean_up", "false"}}},
                                              {"thesis", "thesis"},
                                              {"hermesh", "hermesh"},
                                              {"exact", "exact", {{"signs", "winding-number"}}}};

struct SideCounts {
  std::size_t active_outside = 0, active_inside = 0, inside = 0;
};
SideCounts count_sides(const LevelSet& level_set) {
  SideCounts counts;
  for (auto value = level_set.grid().grid->cbeginValueAll(); value; ++value) {
    const bool inside = *value < 0.0f;
    if (inside) counts.inside += value.getVoxelCount();
    if (value.isValueOn()) (inside ? counts.active_inside : counts.active_outside) += value.getVoxelCount();
  }
  return counts;
}

/// Samples at which a level set differs from the oracle's.
struct Differences {
  std::size_t buried = 0;   ///< active, while the oracle's is inside beyond the band
  std::size_t missing = 0;  ///< inactive, while the oracle's is active
  std::size_t wrong = 0;    ///< with the other sign, farther than 1e-3 voxel from the surface
};
Differences compare(const LevelSet& level_set, const LevelSet& truth) {
  constexpr double kNear = 1e-3;
  const openvdb::FloatGrid& here = *level_set.grid().grid;
  const openvdb::FloatGrid& there = *truth.grid().grid;
  const double near = kNear * truth.voxel_size();
  Differences result;
  auto accessor = there.getConstAccessor();
  for (auto value = here.cbeginValueOn(); value; ++value) {
    float exact = 0.0f;
    const bool active = accessor.probeValue(value.getCoord(), exact);
    if (!active && exact < 0.0f) ++result.buried;
    if (std::abs(exact) > near && (exact < 0.0f) != (*value < 0.0f)) ++result.wrong;
  }
  auto own = here.getConstAccessor();
  for (auto value = there.cbeginValueOn(); value; ++value) {
    float found = 0.0f;
    if (own.probeValue(value.getCoord(), found)) continue;
    ++result.missing;
    if (std::abs(*value) > near && (found < 0.0f) != (*value < 0.0f)) ++result.wrong;
  }
  return result;
}

class Figure91Measurer {
 public:
  explicit Figure91Measurer(const MeasurementInput& input)
      : input_(input),
        resolution_(input.parameters.number("resolution")),
        pixels_(int(input.parameters.number("pixels"))) {}

  std::vector<MeasuredRow> run() {
    for (const char* name : kIntersecting) clean_up(name);
    fill(input_.parameters.text("filled_case"));
    return std::move(rows_);
  }

 private:
  static std::string label_of(const std::string& model, const std::string& way) { return model + ", " + way; }

  VoxelizeRecipe recipe(const CleanUpWay& way, double interior) const {
    return {.chosen = choose(input_.tables.voxelizers, way.name, way.options),
            .resolution = resolution_,
            .exterior_band = kUsualBand,
            .interior_band = interior};
  }

  /// Returns the slice across the model's shortest side, which shows most of it.
  SliceFrame widest_slice(const LevelSet& level_set, const PolygonMesh& mesh) const {
    int axis = 0;
    bounds(mesh).size().minCoeff(&axis);
    return slice_frame(level_set, axis, input_.parameters.number("slice"), 3);
  }

  void clean_up(const std::string& name) {
    if (std::ranges::none_of(kCleanUpWays, [&](const CleanUpWay& way) {
          return input_.wants("clean-up", label_of(name, way.label));
        }))
      return;
    const CleanUpWay& oracle = kCleanUpWays.back();
    const LoadedCase model = input_.tables.load(name, input_.context);
    const LevelSet truth = voxelize(model.mesh, recipe(oracle, kUsualBand), input_.context);
    const SliceFrame frame = widest_slice(truth, model.mesh);
    PanelSheet sheet;
    for (const CleanUpWay& way : kCleanUpWays) {
      if (!input_.wants("clean-up", label_of(name, way.label))) continue;
      input_.context.check();
      RunContext child = child_context(input_.context, false);
      LevelSet level_set = truth;
      std::optional<double> seconds;
      if (way.name != oracle.name)
        seconds = timed([&] { level_set = voxelize(model.mesh, recipe(way, kUsualBand), child); });
      add_clean_up_row(label_of(name, way.label), model, level_set, truth, seconds);
      if (pixels_ == 0) continue;
      Panel panel{way.label, {}, draw_slice(level_set, frame, pixels_)};
      const Json& values = rows_.back().values;
      panel.captions = {values["buried"].dump() + " buried, " + values["wrong_signs"].dump() +
                        " wrong signs of " + std::to_string(level_set.active_voxels()) + " in the grid"};
      sheet.panels.push_back(std::move(panel));
    }
    sheet.title = "Figure 9.1: " + name + " at " + readable(resolution_) + " voxels, a slice";
    sheet.subtitle =
        model.origin + "; buried: active inside the solid beyond the band, which clean-up should remove";
    draw(std::move(sheet), "figure-9-1-" + name);
  }

  void add_clean_up_row(const std::string& label, const LoadedCase& model, const LevelSet& level_set,
                        const LevelSet& truth, std::optional<double> seconds) {
    MeasuredRow row{"clean-up", label};
    const SideCounts sides = count_sides(level_set);
    const Differences differences = compare(level_set, truth);
    row.values = {{"origin", model.origin},
                  {"active", level_set.active_voxels()},
                  {"active_inside", sides.active_inside},
                  {"active_outside", sides.active_outside},
                  {"buried", differences.buried},
                  {"missing", differences.missing},
                  {"wrong_signs", differences.wrong},
                  {"mebibytes", double(level_set.memory_bytes()) / (1 << 20)}};
    if (seconds) row.values["seconds"] = *seconds;
    rows_.push_back(std::move(row));
  }

  void fill(const std::string& name) {
    const auto label = [&](const char* way, double interior) {
      return label_of(name, std::string(way) + (interior > 0.0 ? ", " + readable(interior) : ", filled"));
    };
    const auto wanted = [&](const char* way, double interior) {
      return input_.wants("fill", label(way, interior));
    };
    if (std::ranges::none_of(kFillers, [&](const char* way) {
          return std::ranges::any_of(kInteriors, [&](double interior) { return wanted(way, interior); });
        }))
      return;
    const LoadedCase model = input_.tables.load(name, input_.context);
    PanelSheet sheet;
    std::optional<SliceFrame> frame;
    for (const char* way : kFillers)
      for (const double interior : kInteriors) {
        if (!wanted(way, interior)) continue;
        input_.context.check();
        // No sample is deeper than half of the longest side.
        const double band = interior > 0.0 ? interior : 0.5 * resolution_ + 2.0;
        RunContext child = child_context(input_.context, false);
        LevelSet level_set;
        const double seconds = timed([&] {
          level_set = voxelize(model.mesh, recipe({way, way}, band), child);
        });
        add_fill_row(label(way, interior), model, level_set, band, seconds);
        if (pixels_ == 0) continue;
        if (!frame) frame = widest_slice(level_set, model.mesh);
        const Json& values = rows_.back().values;
        sheet.panels.push_back(
            {label(way, interior),
             {readable(100.0 * values["share_filled"].get<double>()) + " % of the inside active",
              "distances: rms error " + readable(values["rms"].get<double>()) + ", largest " +
                  readable(values["largest"].get<double>()) + " voxel"},
             draw_slice(level_set, *frame, pixels_, 4.0)});
      }
    sheet.title = "Figure 9.2: interior of " + name + ", " + readable(resolution_) + " voxels";
    sheet.subtitle = model.origin + "; a slice, the tone changing every four voxels of distance";
    sheet.columns = int(kInteriors.size());
    draw(std::move(sheet), "figure-9-2-" + name);
  }

  void add_fill_row(const std::string& label, const LoadedCase& model, const LevelSet& level_set, double band,
                    double seconds) {
    MeasuredRow row{"fill", label};
    const SideCounts sides = count_sides(level_set);
    row.values = {
        {"origin", model.origin},
        {"interior_band", band},
        {"active_inside", sides.active_inside},
        {"inside", sides.inside},
        {"share_filled", double(sides.active_inside) / double(std::max<std::size_t>(1, sides.inside))},
        {"seconds", seconds}};
    const DistanceOracle surface(triangles_in_voxels(model.mesh, level_set.voxel_size()));
    const WindingOracle winding(surface);
    // A voxel on the wrong side is compared with the band of the other side; both are as wide as the wider
    // one.
    const VoxelSelection selection{band, std::int64_t(input_.parameters.number("samples")), input_.seed};
    const DistanceTruth truth(surface, winding, selection, input_.context);
    const DistanceReport report = truth.judge(level_set, model.mesh.origin, kUsualBand, band, input_.context);
    row.values["compared"] = report.compared;
    row.values["rms"] = report.rms;
    row.values["largest"] = report.max;
    row.values["missing"] = report.missing;
    rows_.push_back(std::move(row));
  }

  void draw(PanelSheet sheet, const std::string& name) const {
    if (sheet.panels.empty()) return;
    sheet.legend = slice_legend();
    draw_panels(input_.out / (name + "-" + readable(resolution_) + ".png"), std::move(sheet));
  }

  const MeasurementInput& input_;
  const double resolution_;
  const int pixels_;
  std::vector<MeasuredRow> rows_;
};

}  // namespace

std::vector<MeasuredRow> measure_figure_9_1(const MeasurementInput& input) {
  return Figure91Measurer(input).run();
}

}  // namespace hermesh
