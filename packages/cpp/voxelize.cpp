// Polygons to volumes.
#include <cmath>

#include "algorithms/io/grid_frame.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/thesis/thesis_volumes.h"
#include "algorithms/variants.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"
#include "algorithms/voxelization/outputs/lost_surface.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"
#include "packages/cpp/stages.h"
#include "packages/cpp/volume_grid.h"

namespace hermesh::v1 {

std::vector<MethodInfo> voxelizers() {
  std::vector<MethodInfo> infos;
  for (const Voxelizer& voxelizer : our_voxelizers())
    infos.push_back(method_info(voxelizer.name, voxelizer.summary, voxelizer.options));
  return infos;
}

ChosenVoxelizer choose(const VoxelizeOptions& options) {
  const Voxelizer& voxelizer = find_variant(our_voxelizers(), options.voxelizer);
  for (const double band : {options.exterior_band, options.interior_band})
    if (!(std::isfinite(band) && band >= 1.0))
      throw hermesh::Error("a band must be a finite number of voxels of at least 1, not " +
                           std::to_string(band));
  return {voxelizer, hermesh::Options(voxelizer.name, voxelizer.options, options.options)};
}

namespace {

void check_one_size(const VoxelizeOptions& options) {
  if (int(options.resolution.has_value()) + int(options.voxel_size.has_value()) + int(bool(options.like)) !=
      1)
    throw hermesh::Error("say how large voxels are by exactly one of resolution, voxel_size and like");
  if (options.resolution && *options.resolution < 1)
    throw hermesh::Error("the resolution must be a whole number of at least 1, not " +
                         std::to_string(*options.resolution));
  if (options.voxel_size && !(std::isfinite(*options.voxel_size) && *options.voxel_size > 0.0))
    throw hermesh::Error("the voxel size must be a finite number above 0, not " +
                         std::to_string(*options.voxel_size));
}

}  // namespace

double voxel_size_of(const PolygonMesh& mesh, const VoxelizeOptions& options) {
  check_one_size(options);
  if (options.voxel_size) return *options.voxel_size;
  if (options.like) return grid_frame(Inside::grid(options.like).grid->transform()).voxel_size;
  const double longest_side = bounds(mesh).size().maxCoeff();
  if (!(longest_side > 0.0))
    throw hermesh::Error(
        "the mesh has no extent, so that a resolution gives no voxel size: give a voxel size");
  return longest_side / static_cast<double>(*options.resolution);
}

void note_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set, const Voxelizer& voxelizer,
                       RunContext& context) {
  const LostSurface lost = find_lost_surface(mesh, level_set, leaves_out_inner_polygons(voxelizer), context);
  context.figure("lost_surface_share", lost.share());
  context.figure("lost_surface_thickness", lost.thickness);
  const std::string note = lost_surface_note(lost, level_set.voxel_size());
  if (!note.empty()) context.note(note);
}

LevelSet level_set_of(const PolygonMesh& mesh, double voxel_size, const VoxelizeOptions& options,
                      const ChosenVoxelizer& chosen, RunContext& context) {
  check_voxelization_fits(mesh, voxel_size, options.exterior_band, options.interior_band);
  LevelSet level_set = chosen.voxelizer.voxelize({.mesh = mesh,
                                                  .voxel_size = voxel_size,
                                                  .exterior_band = options.exterior_band,
                                                  .interior_band = options.interior_band,
                                                  .context = context,
                                                  .options = chosen.options});
  context.check();
  note_lost_surface(mesh, level_set, chosen.voxelizer, context);
  return level_set;
}

namespace {

/// Whether a voxelizer knows which triangle each distance is from, so that all volumes can be made.
bool knows_triangles(const std::string& voxelizer) { return voxelizer == "hermesh" || voxelizer == "thesis"; }

VolumeRequest requested(const std::string& grids, const VoxelizeOptions& options, bool fog_exterior) {
  VolumeRequest request = parse_volume_request(grids);
  request.fog_exterior = fog_exterior;
  if (request.hermite)
    throw hermesh::Error("Hermite data are no volume: make a Solid of the mesh's level set");
  if (fog_exterior && !request.fog)
    throw hermesh::Error("fog_exterior is about the grid fog: name it among the grids");
  if (!knows_triangles(options.voxelizer) && !request.only_sdf())
    throw hermesh::Error("only the voxelizers hermesh and thesis make other grids than sdf, not " +
                         options.voxelizer);
  if (options.like && options.voxelizer != "hermesh")
    throw hermesh::Error("only the voxelizer hermesh takes the lattice of another volume, not " +
                         options.voxelizer);
  if (options.like && request.any_attributes())
    throw hermesh::Error(
        "with the lattice of another volume there are the grids sdf, udf, fog, triangle-id and "
        "closest-point alone");
  return request;
}

VolumeOutputs outputs_by(const ChosenVoxelizer& chosen, const VoxelizationInput& input,
                         const VolumeRequest& request) {
  hermesh::VoxelizeOptions options = voxelize_options(input);
  if (chosen.voxelizer.name == "hermesh")
    return make_volume_outputs(input.mesh, options, request, input.context);
  // Of the options only the signs are read before the voxelizer is asked: fog needs some.
  const ThesisVoxelizerOptions of_thesis = thesis_voxelizer_options(input.options);
  options.signs = of_thesis.signs ? SignRule::flood_fill : SignRule::none;
  return make_volume_outputs(
      input.mesh, options, request,
      [&](const hermesh::VoxelizeOptions& asked) {
        return thesis_voxelization(input, of_thesis, asked.nearest);
      },
      input.context);
}

std::vector<Volume> volumes_of(const Mesh& mesh, const std::string& grids, const VoxelizeOptions& options,
                               bool fog_exterior, RunContext& context) {
  const ChosenVoxelizer chosen = choose(options);
  const VolumeRequest request = requested(grids, options, fog_exterior);
  PolygonMesh copy;
  const PolygonMesh* polygons = &Inside::sampled(mesh, copy);
  const double voxel_size = voxel_size_of(*polygons, options);
  GridFrame frame;
  FramedMesh framed;
  if (options.like) {
    frame = grid_frame(Inside::grid(options.like).grid->transform());
    framed = into_frame(*polygons, frame);
    polygons = &framed.mesh;
  }
  const VolumeOutputs outputs = outputs_by(chosen,
                                           {.mesh = *polygons,
                                            .voxel_size = voxel_size,
                                            .exterior_band = options.exterior_band,
                                            .interior_band = options.interior_band,
                                            .context = context,
                                            .options = chosen.options},
                                           request);
  if (options.like) out_of_frame(outputs.grids, frame, framed.first);
  context.check();
  std::vector<Volume> volumes;
  for (const openvdb::GridBase::Ptr& grid : outputs.grids) {
    const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
    const LevelSet level_set = floats ? make_level_set(floats) : LevelSet();
    // In its frame the mesh lies elsewhere than its level set, which is back in the world.
    if (grid->getName() == "sdf")
      note_lost_surface(options.like ? Inside::polygons(mesh) : *polygons, level_set, chosen.voxelizer,
                        context);
    volumes.push_back(Inside::volume_of({grid, level_set, grid->getName()}));
  }
  return volumes;
}

}  // namespace

Volume voxelize(const Mesh& mesh, const VoxelizeOptions& options, Context& context) {
  return run(context, [&](RunContext& inner) {
    // The lattice of another volume is the business of the voxelizer that makes all volumes.
    if (options.like || knows_triangles(options.voxelizer))
      return volumes_of(mesh, "sdf", options, false, inner).front();
    const ChosenVoxelizer chosen = choose(options);
    PolygonMesh copy;
    const PolygonMesh& polygons = Inside::sampled(mesh, copy);
    return Inside::volume(level_set_of(polygons, voxel_size_of(polygons, options), options, chosen, inner));
  });
}

std::vector<Volume> voxelize_grids(const Mesh& mesh, const std::string& grids, const VoxelizeOptions& options,
                                   Context& context, bool fog_exterior) {
  return run(context,
             [&](RunContext& inner) { return volumes_of(mesh, grids, options, fog_exterior, inner); });
}

}  // namespace hermesh::v1
