// Tables 9.3 and 9.4 of the thesis, and their figures: a large level set contoured finely only in the view of
// a camera. Also the growth of the vertices when the resolution doubles, as it does between the two tables.
#include <openvdb/tools/Composite.h>

#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/frustum.h"
#include "experiments/harness/facts.h"
#include "experiments/measurements/measurements.h"

namespace hermesh {
namespace {

using Outside = AdaptivityField::Outside;

/// Published values; there are none without a mask in table 9.4.
struct PrintedMesh {
  std::optional<double> points, seconds;
};
struct Treatment {
  const char* label;
  Outside outside;
  PrintedMesh table_9_3, table_9_4;
};
const Treatment kTreatments[] = {
    {"none", Outside::everywhere, {2'366'433, 10.86}, {}},
    {"max simplification outside", Outside::simplify, {1'227'972, 7.05}, {6'845'410, 37.99}},
    {"no mesh outside", Outside::nothing, {1'052'087, 5.64}, {6'196'708, 29.6}}};
/// The thesis's old method without a mask (caption of table 9.3), for which OpenVDB's mesher stands in.
constexpr PrintedMesh kPrintedOldMethod{6'762'593, 28.72};
/// Divisors of the threshold at the finer of two resolutions.
constexpr std::array<double, 5> kDivisors = {1, 2, 4, 6, 8};
/// Growth of the vertices on a lattice twice as fine if the mesh does not depend on scale: each region then
/// covers a quarter of the area.
constexpr double kScaleFree = 4.0;
constexpr int kMaskResolution = 84;  ///< longest side of the printed mask, 84 x 72 x 63
constexpr double kTable93Resolution = 2671.0, kTable94Resolution = 5337.0;

/// Returns a camera within the splash that looks along it. Its frustum has the proportions of the printed
/// mask and contains somewhat less than half of the surface, like the printed points: 1 052 087 of 2 366 433.
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

LevelSet united(const LevelSet& a, const LevelSet& b) {
  const openvdb::FloatGrid::Ptr all = a.grid().grid->deepCopy(), other = b.grid().grid->deepCopy();
  openvdb::tools::csgUnion(*all, *other);
  return make_level_set(all);
}

struct Splash {
  LevelSet level_set;
  Bounds box;
  std::size_t triangles = 0;
  double seconds = 0.0;
};

/// Voxelizes the parts one by one and unites them: parts hardly overlap themselves, and no polygons inside
/// other parts have to be found.
Splash make_splash(double length, const MeasurementInput& input) {
  Splash splash;
  for (const double part : {1.0, 2.0, 3.0, 4.0}) {
    const PolygonMesh mesh = make_recipe(
        "splash", {{"length", length}, {"seed", double(input.seed)}, {"part", part}}, input.context);
    splash.triangles += mesh.triangle_count();
    splash.box.add(bounds(mesh));
    splash.seconds += timed([&] {
      const LevelSet made = voxelized(mesh, {.voxel_size = 1.0}, input);
      splash.level_set = part == 1.0 ? made : united(splash.level_set, made);
    });
  }
  return splash;
}

/// The number with all its digits, for thresholds that are searched for.
std::string all_digits(double value) {
  std::ostringstream text;
  text << std::setprecision(17) << value;
  return text.str();
}

std::string growth_label(const Treatment& treatment, double divisor) {
  return std::string(treatment.label) + (divisor == 1.0 ? ", same E" : ", E / " + readable(divisor));
}
std::string law_label(const Treatment& treatment, bool printed) {
  return std::string(treatment.label) + (printed ? ", as printed" : ", scale-free");
}
/// Returns the points of table 9.4 over those of table 9.3.
std::optional<double> printed_growth(const Treatment& treatment) {
  if (!treatment.table_9_4.points) return std::nullopt;
  return *treatment.table_9_4.points / *treatment.table_9_3.points;
}

/// Counts the vertices of the splash at two resolutions, the second twice the first, for several thresholds.
class Growth {
 public:
  explicit Growth(const MeasurementInput& input)
      : input_(input),
        length_(input.parameters.number("resolution")),
        threshold_(250.0 / input.parameters.number("units_per_square_voxel")) {}

  std::vector<MeasuredRow> run() {
    std::vector<const Treatment*> wanted;
    for (const Treatment& treatment : kTreatments)
      if (std::ranges::any_of(
              kDivisors, [&](double by) { return input_.wants("growth", growth_label(treatment, by)); }) ||
          input_.wants("law", law_label(treatment, false)) || input_.wants("law", law_label(treatment, true)))
        wanted.push_back(&treatment);
    if (wanted.empty()) return {};
    std::map<const Treatment*, double> base;
    load(0.5 * length_);
    for (const Treatment* treatment : wanted) base[treatment] = points(*treatment, 1.0);
    load(length_);
    for (const Treatment* treatment : wanted) measure(*treatment, base[treatment]);
    return std::move(rows_);
  }

 private:
  void load(double length) {
    level_set_ = {};
    level_set_ = make_splash(length, input_).level_set;
    mask_ = frustum_mask(camera(length), kMaskResolution, input_.context);
  }

  double points(const Treatment& treatment, double divisor) const {
    input_.context.check();
    const AdaptivityField field{.mask = mask_, .outside = treatment.outside, .scale = {}};
    const ExtractRecipe recipe{.chosen = choose(input_.tables.extractors, "adaptive-dual-contouring",
                                                {{"threshold", all_digits(threshold_ / divisor)},
                                                 {"representation", input_.parameters.text("representation")},
                                                 {"hermite", "level-set"}}),
                               .field = &field};
    RunContext child = child_context(input_.context, false);
    return double(extract(level_set_, nullptr, recipe, child).mesh.points.size());
  }

  void measure(const Treatment& treatment, double base) {
    std::map<double, double> found;  // growth by divisor
    const double most = points(treatment, std::numeric_limits<double>::infinity()) / base;
    for (const double divisor : kDivisors) {
      input_.context.progress(growth_label(treatment, divisor), 0.0);
      const double fine = points(treatment, divisor);
      found[divisor] = fine / base;
      MeasuredRow row{"growth", growth_label(treatment, divisor)};
      row.values = {{"divisor", divisor},
                    {"threshold", threshold_ / divisor},
                    {"coarse_points", base},
                    {"fine_points", fine},
                    {"growth", fine / base}};
      if (const auto printed = printed_growth(treatment)) row.values["printed_growth"] = *printed;
      rows_.push_back(std::move(row));
    }
    add_law(treatment, base, most, found, kScaleFree, false);
    if (const auto printed = printed_growth(treatment)) add_law(treatment, base, most, found, *printed, true);
  }

  /// Searches the divisor at which the points grow by `growth`, along the straight line through the
  /// logarithms of the two nearest pairs, until it is met within 0.5 %. Except for noise, points grow with
  /// the divisor.
  void add_law(const Treatment& treatment, double base, double most, std::map<double, double>& found,
               double growth, bool printed) {
    if (!input_.wants("law", law_label(treatment, printed))) return;
    constexpr int kMost = 6;
    constexpr double kTolerance = 0.005;
    double divisor = 1.0;
    for (int i = 0; growth < most; ++i) {
      std::vector<std::pair<double, double>> near(found.begin(), found.end());
      std::ranges::sort(near, {}, [&](const auto& each) { return std::abs(std::log(each.second / growth)); });
      divisor = near[0].first;
      if (i == kMost || std::abs(near[0].second / growth - 1.0) < kTolerance) break;
      const double slope =
          std::log(near[1].second / near[0].second) / std::log(near[1].first / near[0].first);
      if (!(slope > 1e-3)) break;
      const double next = near[0].first * std::exp(std::log(growth / near[0].second) / slope);
      if (!(next > 1e-3 && next < 1e6)) break;
      found[next] = points(treatment, next) / base;
    }
    MeasuredRow row{"law", law_label(treatment, printed)};
    const bool met = std::abs(found[divisor] / growth - 1.0) < kTolerance;
    row.values = {{"target", growth}, {"met", int(met)}, {"growth", found[divisor]}, {"most", most}};
    if (met) {
      row.values["divisor"] = divisor;
      row.values["exponent"] = std::log2(divisor);
    } else if (most > growth * (1.0 + kTolerance)) {
      row.broken.push_back("the threshold at which the points grow as asked was not found");
    }
    rows_.push_back(std::move(row));
  }

  const MeasurementInput& input_;
  const double length_, threshold_;
  LevelSet level_set_, mask_;
  std::vector<MeasuredRow> rows_;
};

class Tables93And94Measurer {
 public:
  explicit Tables93And94Measurer(const MeasurementInput& input)
      : input_(input),
        resolution_(input.parameters.number("resolution")),
        pixels_(static_cast<int>(input.parameters.number("pixels"))) {}

  std::vector<MeasuredRow> run() {
    const bool adaptive = wants("adaptive-dual-contouring");
    const bool guaranteed = input_.parameters.is("guaranteed", "yes") && wants("manifold-dual-contouring");
    const bool old = input_.wants("old-method", kOldLabel);
    if (adaptive || guaranteed || old || input_.wants("input", splash_label())) make_level_set();
    if (adaptive || guaranteed || input_.wants("input", kMaskLabel)) make_mask();
    const double threshold = 250.0 / input_.parameters.number("units_per_square_voxel");
    if (adaptive)
      measure("adaptive-dual-contouring",
              {{"threshold", std::to_string(threshold)}, {"hermite", "level-set"}});
    if (guaranteed)
      measure("manifold-dual-contouring",
              {{"tolerance", input_.parameters.text("tolerance")}, {"hermite", "level-set"}});
    if (old) measure_old();
    if (!meshes_.empty()) draw();
    return std::move(rows_);
  }

 private:
  static constexpr const char* kOldLabel = "openvdb, no mask";
  static constexpr const char* kMaskLabel = "frustum mask; printed: 84 × 72 × 63, 159 ms";
  std::string splash_label() const { return "splash, procedural, seed " + std::to_string(input_.seed); }
  bool wants(const std::string& table) const {
    return std::ranges::any_of(kTreatments,
                               [&](const Treatment& each) { return input_.wants(table, each.label); });
  }

  void make_level_set() {
    const Splash splash = make_splash(resolution_, input_);
    level_set_ = splash.level_set;
    box_ = splash.box;
    rows_.push_back({"input",
                     splash_label(),
                     {{"triangles", splash.triangles},
                      {"dimensions", dimensions_of(level_set_)},
                      {"active", level_set_.active_voxels()},
                      {"seconds", splash.seconds}}});
  }

  void make_mask() {
    std::vector<double> seconds;
    for (int i = 0; i < int(input_.parameters.number("repetitions")); ++i)
      seconds.push_back(
          timed([&] { mask_ = frustum_mask(camera(resolution_), kMaskResolution, input_.context); }));
    rows_.push_back({"input",
                     kMaskLabel,
                     {{"dimensions", dimensions_of(mask_)},
                      {"active", mask_.active_voxels()},
                      {"seconds", median(seconds)}}});
  }

  /// Measures the wanted treatments and always the first, with which the others are compared.
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

  /// Measures OpenVDB's mesher, which has no mask, on the same level set.
  void measure_old() {
    const auto [row, mesh] =
        repeat("old-method", kOldLabel, {.chosen = choose(input_.tables.extractors, "openvdb")});
    rows_.push_back(row);
    if (resolution_ == kTable93Resolution) set_printed(rows_.back(), kPrintedOldMethod);
    const auto adaptive = std::ranges::find_if(rows_, [](const MeasuredRow& each) {
      return each.table == "adaptive-dual-contouring" && each.label == kTreatments[0].label;
    });
    if (adaptive == rows_.end()) return;
    for (const char* what : {"points", "seconds"})
      rows_.back().values[std::string(what) + "_of_new"] =
          row.values[what].get<double>() / adaptive->values[what].get<double>();
  }

  static void set_printed(MeasuredRow& row, const PrintedMesh& printed) {
    if (printed.points) row.values["printed_points"] = *printed.points;
    if (printed.seconds) row.values["printed_seconds"] = *printed.seconds;
  }

  MeasuredRow measure(const std::string& name, const GivenOptions& given, const Treatment& treatment) {
    const AdaptivityField field{.mask = mask_, .outside = treatment.outside, .scale = {}};
    auto [row, mesh] = repeat(name, treatment.label,
                              {.chosen = choose(input_.tables.extractors, name, given), .field = &field});
    if (resolution_ == kTable93Resolution) set_printed(row, treatment.table_9_3);
    if (resolution_ == kTable94Resolution) set_printed(row, treatment.table_9_4);
    if (name == "adaptive-dual-contouring" && pixels_ > 0)
      meshes_.emplace_back(treatment.label, std::move(mesh));
    return row;
  }

  /// Returns the row of an extraction and its mesh.
  std::pair<MeasuredRow, PolygonMesh> repeat(const std::string& table, const std::string& label,
                                             const ExtractRecipe& recipe) {
    auto [mesh, context, seconds, peak] = extract_repeatedly(level_set_, recipe, input_);
    MeasuredRow row{table,
                    label,
                    {{"points", mesh.points.size()},
                     {"polygons", mesh.triangles.size() + mesh.quads.size()},
                     {"seconds", seconds}}};
    if (peak) row.values["peak"] = *peak;
    return {std::move(row), std::move(mesh)};
  }

  /// Draws figures 9.12 and 9.14 on one sheet, with a close-up of the frustum's border, and figure 9.13 on
  /// another.
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
      const Picture picture{
          label, {std::to_string(mesh.points.size()) + " points"}, [&mesh = mesh] { return mesh; }};
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

}  // namespace

std::vector<MeasuredRow> measure_tables_9_3_and_9_4(const MeasurementInput& input) {
  if (input.parameters.is("growth", "only")) return Growth(input).run();
  std::vector<MeasuredRow> rows = Tables93And94Measurer(input).run();
  if (input.parameters.is("growth", "yes")) std::ranges::move(Growth(input).run(), std::back_inserter(rows));
  return rows;
}

}  // namespace hermesh
