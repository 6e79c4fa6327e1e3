// Orders of accuracy of everything that makes a mesh, a level set or a code of normals, on shapes of which
// the truth is known (exact_shapes.h), after Etiene, Nonato, Scheidegger, Tierny, Peters, Pascucci, Kirby and
// Silva, Verifiable Visualization for Isosurface Extraction (2009): an implementation whose error falls with
// another power of the voxel size than theory says has a fault, or the theory has.
#include "experiments/accuracy/measure_order.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <sstream>
#include <vector>

#include "algorithms/hermite/normal_code.h"
#include "experiments/accuracy/exact_data.h"
#include "experiments/accuracy/exact_shapes.h"
#include "experiments/accuracy/mesh_errors.h"
#include "experiments/accuracy/normal_code_order.h"
#include "experiments/accuracy/optimal_triangles.h"
#include "experiments/accuracy/orders.h"
#include "experiments/accuracy/slope_fit.h"
#include "experiments/harness/cell.h"
#include "experiments/harness/run_cells.h"
#include "experiments/pipeline.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Where a shape's middle lies between samples, in voxels: fixed, and no coordinate a simple share of a
/// voxel.
const std::array<Vector3d, 3> kOffsets = {Vector3d(0.317, 0.211, 0.113), Vector3d(0.841, 0.457, 0.673),
                                          Vector3d(0.129, 0.919, 0.538)};

struct VariantOfOrder {
  const char* label;
  const char* name;
  GivenOptions options;
  bool takes_hermite;  ///< may be given crossings and normals
  bool keeps_creases;  ///< where these are exact
  bool slow = false;   ///< left out where the parameter says so
};
/// Each extractor there is, the adaptive ones at tolerance 0; add an entry to have another.
const std::vector<VariantOfOrder>& variants() {
  static const std::vector<VariantOfOrder> table = {
      {"marching-cubes", "marching-cubes", {}, false, false},
      {"dual average", "dual-contouring", {{"placement", "average"}}, true, false},
      {"dual", "dual-contouring", {}, true, true},
      {"dual optimal", "dual-contouring", {{"placement", "optimal"}}, true, true},
      {"adaptive 0",
       "adaptive-dual-contouring",
       {{"threshold", "0"}, {"representation", "sparse-float"}},
       true,
       true},
      {"manifold 0", "manifold-dual-contouring", {{"tolerance", "0"}}, true, true},
      {"octree 0", "certified-octree", {{"tolerance", "0"}}, true, true},
      {"openvdb", "openvdb", {}, false, false},
      {"cgal", "cgal-surface-mesher", {{"facet_size", "1"}, {"facet_distance", "0.5"}}, false, false, true},
      {"decimated 0.1", "marching-cubes-decimated", {}, false, false, true},
  };
  return table;
}

/// A mesh of an adaptive variant within a tolerance, which is held against the fewest triangles that can do
/// it.
struct AdaptiveVariant {
  const char* label;
  const char* name;
  GivenOptions options;
};
const std::vector<AdaptiveVariant>& adaptive_variants() {
  static const std::vector<AdaptiveVariant> table = {
      {"manifold 0.05", "manifold-dual-contouring", {{"tolerance", "0.05"}}},
      {"manifold 0.1", "manifold-dual-contouring", {{"tolerance", "0.1"}}},
      {"manifold 0.5", "manifold-dual-contouring", {{"tolerance", "0.5"}}},
      {"octree 0.05", "certified-octree", {{"tolerance", "0.05"}}},
      {"octree 0.1", "certified-octree", {{"tolerance", "0.1"}}},
      {"octree 0.5", "certified-octree", {{"tolerance", "0.5"}}},
      {"adaptive 0.05",
       "adaptive-dual-contouring",
       {{"threshold", "0.05"}, {"representation", "sparse-float"}}},
      {"adaptive 0.1",
       "adaptive-dual-contouring",
       {{"threshold", "0.1"}, {"representation", "sparse-float"}}},
      {"adaptive 0.5",
       "adaptive-dual-contouring",
       {{"threshold", "0.5"}, {"representation", "sparse-float"}}},
      {"openvdb 0.05", "openvdb", {{"adaptivity", "0.05"}}},
      {"openvdb 0.1", "openvdb", {{"adaptivity", "0.1"}}},
      {"openvdb 0.5", "openvdb", {{"adaptivity", "0.5"}}},
      {"decimated 0.1", "marching-cubes-decimated", {}},
  };
  return table;
}

struct VoxelizerOfOrder {
  const char* label;
  const char* name;
  GivenOptions options;
  /// It takes minutes at small voxels, whose facets number a million: measured at 16 voxels in the unit of
  /// length and fewer.
  bool slow = false;
};
const std::vector<VoxelizerOfOrder>& voxelizers() {
  static const std::vector<VoxelizerOfOrder> table = {{"hermesh", "hermesh", {}},
                                                      {"thesis", "thesis", {}},
                                                      {"openvdb", "openvdb", {}},
                                                      {"openvdb plain", "openvdb", {{"renormalize", "no"}}},
                                                      {"pseudo-normals", "pseudo-normals", {}, true},
                                                      {"exact", "exact", {}, true}};
  return table;
}

std::vector<double> sizes_of(const std::string& text) {
  std::vector<double> sizes;
  std::istringstream in(text);
  for (std::string word; std::getline(in, word, '-');) sizes.push_back(std::stod(word));
  return sizes;
}

class OrderMeasurer {
 public:
  explicit OrderMeasurer(const MeasurementInput& input)
      : input_(input),
        sizes_(sizes_of(input.parameters.text("sizes"))),
        draws_(int(input.parameters.number("draws"))),
        all_(input.parameters.is("shapes", "all")),
        slow_(input.parameters.is("slow", "yes")) {}

  std::vector<MeasuredRow> run() {
    for (const char* shape : exact_shape_names())
      if (all_ || is_quick(shape)) {
        extract_all(shape);
        voxelize_all(shape);
        triangulate_all(shape);
      }
    normal_codes();
    return {};
  }

 private:
  /// One of each kind: curved to both sides, with creases between flat and round, and flat.
  static bool is_quick(const std::string& shape) {
    return shape == "sphere" || shape == "torus" || shape == "cylinder" || shape == "cube";
  }
  /// Facets of polygons, a quarter of a voxel.
  static constexpr double kFacet = 0.25;

  PlacedShape placed(const char* shape, double voxel, std::size_t offset) const {
    return turned(exact_shape(shape), voxel * kOffsets[offset]);
  }
  void emit(MeasuredRow row) {
    std::vector<MeasuredRow> rows;
    rows.push_back(std::move(row));
    input_.emit(std::move(rows));
  }

  // ---- Extractors.

  /// What the meshes of one volume are made from, by the three ways that data come.
  struct Data {
    LevelSet exact;
    std::optional<FloatHermite> hermite;
    PolygonMesh polygons;
    std::map<std::string, LevelSet> voxelized;
  };

  struct Contender {
    const VariantOfOrder* variant;
    std::string source;     ///< level set, Hermite data, polygons
    std::string voxelizer;  ///< of polygons
    std::string label;
    std::map<Quantity, std::vector<ErrorsAtSize>> errors = {}, signed_errors = {};
    std::optional<std::string> failure = {};
  };

  std::vector<Contender> contenders(const std::string& shape) const {
    std::vector<Contender> result;
    const auto add = [&](const VariantOfOrder& variant, const std::string& source,
                         const std::string& voxelizer) {
      Contender contender{.variant = &variant,
                          .source = source,
                          .voxelizer = voxelizer,
                          .label = std::string(variant.label) + ", " + source};
      if (!voxelizer.empty() && voxelizer != "hermesh") contender.label += " by " + voxelizer;
      if (wants_any(shape, contender.label)) result.push_back(std::move(contender));
    };
    const bool has_polygons = !exact_shape(shape)->facets(1.0).empty();
    for (const VariantOfOrder& variant : variants()) {
      if (variant.slow && !slow_) continue;
      add(variant, "level set", "");
      if (variant.takes_hermite) add(variant, "Hermite data", "");
      if (has_polygons && slow_) add(variant, "polygons", "hermesh");
    }
    // What a voxelizer gets wrong shows in any mesh of its level set alone.
    if (has_polygons && slow_)
      for (const VoxelizerOfOrder& voxelizer : voxelizers())
        if (std::string(voxelizer.label) != "hermesh" && !voxelizer.slow)
          add(variants().front(), "polygons", voxelizer.label);
    return result;
  }
  bool wants_any(const std::string& shape, const std::string& label) const {
    if (input_.wants("errors-" + shape, label)) return true;
    return std::ranges::any_of(
        kQuantities, [&](Quantity quantity) { return input_.wants(shape, row_label(label, quantity)); });
  }
  static std::string row_label(const std::string& label, Quantity quantity) {
    return label + ": " + name(quantity);
  }

  void extract_all(const char* shape) {
    std::vector<Contender> all = contenders(shape);
    if (all.empty()) return;
    for (std::size_t s = 0; s < sizes_.size(); ++s)
      for (std::size_t offset = 0; offset < kOffsets.size(); ++offset) {
        input_.context.progress(shape, (double(s) + double(offset) / 3.0) / double(sizes_.size()));
        const double voxel = 1.0 / sizes_[s];
        const PlacedShape truth = placed(shape, voxel, offset);
        const Data data = data_for(truth, voxel, all);
        for (Contender& contender : all) {
          if (contender.failure) continue;
          input_.context.check();
          contender.failure = attempt([&] { take(contender, truth, data, voxel, offset); });
        }
      }
    const std::shared_ptr<const ExactShape> truth = exact_shape(shape);
    for (Contender& contender : all) report(shape, *truth, contender);
  }

  Data data_for(const PlacedShape& truth, double voxel, const std::vector<Contender>& all) const {
    const auto any = [&](const auto& predicate) { return std::ranges::any_of(all, predicate); };
    Data data;
    RunContext child = child_context(input_.context, false);
    data.exact = exact_level_set(truth, voxel, 3.0, child);
    if (any([](const Contender& c) { return c.source == "Hermite data"; }))
      data.hermite = exact_hermite(truth, data.exact, child);
    if (any([](const Contender& c) { return c.source == "polygons"; }))
      data.polygons = truth.facets(kFacet * voxel);
    for (const VoxelizerOfOrder& voxelizer : voxelizers())
      if (any([&](const Contender& c) { return c.voxelizer == voxelizer.label; }))
        data.voxelized[voxelizer.label] = voxelized(voxelizer, data.polygons, voxel);
    return data;
  }
  LevelSet voxelized(const VoxelizerOfOrder& voxelizer, const PolygonMesh& polygons, double voxel) const {
    RunContext child = child_context(input_.context, false);
    return voxelize(
        polygons,
        {.chosen = choose(input_.tables.voxelizers, voxelizer.name, voxelizer.options), .voxel_size = voxel},
        child);
  }

  void take(Contender& contender, const PlacedShape& truth, const Data& data, double voxel,
            std::size_t offset) const {
    const bool polygons = contender.source == "polygons", hermite = contender.source == "Hermite data";
    GivenOptions options = contender.variant->options;
    if (contender.variant->takes_hermite)
      options["hermite"] = contender.source == "level set" ? "level-set" : "exact";
    RunContext child = child_context(input_.context, false);
    const ExtractRecipe recipe = {
        .chosen = choose(input_.tables.extractors, contender.variant->name, options),
        .hermite = hermite ? &*data.hermite : nullptr};
    const PolygonMesh mesh = extract(polygons ? data.voxelized.at(contender.voxelizer) : data.exact,
                                     polygons ? &data.polygons : nullptr, recipe, child)
                                 .mesh;
    const MeshErrors errors = mesh_errors(mesh, truth, voxel, child);
    for (const Quantity quantity : kQuantities) {
      const std::optional<double> error = errors.signed_error(quantity);
      if (!error) continue;
      std::vector<ErrorsAtSize>&all = contender.errors[quantity],
      &with_sign = contender.signed_errors[quantity];
      if (offset == 0) all.push_back({voxel, {}}), with_sign.push_back({voxel, {}});
      all.back().errors.push_back(std::abs(*error));
      with_sign.back().errors.push_back(*error);
    }
  }

  void report(const std::string& shape, const ExactShape& truth, const Contender& contender) {
    if (contender.failure) {
      MeasuredRow row{shape, contender.label};
      row.broken.push_back(*contender.failure);
      emit(std::move(row));
      return;
    }
    for (std::size_t s = 0; s < sizes_.size(); ++s) {
      MeasuredRow row{"errors-" + shape, contender.label};
      row.values["voxels"] = sizes_[s];
      for (const auto& [quantity, errors] : contender.errors)
        row.values[name(quantity)] = mean_of(errors[s].errors);
      emit(std::move(row));
    }
    const Expectation kind =
        expectation(truth, contender.source != "level set" && contender.variant->keeps_creases);
    for (const auto& [quantity, errors] : contender.errors) {
      MeasuredRow row{shape, row_label(contender.label, quantity)};
      describe_order(row.values, errors, kind, quantity, input_.seed, draws_);
      if (kind == Expectation::kSharp && !truth.is_flat())
        if (const auto powers = two_powers(quantity))
          if (const auto fit =
                  fit_two_terms(contender.signed_errors.at(quantity), powers->first, powers->second)) {
            row.values["crease_term"] = fit->first;
            row.values["smooth_term"] = fit->second;
            row.values["two_term_residual"] = fit->residual;
          }
      emit(std::move(row));
    }
  }

  // ---- Voxelizers.

  void voxelize_all(const char* shape) {
    if (exact_shape(shape)->facets(1.0).empty()) return;
    const bool flat = exact_shape(shape)->is_flat();
    for (const VoxelizerOfOrder& voxelizer : voxelizers()) {
      const auto label = [&](const char* what) {
        return std::string(shape) + ", " + voxelizer.label + ": " + what;
      };
      if (voxelizer.slow && !slow_) continue;
      if (!input_.wants("voxelizers", label("rms")) && !input_.wants("voxelizers", label("max"))) continue;
      std::vector<ErrorsAtSize> rms, max;
      std::size_t voxels = 0, wrong = 0;
      const auto failure = attempt([&] {
        for (const double size : sizes_) {
          if (size > 16 && (voxelizer.slow || !slow_)) continue;
          const double voxel = 1.0 / size;
          rms.push_back({voxel, {}}), max.push_back({voxel, {}});
          for (std::size_t offset = 0; offset < kOffsets.size(); ++offset) {
            input_.context.progress(label("band"), 0.0);
            const PlacedShape truth = placed(shape, voxel, offset);
            const LevelSet level_set = voxelized(voxelizer, truth.facets(kFacet * voxel), voxel);
            // Chords of facets lie in the surface by their length squared over twice the largest radius of
            // curvature.
            const BandErrors errors = band_errors(truth, level_set, 0.01 * voxel, input_.context);
            rms.back().errors.push_back(errors.rms), max.back().errors.push_back(errors.max);
            voxels += errors.voxels, wrong += errors.wrong_signs;
          }
        }
      });
      for (const char* what : {"rms", "max"}) {
        MeasuredRow row{"voxelizers", label(what)};
        if (failure) {
          row.broken.push_back(*failure);
        } else {
          describe_order(row.values, std::string(what) == "rms" ? rms : max,
                         flat ? Expectation::kExact : Expectation::kSmooth,
                         std::string(what) == "rms" ? Quantity::kRms : Quantity::kMax, input_.seed, draws_);
          row.values["voxels"] = voxels;
          row.values["wrong_signs"] = wrong;
        }
        emit(std::move(row));
      }
    }
  }

  // ---- The fewest triangles.

  void triangulate_all(const char* shape) {
    const std::optional<double> optimum = triangles_times_error(shape);
    if (!optimum) return;
    std::vector<const AdaptiveVariant*> wanted;
    for (const AdaptiveVariant& variant : adaptive_variants())
      for (const double size : sizes_)
        if (input_.wants("optimum", optimum_label(shape, variant, size)) &&
            (wanted.empty() || wanted.back() != &variant))
          wanted.push_back(&variant);
    if (wanted.empty()) return;
    for (const double size : sizes_) {
      if (size < kSmallestForOptimum || (!slow_ && size < sizes_.back())) continue;
      const double voxel = 1.0 / size;
      std::map<const AdaptiveVariant*, std::vector<std::pair<std::size_t, DistancesToSurface>>> found;
      std::map<const AdaptiveVariant*, std::string> failures;
      for (std::size_t offset = 0; offset < kOffsets.size(); ++offset) {
        const PlacedShape truth = placed(shape, voxel, offset);
        RunContext child = child_context(input_.context, false);
        const LevelSet level_set = exact_level_set(truth, voxel, 3.0, child);
        const FloatHermite hermite = exact_hermite(truth, level_set, child);
        for (const AdaptiveVariant* variant : wanted) {
          input_.context.progress(std::string(shape) + ", " + variant->label, 0.0);
          const auto failure = attempt([&] {
            const ExtractRecipe recipe = {
                .chosen = choose(input_.tables.extractors, variant->name, variant->options),
                .hermite = &hermite};
            const PolygonMesh mesh = extract(level_set, nullptr, recipe, child).mesh;
            found[variant].push_back(
                {mesh.triangle_count(), distances_to_surface(mesh, truth, 0.5 * voxel, child)});
          });
          if (failure) failures[variant] = *failure;
        }
      }
      for (const AdaptiveVariant* variant : wanted) {
        MeasuredRow row{"optimum", optimum_label(shape, *variant, size)};
        if (failures.contains(variant)) {
          row.broken.push_back(failures.at(variant));
        } else {
          std::vector<double> triangles, max, rms, mean, times;
          for (const auto& [count, distances] : found.at(variant)) {
            triangles.push_back(double(count));
            max.push_back(distances.max / voxel);
            rms.push_back(distances.rms / voxel);
            mean.push_back(distances.mean / voxel);
            times.push_back(double(count) * distances.max / *optimum);
          }
          row.values = {{"size", size},
                        {"triangles", mean_of(triangles)},
                        {"error_max", mean_of(max)},
                        {"error_rms", mean_of(rms)},
                        {"error_mean", mean_of(mean)},
                        {"times_optimum", mean_of(times)},
                        {"times_optimum_min", std::ranges::min(times)},
                        {"times_optimum_max", std::ranges::max(times)}};
        }
        emit(std::move(row));
      }
    }
  }
  /// With fewer voxels a mesh is so coarse that single triangles decide.
  static constexpr double kSmallestForOptimum = 16;
  static std::string optimum_label(const std::string& shape, const AdaptiveVariant& variant, double size) {
    return shape + ", " + variant.label + ", " + readable(size);
  }

  // ---- Normal codes.

  void normal_codes() {
    for (const NormalCodeId id : kNormalCodes) {
      const std::string label(hermesh::name(id));
      if (!input_.wants("normal-codes", label + ": mean") && !input_.wants("normal-codes", label + ": max"))
        continue;
      const NormalCodeOrder order = normal_code_order(id, std::size_t(input_.parameters.number("normals")),
                                                      input_.seed, input_.context);
      for (const char* what : {"mean", "max"}) {
        MeasuredRow row{"normal-codes", label + ": " + what};
        describe_order(row.values, std::string(what) == "mean" ? order.mean : order.max,
                       Expectation::kFirstOrder, Quantity::kNormals, input_.seed, draws_);
        row.values["differing"] = order.differing;
        // Of a projection within rounding of a step's end single and double precision may take either; a
        // thousandth is far more.
        if (double(order.differing) > 0.001 * input_.parameters.number("normals"))
          row.broken.push_back("the code at other resolutions is not the code that is in use at its own");
        emit(std::move(row));
      }
    }
  }

  static double mean_of(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return sum / double(values.size());
  }

  const MeasurementInput& input_;
  std::vector<double> sizes_;
  int draws_;
  bool all_, slow_;
};

std::vector<MeasuredColumn> order_columns() {
  return {
      {"order", "order",
       "slope of log error against log voxel size, errors averaged over three places between samples"},
      {"order_low", "from", "the slope's interval of 95 % by resampling of sizes and places: its lower end"},
      {"order_high", "to", "its upper end"},
      {"order_theory", "theory", "the order that theory gives; none where the result should be exact"},
      {"order_within", "within",
       "whether the slope is within 0.15 of theory, or the result exact where it should be"},
      {"error_coarse", "error, coarse", "mean error at the largest voxels"},
      {"error_fine", "error, fine", "mean error at the smallest voxels"},
      {"exact", "exact", "whether all errors are those of rounding, which have no order"}};
}

}  // namespace

Measurement order_measurement() {
  std::vector<MeasuredTable> tables;
  for (const std::string shape : exact_shape_names()) {
    std::vector<MeasuredColumn> columns = order_columns();
    if (exact_shape(shape)->is_sharp() && !exact_shape(shape)->is_flat()) {
      columns.push_back(
          {"crease_term", "× crease",
           "coefficient of the crease's power of the voxel size, of signed errors fitted by two powers"});
      columns.push_back({"smooth_term", "× smooth", "coefficient of the power of smooth surfaces"});
      columns.push_back(
          {"two_term_residual", "fit", "relative residual of the fit by two powers, root mean square"});
    }
    tables.push_back({shape, "orders on the " + shape, "variant, data: quantity", columns});
    std::vector<MeasuredColumn> errors = {{"voxels", "R/h", "voxels in the unit of length"}};
    for (const Quantity quantity : kQuantities)
      errors.push_back({name(quantity), name(quantity),
                        "mean over three places between samples; world units, radians or shares"});
    tables.push_back({.name = "errors-" + shape,
                      .title = "errors on the " + shape,
                      .first_column = "variant, data",
                      .columns = errors,
                      .printed = false});
  }
  std::vector<MeasuredColumn> bands = order_columns();
  bands.push_back({"voxels", "values",
                   "active samples that were held against the exact distance, of all sizes and places"});
  bands.push_back(
      {"wrong_signs", "wrong signs",
       "of these with the wrong sign though farther than a hundredth of a voxel from the surface"});
  tables.push_back({"voxelizers", "orders of band values, polygons with facets of a quarter of a voxel",
                    "shape, voxelizer: quantity", bands});
  std::vector<MeasuredColumn> codes = order_columns();
  codes.push_back(
      {"differing", "differing",
       "normals whose code or its decoding, at the resolution in use, is not that of the code in use"});
  tables.push_back({"normal-codes",
                    "orders of codes of normals in their step, at resolutions of 4 to 10 bits a component",
                    "code: error", codes});
  tables.push_back(
      {"optimum",
       "triangles over the fewest that lie as near to the surface",
       "shape, variant and tolerance, R/h",
       {{"size", "R/h", "voxels in the unit of length"},
        {"triangles", "triangles", "of the mesh, mean over three places"},
        {"error_max", "max [vx]", "largest distance from the mesh to the surface, mean"},
        {"error_rms", "rms [vx]", "distance from the mesh to the surface, root mean square, mean"},
        {"error_mean", "mean [vx]", "signed distance from the mesh to the surface, positive outside, mean"},
        {"times_optimum", "÷ optimum",
         "triangles over the fewest that have the mesh's own largest error, mean"},
        {"times_optimum_min", "from", "smallest of the three places"},
        {"times_optimum_max", "to", "largest of the three places"}}});
  return {.name = "order",
          .summary =
              "orders of accuracy on shapes whose truth is known, of meshes, level sets and codes of normals",
          .parameters =
              {{"sizes",
                "8-12-16-24-32-48",
                "voxels in the unit of length, from coarse to fine",
                {"8-12-16-24-32-48", "8-12-16-24", "8-12-16"}},
               {"shapes", "all", "'all', or a 'few': sphere, torus, cylinder and cube", {"all", "few"}},
               {"slow",
                "yes",
                "whether to measure what takes long: CGAL's mesher, decimation, each voxelizer's meshes",
                {"yes", "no"}},
               {"normals", "200000", "random normals for each resolution of a code", {}, 1000, 1e8},
               {"draws", "1000", "resampled slopes for an interval", {}, 20, 1e6}},
          .tables = tables,
          .measure = [](const MeasurementInput& input) { return OrderMeasurer(input).run(); }};
}

}  // namespace hermesh
