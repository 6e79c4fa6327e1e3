// Volumes to meshes, and the whole way from meshes to meshes.
#include "hermesh/extract.h"

#include <cmath>
#include <cstdlib>

#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/explain.h"
#include "algorithms/extraction/frustum.h"
#include "algorithms/extraction/volume_ends.h"
#include "algorithms/hermite/lost_slivers.h"
#include "algorithms/hermite/solids.h"
#include "algorithms/lattice/placement.h"
#include "algorithms/remesh/thin_parts.h"
#include "algorithms/variants.h"
#include "packages/cpp/solid_data.h"
#include "packages/cpp/stages.h"

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

struct ChosenExtractor {
  const Extractor& extractor;
  hermesh::Options options;
  Ends ends;
};

ChosenExtractor choose(const ExtractOptions& options, const std::string& fallback) {
  const Extractor& extractor =
      find_variant(our_extractors(), options.extractor.empty() ? fallback : options.extractor);
  if (!std::isfinite(options.isovalue)) throw hermesh::Error("the isovalue must be a finite number");
  if (options.ends != "closed" && options.ends != "open")
    throw hermesh::Error("ends are closed or open, not '" + options.ends + "'");
  return {extractor, hermesh::Options(extractor.name, extractor.options, options.options),
          options.ends == "open" ? Ends::open : Ends::closed};
}

Eigen::Vector3d vector(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// Where the extractor keeps its bound, as the options say; nothing where they say nothing.
std::optional<AdaptivityField> field_of(const ExtractOptions& options, const Extractor& extractor,
                                        RunContext& context) {
  using Outside = AdaptivityField::Outside;
  if (options.mask && options.frustum) throw hermesh::Error("a mask and a frustum exclude one another");
  const bool has_mask = options.mask || options.frustum;
  if (options.outside != "simplify" && options.outside != "nothing" && options.outside != "everywhere")
    throw hermesh::Error("outside is simplify, nothing or everywhere, not '" + options.outside + "'");
  if (!has_mask && options.outside != "simplify") throw hermesh::Error("outside needs a mask or a frustum");
  if (!has_mask && !options.tolerance_grid) return std::nullopt;
  check_adaptive(extractor);
  AdaptivityField field;
  field.outside = !has_mask || options.outside == "everywhere" ? Outside::everywhere
                  : options.outside == "nothing"               ? Outside::nothing
                                                               : Outside::simplify;
  if (options.mask) field.mask = Inside::level_set(options.mask);
  if (options.frustum) {
    if (options.frustum_resolution < 8 || options.frustum_resolution > 4096)
      throw hermesh::Error("the frustum's resolution must be from 8 to 4096, not " +
                           std::to_string(options.frustum_resolution));
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
  // What is wrong with one of them is said before the work.
  FieldEvaluator(&field, IndexToWorld());
  return field;
}

PolygonMesh mesh_of(const LevelSet& level_set, const PolygonMesh* source, bool of_polygons,
                    const ChosenExtractor& chosen, const ExtractOptions& options, RunContext& context) {
  const std::optional<AdaptivityField> field = field_of(options, chosen.extractor, context);
  EndedMesh ended = extract_with_ends(chosen.extractor,
                                      {.level_set = level_set,
                                       .isovalue = options.isovalue,
                                       .source = source,
                                       .options = chosen.options,
                                       .context = context,
                                       .field = field ? &*field : nullptr,
                                       .written_in_single = options.written_in_single},
                                      chosen.ends);
  context.check();
  if (ended.mesh.empty() && field && field->outside == AdaptivityField::Outside::nothing)
    throw hermesh::Error("there is no surface inside the mask, nothing was written");
  if (ended.mesh.empty())
    throw hermesh::Error(no_surface(level_set, options.isovalue, of_polygons, chosen.extractor.name));
  if (const std::string note = ends_note(ended.ends, chosen.ends); !note.empty()) context.note(note);
  return std::move(ended.mesh);
}

PolygonMesh contour(const LevelSet& level_set, const FloatHermite& hermite, const ChosenExtractor& chosen,
                    const ExtractOptions& options, RunContext& context) {
  // What lies on the lattice of two solids has no end of data, and no other value than its surface's.
  if (options.isovalue != 0.0) throw hermesh::Error("the surface of a solid is at the isovalue 0");
  if (options.ends != "closed")
    throw hermesh::Error("the surface of a solid has no end of the data that could be open");
  const std::optional<AdaptivityField> field = field_of(options, chosen.extractor, context);
  PolygonMesh mesh = chosen.extractor.extract({.level_set = level_set,
                                               .options = chosen.options,
                                               .context = context,
                                               .field = field ? &*field : nullptr,
                                               .hermite = &hermite,
                                               .written_in_single = options.written_in_single});
  context.check();
  if (mesh.empty()) throw hermesh::Error("the solid has no surface, nothing was written");
  return mesh;
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
    return Inside::mesh(mesh_of(Inside::level_set(volume), polygons, false, chosen, options, inner));
  });
}

Mesh extract(const Solid& solid, const ExtractOptions& options, Context& context) {
  return run(context, [&](RunContext& inner) {
    const ChosenExtractor chosen = choose(options, kOfVolumes);
    const auto& data = Inside::data(solid);
    return Inside::mesh(contour(Inside::level_set(data.level_set), data.hermite, chosen, options, inner));
  });
}

Mesh remesh(const Mesh& mesh, const VoxelizeOptions& voxelizing, const ExtractOptions& extracting,
            Context& context) {
  return run(context, [&](RunContext& inner) {
    if (voxelizing.like) throw hermesh::Error("only voxelize takes the lattice of another volume");
    const ChosenVoxelizer voxelizer = choose(voxelizing);
    const ChosenExtractor extractor = choose(extracting, kOfPolygons);
    PolygonMesh copy;
    const PolygonMesh& polygons = Inside::sampled(mesh, copy);
    const double voxel_size = voxel_size_of(polygons, voxelizing);
    const LevelSet level_set = level_set_of(polygons, voxel_size, voxelizing, voxelizer, inner);
    return Inside::mesh(mesh_of(level_set, &polygons, true, extractor, extracting, inner));
  });
}

Mesh combine(Boolean operation, const Mesh& a, const Mesh& b, const VoxelizeOptions& voxelizing,
             const ExtractOptions& extracting, Context& context) {
  return run(context, [&](RunContext& inner) {
    if (voxelizing.like) throw hermesh::Error("only voxelize takes the lattice of another volume");
    const ChosenVoxelizer voxelizer = choose(voxelizing);
    if (voxelizer.options.is("signs", "unsigned"))
      throw hermesh::Error(
          "the option signs=unsigned leaves the solids without an inside that could be combined");
    const ChosenExtractor extractor = choose(extracting, kOfPolygons);
    PolygonMesh copy_of_a, copy_of_b;
    const PolygonMesh& first = Inside::sampled(a, copy_of_a);
    const PolygonMesh& second = Inside::sampled(b, copy_of_b);
    // A resolution counts along the longer operand, so that the order of the two does not matter.
    const bool second_is_longer = bounds(second).size().maxCoeff() > bounds(first).size().maxCoeff();
    const SharedLattice lattice =
        shared_lattice(first, second, voxel_size_of(second_is_longer ? second : first, voxelizing));
    const auto sampled = [&](const PolygonMesh& mesh, const std::string& name) {
      const auto sample = [&](const PolygonMesh& framed) {
        const LevelSet level_set = level_set_of(framed, lattice.voxel_size, voxelizing, voxelizer, inner);
        return solid_of(framed, level_set, ThinRule::drop, inner).solid;
      };
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
    const std::string about_slivers =
        lost.edges > 0 ? lost_slivers_note(lost, boolean, lattice.voxel_size) : "";
    if (result.hermite.leaves.empty())
      throw hermesh::Error(lost.edges > 0
                               ? "the result is thinner than a voxel everywhere, nothing was written: " +
                                     about_slivers
                               : "the result is empty, nothing was written: no sample and no edge of the "
                                 "lattice lies in it");
    if (lost.edges > 0) inner.note(about_slivers);
    return Inside::mesh(contour(result.level_set, result.hermite, extractor, extracting, inner));
  });
}

}  // namespace hermesh::v1
