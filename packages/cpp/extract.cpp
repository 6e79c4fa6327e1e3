// Volumes to meshes, and meshes to meshes.
#include "hermesh/extract.h"

#include <cmath>

#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/explain.h"
#include "algorithms/extraction/frustum.h"
#include "algorithms/hermite/solids.h"
#include "algorithms/lattice/placement.h"
#include "algorithms/remesh/bounded_remesh.h"
#include "algorithms/variants.h"
#include "packages/cpp/inside.h"

namespace hermesh::v1 {

std::vector<MethodInfo> extractors() {
  std::vector<MethodInfo> infos;
  for (const Extractor& extractor : our_extractors()) {
    MethodInfo info = method_info(extractor.name, extractor.summary, extractor.options);
    info.closed = extractor.promises.closed;
    info.manifold = extractor.promises.manifold;
    info.oriented = extractor.promises.oriented;
    info.free_of_self_intersection = extractor.promises.no_self_intersection;
    infos.push_back(std::move(info));
  }
  return infos;
}

namespace {

ChosenExtractor choose(const ExtractOptions& options, const std::string& fallback) {
  require(std::isfinite(options.isovalue), "the isovalue must be a finite number");
  require(options.ends == "closed" || options.ends == "open",
          "ends are closed or open, not '" + options.ends + "'");
  return hermesh::choose(our_extractors(), options.extractor.empty() ? fallback : options.extractor,
                         options.options);
}

Eigen::Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// Returns where the extractor keeps its bound; none without such options.
std::optional<AdaptivityField> field_of(const ExtractOptions& options, const Extractor& extractor,
                                        RunContext& context) {
  using Outside = AdaptivityField::Outside;
  require(!options.mask || !options.frustum, "a mask and a frustum exclude one another");
  const bool has_mask = options.mask || options.frustum;
  require(options.outside == "simplify" || options.outside == "nothing" || options.outside == "everywhere",
          "outside is simplify, nothing or everywhere, not '" + options.outside + "'");
  require(has_mask || options.outside == "simplify", "outside needs a mask or a frustum");
  if (!has_mask && !options.tolerance_grid) return std::nullopt;
  check_adaptive(extractor);
  AdaptivityField field;
  field.outside = !has_mask || options.outside == "everywhere" ? Outside::everywhere
                  : options.outside == "nothing"               ? Outside::nothing
                                                               : Outside::simplify;
  if (options.mask) field.mask = Inside::level_set(options.mask);
  if (options.frustum) {
    require(
        options.frustum_resolution >= 8 && options.frustum_resolution <= 4096,
        "the frustum's resolution must be from 8 to 4096, not " + std::to_string(options.frustum_resolution));
    const Frustum& f = *options.frustum;
    field.mask = frustum_mask({.position = vector(f.position),
                               .look_at = vector(f.look_at),
                               .up = vector(f.up),
                               .field_of_view = f.angle,
                               .aspect = f.aspect,
                               .near = f.near,
                               .far = f.far},
                              options.frustum_resolution, context);
  }
  if (options.tolerance_grid) field.scale = Inside::level_set(options.tolerance_grid);
  FieldEvaluator(&field, IndexToWorld());  // throws before the work if one of them is invalid
  return field;
}

/// Parameters of an extraction, with the field that they point to.
struct Extraction {
  std::optional<AdaptivityField> field;
  ExtractRecipe recipe;

  Extraction(const ExtractOptions& options, const ChosenExtractor& chosen, RunContext& context)
      : field(field_of(options, chosen.extractor, context)),
        recipe{.chosen = chosen,
               .isovalue = options.isovalue,
               .ends = options.ends == "open" ? Ends::open : Ends::closed,
               .field = field ? &*field : nullptr,
               .written_in_single = options.written_in_single} {}
  Extraction(const Extraction&) = delete;
};

/// Returns the surface of a solid.
PolygonMesh surface_of(const LevelSet& level_set, const FloatHermite& hermite, const ChosenExtractor& chosen,
                       const ExtractOptions& options, RunContext& context) {
  // A solid has no end of the data, and values only for the surface at 0.
  require(options.isovalue == 0.0, "the surface of a solid is at the isovalue 0");
  require(options.ends == "closed", "the surface of a solid has no end of the data that could be open");
  Extraction extraction(options, chosen, context);
  extraction.recipe.ends.reset();
  extraction.recipe.hermite = &hermite;
  return extract_surface(level_set, nullptr, extraction.recipe, context);
}

SignRule sign_rule(const std::string& signs) {
  if (signs == "winding-number") return SignRule::winding_number;
  if (signs == "flood-fill") return SignRule::flood_fill;
  if (signs == "auto") return SignRule::automatic;
  throw hermesh::Error(
      "signs must be winding-number, flood-fill or auto, because a bound needs an inside, not '" + signs +
      "'");
}

constexpr const char* kOfVolumes = "dual-contouring";
constexpr const char* kOfPolygons = "manifold-dual-contouring";

}  // namespace

Mesh extract(const Volume& volume, const ExtractOptions& options, Context& context, const Mesh* source) {
  return run(context, [&](RunContext& inner) {
    const ChosenExtractor chosen = choose(options, kOfVolumes);
    PolygonMesh copy;
    const PolygonMesh* polygons = nullptr;
    if (source) {
      check_source_has_effect(chosen.extractor, chosen.options, options.isovalue);
      polygons = &Inside::sampled(*source, copy);
    }
    const Extraction extraction(options, chosen, inner);
    return Inside::mesh(extract_surface(Inside::level_set(volume), polygons, extraction.recipe, inner));
  });
}

Mesh extract(const Solid& solid, const ExtractOptions& options, Context& context) {
  return run(context, [&](RunContext& inner) {
    const ChosenExtractor chosen = choose(options, kOfVolumes);
    const auto& data = Inside::data(solid);
    return Inside::mesh(surface_of(Inside::level_set(data.level_set), data.hermite, chosen, options, inner));
  });
}

VoxelizeRecipe recipe_of(const PolygonMesh& mesh, const VoxelizeOptions& options, double isovalue) {
  require(!options.like, "only voxelize takes the lattice of another volume");
  VoxelizeOptions given = options;
  if (options.thin.value_or(Thin::keep) == Thin::keep)
    given.options = with_open_sheets(options.voxelizer, options.options);
  VoxelizeRecipe recipe{.chosen = choose(given),
                        .voxel_size = voxel_size_of(mesh, options),
                        .exterior_band = options.exterior_band,
                        .interior_band = options.interior_band};
  const char* reason = reason_to_drop_thin_parts(recipe.chosen, isovalue);
  require(!reason || options.thin.value_or(Thin::drop) == Thin::drop,
          std::string("thin parts can only be dropped: ") + (reason ? reason : ""));
  static_assert(int(Thin::keep) == int(ThinRule::keep) && int(Thin::drop) == int(ThinRule::drop) &&
                int(Thin::refuse) == int(ThinRule::refuse));
  recipe.thin = reason ? ThinRule::drop : static_cast<ThinRule>(options.thin.value_or(Thin::keep));
  return recipe;
}

Mesh remesh(const Mesh& mesh, const VoxelizeOptions& voxelizing, const ExtractOptions& extracting,
            Context& context) {
  return run(context, [&](RunContext& inner) {
    const ChosenExtractor extractor = choose(extracting, kOfPolygons);
    PolygonMesh copy;
    const PolygonMesh& polygons = Inside::sampled(mesh, copy);
    const VoxelizeRecipe recipe = recipe_of(polygons, voxelizing, extracting.isovalue);
    const Extraction extraction(extracting, extractor, inner);
    return Inside::mesh(hermesh::remesh(polygons, recipe, extraction.recipe, inner).mesh);
  });
}

Mesh combine(Boolean operation, const Mesh& a, const Mesh& b, const VoxelizeOptions& voxelizing,
             const ExtractOptions& extracting, Context& context) {
  return run(context, [&](RunContext& inner) {
    require(!choose(voxelizing).options.is("signs", "unsigned"),
            "the option signs=unsigned leaves the solids without an inside to combine");
    const ChosenExtractor extractor = choose(extracting, kOfPolygons);
    PolygonMesh copy_of_a, copy_of_b;
    const PolygonMesh& first = Inside::sampled(a, copy_of_a);
    const PolygonMesh& second = Inside::sampled(b, copy_of_b);
    // A resolution counts along the longer operand, so the order of the two does not matter.
    const bool second_is_longer = bounds(second).size().maxCoeff() > bounds(first).size().maxCoeff();
    const VoxelizeRecipe recipe = recipe_of(second_is_longer ? second : first, voxelizing);
    const SharedLattice lattice = shared_lattice(first, second, *recipe.voxel_size);
    const auto sampled = [&](const PolygonMesh& mesh, const std::string& name) {
      const auto sample = [&](const PolygonMesh& framed) { return make_solid(framed, recipe, inner).solid; };
      SampledSolid solid = about_file(name, [&] { return sample_solid(mesh, lattice, sample); });
      if (const std::string note = missed_edges_note(solid.sampling); !note.empty())
        inner.note(name + ": " + note);
      return solid;
    };
    const SampledSolid solid_a = sampled(first, "the first mesh"),
                       solid_b = sampled(second, "the second mesh");
    const hermesh::Boolean boolean = inner_boolean(operation);
    const CombinedSolid result = hermesh::combine(boolean, solid_a, solid_b, inner);
    const LostSlivers lost = lost_slivers(boolean, solid_a.hermite, solid_b.hermite);
    inner.check();
    const std::string note = lost.edges > 0 ? lost_slivers_note(lost, boolean, lattice.voxel_size) : "";
    const bool is_empty = result.hermite.leaves.empty();
    require(!is_empty || lost.edges == 0,
            "the result is thinner than a voxel everywhere, nothing was written: " + note);
    require(!is_empty,
            "the result is empty, nothing was written: no sample and no edge of the lattice lies in it");
    if (lost.edges > 0) inner.note(note);
    return Inside::mesh(surface_of(result.level_set, result.hermite, extractor, extracting, inner));
  });
}

BoundedRemesh remesh_within(const Mesh& mesh, const BoundOptions& options, Context& context) {
  return run(context, [&](RunContext& inner) {
    require(options.error.has_value() != options.triangles.has_value(),
            "give either an error or a number of triangles");
    const BoundedRemeshOptions given{.error = options.error.value_or(0.0),
                                     .signs = sign_rule(options.signs),
                                     .over_holes = options.over_holes,
                                     .most_points = options.most_points > 0.0 ? options.most_points
                                                    : options.triangles       ? 4e5
                                                                              : 3e7,
                                     .smallest_voxel = options.smallest_voxel,
                                     .written_in_single = options.written_in_single,
                                     .thin = options.thin == Thin::keep ? ThinRule::keep : ThinRule::drop,
                                     .through_volume = options.through_volume,
                                     .except_thin = options.except_thin};
    PolygonMesh copy;
    const PolygonMesh& polygons = Inside::sampled(mesh, copy);
    BoundedMesh made = options.triangles ? remesh_to_budget(polygons, *options.triangles, given, inner)
                                         : bounded_remesh(polygons, given, inner);
    if (!made.unmet.empty()) throw hermesh::Error(explanation(made));
    for (const std::string& note : notes(made)) inner.note(note);
    if (made.thin) inner.note(thin_note(*made.thin, made.voxel_size));
    std::vector<ExceptedBall> exceptions;
    for (const UnmetPlace& ball : made.excepted)
      exceptions.push_back({.position = {ball.place.x(), ball.place.y(), ball.place.z()},
                            .radius = ball.radius,
                            .distance = ball.distance,
                            .area = ball.area,
                            .is_hole = ball.why == Unmet::hole});
    return BoundedRemesh{.mesh = Inside::mesh(std::move(made.mesh)),
                         .error = made.error,
                         .to_polygons = made.to_surface,
                         .from_polygons = made.from_surface,
                         .voxel_size = made.voxel_size,
                         .exceptions = std::move(exceptions)};
  });
}

}  // namespace hermesh::v1
