// Orders of accuracy of extractors, voxelizers and normal codes on shapes in closed form (exact_shapes.h),
// after Etiene, Nonato, Scheidegger, Tierny, Peters, Pascucci, Kirby and Silva, Verifiable Visualization for
// Isosurface Extraction (2009): an error that falls with another power of the voxel size than predicted
// indicates a fault of the implementation or of the theory.
#include <array>
#include <cmath>

#include "algorithms/hermite/normal_code.h"
#include "experiments/accuracy/exact_data.h"
#include "experiments/accuracy/exact_shapes.h"
#include "experiments/accuracy/mesh_errors.h"
#include "experiments/accuracy/orders.h"
#include "experiments/harness/cell.h"

namespace hermesh {
namespace {

using Eigen::Vector3d;

/// Positions of a shape's middle between samples, in voxels; no coordinate is a simple fraction of a voxel.
const std::array<Vector3d, 3> kOffsets = {Vector3d(0.317, 0.211, 0.113), Vector3d(0.841, 0.457, 0.673),
                                          Vector3d(0.129, 0.919, 0.538)};

struct MethodOfOrder {
  std::string label, name;
  GivenOptions options = {};
  bool slow = false;           ///< left out if the parameter says so
  bool takes_hermite = false;  ///< accepts crossings and normals
  bool keeps_creases = false;  ///< if these are exact
};
/// All extractors, the adaptive ones at tolerance 0.
const std::vector<MethodOfOrder> kExtractorsOfOrder = {
    {"marching-cubes", "marching-cubes"},
    {"dual average", "dual-contouring", {{"placement", "average"}}, false, true},
    {"dual", "dual-contouring", {}, false, true, true},
    {"dual optimal", "dual-contouring", {{"placement", "optimal"}}, false, true, true},
    {"adaptive 0",
     "adaptive-dual-contouring",
     {{"threshold", "0"}, {"representation", "sparse-float"}},
     false,
     true,
     true},
    {"manifold 0", "manifold-dual-contouring", {{"tolerance", "0"}}, false, true, true},
    {"octree 0", "certified-octree", {{"tolerance", "0"}}, false, true, true},
    {"openvdb", "openvdb"},
    {"cgal", "cgal-surface-mesher", {{"facet_size", "1"}, {"facet_distance", "0.5"}}, true},
    {"decimated 0.1", "marching-cubes-decimated", {}, true}};

/// Adaptive methods whose meshes are compared with the fewest triangles within their distance.
std::vector<MethodOfOrder> adaptive_methods() {
  std::vector<MethodOfOrder> all;
  const auto add = [&](const std::string& label, const std::string& name, const std::string& option,
                       GivenOptions options = {}) {
    for (const std::string value : {"0.05", "0.1", "0.5"}) {
      options[option] = value;
      all.push_back({label + " " + value, name, options});
    }
  };
  add("manifold", "manifold-dual-contouring", "tolerance");
  add("octree", "certified-octree", "tolerance");
  add("adaptive", "adaptive-dual-contouring", "threshold", {{"representation", "sparse-float"}});
  add("openvdb", "openvdb", "adaptivity");
  all.push_back({"decimated 0.1", "marching-cubes-decimated"});
  return all;
}

/// Slow ones take minutes at small voxels, whose facets number a million: measured at 16 voxels in the unit
/// of length and fewer.
const std::vector<MethodOfOrder> kVoxelizersOfOrder = {{"hermesh", "hermesh"},
                                                       {"thesis", "thesis"},
                                                       {"openvdb", "openvdb"},
                                                       {"openvdb plain", "openvdb", {{"renormalize", "no"}}},
                                                       {"pseudo-normals", "pseudo-normals", {}, true},
                                                       {"exact", "exact", {}, true}};

class OrderMeasurer {
 public:
  explicit OrderMeasurer(const MeasurementInput& input)
      : input_(input),
        sizes_(numbers_in(input.parameters.text("sizes"), '-')),
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
  /// One shape of each kind: curved with both signs, with creases between flat and round, and flat.
  static bool is_quick(const std::string& shape) {
    return shape == "sphere" || shape == "torus" || shape == "cylinder" || shape == "cube";
  }
  /// Size of the polygons' facets, voxels.
  static constexpr double kFacet = 0.25;

  PlacedShape placed(const char* shape, double voxel, std::size_t offset) const {
    return turned(exact_shape(shape), voxel * kOffsets[offset]);
  }
  void emit(MeasuredRow row) { input_.emit({std::move(row)}); }

  // ---- Extractors.

  /// Inputs of the meshes of one volume, from three sources.
  struct Data {
    LevelSet exact;
    std::optional<FloatHermite> hermite;
    PolygonMesh polygons;
    std::map<std::string, LevelSet> voxelized;
  };

  struct Contender {
    const MethodOfOrder* variant;
    std::string source;     ///< level set, Hermite data, polygons
    std::string voxelizer;  ///< of polygons
    std::string label;
    std::map<Quantity, std::vector<ErrorsAtSize>> errors = {}, signed_errors = {};
    std::optional<std::string> failure = {};
  };

  std::vector<Contender> contenders(const std::string& shape) const {
    std::vector<Contender> result;
    const auto add = [&](const MethodOfOrder& variant, const std::string& source,
                         const std::string& voxelizer) {
      Contender contender{.variant = &variant,
                          .source = source,
                          .voxelizer = voxelizer,
                          .label = variant.label + ", " + source};
      if (!voxelizer.empty() && voxelizer != "hermesh") contender.label += " by " + voxelizer;
      if (wants_any(shape, contender.label)) result.push_back(std::move(contender));
    };
    const bool has_polygons = !exact_shape(shape)->facets(1.0).empty();
    for (const MethodOfOrder& variant : kExtractorsOfOrder) {
      if (variant.slow && !slow_) continue;
      add(variant, "level set", "");
      if (variant.takes_hermite) add(variant, "Hermite data", "");
      if (has_polygons && slow_) add(variant, "polygons", "hermesh");
    }
    // Errors of a voxelizer are visible in any mesh of only its level set.
    if (has_polygons && slow_)
      for (const MethodOfOrder& voxelizer : kVoxelizersOfOrder)
        if (voxelizer.label != "hermesh" && !voxelizer.slow)
          add(kExtractorsOfOrder.front(), "polygons", voxelizer.label);
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
    for (const MethodOfOrder& voxelizer : kVoxelizersOfOrder)
      if (any([&](const Contender& c) { return c.voxelizer == voxelizer.label; }))
        data.voxelized[voxelizer.label] = voxelized(voxelizer, data.polygons, voxel);
    return data;
  }
  LevelSet voxelized(const MethodOfOrder& voxelizer, const PolygonMesh& polygons, double voxel) const {
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
        row.values[name(quantity)] = mean(errors[s].errors);
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
    for (const MethodOfOrder& voxelizer : kVoxelizersOfOrder) {
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
            // Chords of facets lie inside by about their squared length over twice the radius of curvature.
            const BandErrors errors = band_errors(truth, level_set, 0.01 * voxel, input_.context);
            rms.back().errors.push_back(errors.rms), max.back().errors.push_back(errors.max);
            voxels += errors.voxels, wrong += errors.wrong_signs;
          }
        }
      });
      for (const Quantity what : {Quantity::kRms, Quantity::kMax}) {
        MeasuredRow row{"voxelizers", label(name(what))};
        if (failure) {
          row.broken.push_back(*failure);
        } else {
          describe_order(row.values, what == Quantity::kRms ? rms : max,
                         flat ? Expectation::kExact : Expectation::kSmooth, what, input_.seed, draws_);
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
    std::vector<const MethodOfOrder*> wanted;
    const std::vector<MethodOfOrder> all = adaptive_methods();
    for (const MethodOfOrder& variant : all)
      for (const double size : sizes_)
        if (input_.wants("optimum", optimum_label(shape, variant, size)) &&
            (wanted.empty() || wanted.back() != &variant))
          wanted.push_back(&variant);
    if (wanted.empty()) return;
    for (const double size : sizes_) {
      if (size < kSmallestForOptimum || (!slow_ && size < sizes_.back())) continue;
      const double voxel = 1.0 / size;
      std::map<const MethodOfOrder*, std::vector<std::pair<std::size_t, DistancesToSurface>>> found;
      std::map<const MethodOfOrder*, std::string> failures;
      for (std::size_t offset = 0; offset < kOffsets.size(); ++offset) {
        const PlacedShape truth = placed(shape, voxel, offset);
        RunContext child = child_context(input_.context, false);
        const LevelSet level_set = exact_level_set(truth, voxel, 3.0, child);
        const FloatHermite hermite = exact_hermite(truth, level_set, child);
        for (const MethodOfOrder* variant : wanted) {
          input_.context.progress(shape + (", " + variant->label), 0.0);
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
      for (const MethodOfOrder* variant : wanted) {
        MeasuredRow row{"optimum", optimum_label(shape, *variant, size)};
        if (failures.contains(variant)) {
          row.broken.push_back(failures.at(variant));
        } else {
          std::vector<double> triangles, max, rms, signed_mean, times;
          for (const auto& [count, distances] : found.at(variant)) {
            triangles.push_back(double(count));
            max.push_back(distances.max / voxel);
            rms.push_back(distances.rms / voxel);
            signed_mean.push_back(distances.mean / voxel);
            times.push_back(double(count) * distances.max / *optimum);
          }
          row.values = {{"size", size},
                        {"triangles", mean(triangles)},
                        {"error_max", mean(max)},
                        {"error_rms", mean(rms)},
                        {"error_mean", mean(signed_mean)},
                        {"times_optimum", mean(times)},
                        {"times_optimum_min", std::ranges::min(times)},
                        {"times_optimum_max", std::ranges::max(times)}};
        }
        emit(std::move(row));
      }
    }
  }
  /// With fewer voxels the result depends on single triangles.
  static constexpr double kSmallestForOptimum = 16;
  static std::string optimum_label(const std::string& shape, const MethodOfOrder& variant, double size) {
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
        // Single and double precision may differ for projections within rounding of a step's end, far fewer
        // than a thousandth.
        if (double(order.differing) > 0.001 * input_.parameters.number("normals"))
          row.broken.push_back("the code at other resolutions is not the code that is in use at its own");
        emit(std::move(row));
      }
    }
  }

  const MeasurementInput& input_;
  std::vector<double> sizes_;
  int draws_;
  bool all_, slow_;
};

}  // namespace

std::vector<MeasuredRow> measure_order(const MeasurementInput& input) { return OrderMeasurer(input).run(); }

}  // namespace hermesh
