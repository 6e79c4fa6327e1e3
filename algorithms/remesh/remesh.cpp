#include "algorithms/remesh/remesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "algorithms/core/disjoint_sets.h"
#include "algorithms/core/number_text.h"
#include "algorithms/core/run_context.h"
#include "algorithms/extraction/adaptivity_field.h"
#include "algorithms/extraction/explain.h"
#include "algorithms/io/written_precision.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/search/transfer_attributes.h"
#include "algorithms/voxelization/outputs/lost_surface.h"

namespace hermesh {
namespace {

/// Returns the number of sets of polygons that are connected by shared vertices.
std::size_t count_components(const PolygonMesh& mesh) {
  DisjointSets sets(mesh.points.size());
  std::vector<bool> used(mesh.points.size());
  const auto join = [&](const auto& polygons) {
    for (const auto& polygon : polygons)
      for (const std::uint32_t corner : polygon) used[corner] = true, sets.join(polygon[0], corner);
  };
  join(mesh.triangles);
  join(mesh.quads);
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < sets.size(); ++i) count += used[i] && sets.find(i) == i;
  return count;
}

/// Adds a note if the coordinates of polygons have been rounded to single precision far from the origin: if
/// all are multiples of its step there, some odd ones, and that is coarser than a twentieth of a voxel.
void note_rounded_coordinates(const PolygonMesh& mesh, double voxel_size, RunContext& context) {
  constexpr double kShare = 0.05;
  const Bounds box = bounds(mesh);
  double coarsest = 0.0, there = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double largest = std::max(std::abs(box.lower[axis]), std::abs(box.upper[axis]));
    const double step = largest > 0.0 ? std::ldexp(1.0, std::ilogb(largest) - 23) : 0.0;
    if (!(step > kShare * voxel_size) || step <= coarsest) continue;
    bool is_rounded = true, is_odd = false;
    for (std::size_t p = 0; p < mesh.points.size() && is_rounded; ++p) {
      const double steps = mesh.world(p)[axis] / step;
      is_rounded = steps == std::round(steps);
      is_odd = is_odd || std::fmod(steps, 2.0) != 0.0;
    }
    if (is_rounded && is_odd) coarsest = step, there = largest;
  }
  if (coarsest > 0.0)
    context.note(
        "coordinates as large as " + text(there) + " are stored in single precision, in steps of " +
        text(coarsest) + ", which is " + text(coarsest / voxel_size) +
        " voxel: the shape was rounded before it was read; subtract an offset before single precision "
        "is used, or store doubles");
}

/// Converts the offset of polygons to a mesh. Where polygons do not bound their solid, distances are those to
/// the solid's mesh.
Remeshed remesh_offset(const PolygonMesh& mesh, const VoxelizeRecipe& voxelizing, ExtractRecipe recipe,
                       RunContext& context) {
  const Offset& offset = *voxelizing.offset;
  Remeshed made;
  PolygonMesh boundary;
  const PolygonMesh* source = &mesh;
  LevelSet level_set;
  if (offset.kind == Offset::Kind::solid) {
    VoxelizeRecipe plain = voxelizing;
    plain.thin = ThinRule::keep;  // without the note on lost parts, of which an offset loses none
    level_set = make_level_set(mesh, plain, context).level_set;
    if (!bound_their_solid(mesh, level_set, context)) {
      ExtractRecipe whole = recipe;
      whole.out.clear();
      boundary = extract_surface(level_set, &mesh, whole, context);
      // Polygons within the solid are not nearest to a position outside.
      if (offset.distance > 0.0) boundary = joined(boundary, mesh);
      source = &boundary;
    }
  }
  made.voxel_size = voxel_size_of(voxelizing, mesh);
  Stopwatch watch;
  const SampledSolid solid = offset_solid(*source, level_set, made.voxel_size, offset, context);
  made.seconds = watch.seconds();
  made.voxels = solid.level_set.active_voxels();
  recipe.hermite = &solid.hermite;
  recipe.ends.reset();
  Stopwatch extraction;
  made.mesh = extract_surface(solid.level_set, nullptr, recipe, context);
  made.extract_seconds = extraction.seconds();
  made.offset = offset_errors(*source, solid.hermite, made.mesh, offset.radius(), context);
  return made;
}

}  // namespace

ChosenVoxelizer choose(std::span<const Voxelizer> table, const std::string& name, const GivenOptions& given) {
  const Voxelizer& voxelizer = find_variant(table, name);
  return {voxelizer, Options(name, voxelizer.options, given)};
}

ChosenExtractor choose(std::span<const Extractor> table, const std::string& name, const GivenOptions& given) {
  const Extractor& extractor = find_variant(table, name);
  return {extractor, Options(name, extractor.options, given)};
}

double voxel_size_of(const VoxelizeRecipe& recipe, const PolygonMesh& mesh) {
  return recipe.voxel_size ? *recipe.voxel_size : bounds(mesh).size().maxCoeff() / recipe.resolution;
}

VoxelizationInput voxelization_input(const PolygonMesh& mesh, const VoxelizeRecipe& recipe,
                                     RunContext& context) {
  return {.mesh = mesh,
          .voxel_size = voxel_size_of(recipe, mesh),
          .exterior_band = recipe.exterior_band,
          .interior_band = recipe.interior_band,
          .context = context,
          .options = recipe.chosen.options};
}

const char* reason_to_drop_thin_parts(const ChosenVoxelizer& chosen, double isovalue) {
  if (chosen.voxelizer.name != "hermesh") return "the voxelizer is not hermesh";
  if (chosen.options.is("signs", "unsigned")) return "unsigned distances have no inside";
  if (isovalue != 0.0) return "the surface of the isovalue is not that of the polygons";
  return nullptr;
}

GivenOptions with_open_sheets(const std::string& voxelizer, GivenOptions given) {
  if (voxelizer == "hermesh") given.emplace("signs", "auto-sheets");
  return given;
}

LevelSet voxelize(const PolygonMesh& mesh, const VoxelizeRecipe& recipe, RunContext& context) {
  return recipe.chosen.voxelizer.voxelize(voxelization_input(mesh, recipe, context));
}

MadeLevelSet make_level_set(const PolygonMesh& mesh, const VoxelizeRecipe& recipe, RunContext& context) {
  MadeLevelSet made;
  made.voxel_size = voxel_size_of(recipe, mesh);
  check_voxelization_fits(mesh, made.voxel_size, recipe.exterior_band, recipe.interior_band);
  note_rounded_coordinates(mesh, made.voxel_size, context);
  Stopwatch watch;
  made.level_set = voxelize(mesh, recipe, context);
  context.check();
  made.seconds = watch.seconds();
  made.voxels = made.level_set.active_voxels();
  if (recipe.thin == ThinRule::drop)
    note_lost_surface(mesh, made.level_set, recipe.chosen.voxelizer, context);
  return made;
}

MadeSolid make_solid(const PolygonMesh& mesh, const VoxelizeRecipe& recipe, RunContext& context) {
  const MadeLevelSet made = make_level_set(mesh, recipe, context);
  MadeSolid solid{made, solid_of(mesh, made.level_set, recipe.thin, context)};
  if (solid.thin) context.note(thin_note(*solid.thin, solid.voxel_size));
  return solid;
}

EndedMesh extract(const LevelSet& volume, const PolygonMesh* source, const ExtractRecipe& recipe,
                  RunContext& context) {
  const bool has_file = !recipe.out.empty();
  if (has_file) check_written_precision(recipe.out, volume);
  const ExtractionInput input = {
      .level_set = volume,
      .isovalue = recipe.isovalue,
      .source = source,
      .options = recipe.chosen.options,
      .context = context,
      .field = recipe.field,
      .hermite = recipe.hermite,
      .written_in_single = recipe.written_in_single || (has_file && is_written_in_single(recipe.out))};
  if (recipe.ends) return extract_with_ends(recipe.chosen.extractor, input, *recipe.ends);
  return {recipe.chosen.extractor.extract(input), {}};
}

PolygonMesh extract_surface(const LevelSet& volume, const PolygonMesh* source, const ExtractRecipe& recipe,
                            RunContext& context) {
  EndedMesh made = extract(volume, source, recipe, context);
  context.check();
  // No reader accepts a mesh file without polygons, ours included.
  if (made.mesh.empty() && recipe.field && recipe.field->outside == AdaptivityField::Outside::nothing)
    throw Error("the mask contains no part of the surface, so nothing was written");
  if (made.mesh.empty())
    throw Error(no_surface(volume, recipe.isovalue, source || recipe.hermite, recipe.chosen.extractor.name));
  if (!recipe.ends) return std::move(made.mesh);
  if (const std::string note = ends_note(made.ends, *recipe.ends); !note.empty()) context.note(note);
  return std::move(made.mesh);
}

Remeshed remesh(const PolygonMesh& mesh, const VoxelizeRecipe& voxelizing, const ExtractRecipe& extracting,
                RunContext& context) {
  if (voxelizing.offset) return remesh_offset(mesh, voxelizing, extracting, context);
  ExtractRecipe recipe = extracting;
  const PolygonMesh* source = &mesh;
  MadeSolid solid;
  if (voxelizing.thin == ThinRule::drop) {
    MadeLevelSet made = make_level_set(mesh, voxelizing, context);
    static_cast<VoxelizationFacts&>(solid) = made;
    solid.solid.level_set = std::move(made.level_set);
  } else {
    solid = make_solid(mesh, voxelizing, context);
    recipe.hermite = &solid.solid.hermite;
    const Options& options = recipe.chosen.options;
    const bool exact_crossings = options.is("crossings", "exact");
    if (solid.thin && exact_crossings)
      throw Error(
          "crossings=exact takes crossings from the polygons, but thickened parts are not on them; drop thin "
          "parts");
    if (!solid.thin && (options.is("hermite", "auto") || options.is("hermite", "exact") || exact_crossings))
      if (const std::string note = missed_edges_note(solid.solid.sampling); !note.empty()) context.note(note);
    // Thickened parts are not on the polygons, and a solid has no end of the data.
    if (solid.thin) source = nullptr, recipe.ends.reset();
  }
  Remeshed made;
  static_cast<VoxelizationFacts&>(made) = solid;
  Stopwatch watch;
  made.mesh = extract_surface(solid.solid.level_set, source, recipe, context);
  made.extract_seconds = watch.seconds();
  made.thin = solid.thin;
  note_components(mesh, made.mesh, context);
  return made;
}

void note_components(const PolygonMesh& polygons, const PolygonMesh& mesh, RunContext& context) {
  const std::size_t before = count_components(polygons), after = count_components(mesh);
  // A few more are expected, because intersecting polygons are one solid or several.
  if (after < 2 * before + 8) return;
  context.note("the mesh has " + std::to_string(after) + " components and the polygons have " +
               std::to_string(before) +
               ": gaps and walls that are about as thin as a voxel came apart; smaller voxels mostly leave "
               "fewer");
}

}  // namespace hermesh
