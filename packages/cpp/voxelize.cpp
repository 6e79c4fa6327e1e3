// Polygons to volumes.
#include <cmath>

#include "algorithms/io/grid_frame.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/variants.h"
#include "algorithms/voxelization/outputs/lost_surface.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"
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
    require(std::isfinite(band) && band >= 1.0,
            "a band must be a finite number of voxels of at least 1, not " + std::to_string(band));
  return {voxelizer, hermesh::Options(voxelizer.name, voxelizer.options, options.options)};
}

double voxel_size_of(const PolygonMesh& mesh, const VoxelizeOptions& options) {
  require(
      int(options.resolution.has_value()) + int(options.voxel_size.has_value()) + int(bool(options.like)) ==
          1,
      "give the voxel size by exactly one of resolution, voxel_size and like");
  if (options.like) return grid_frame(Inside::grid(options.like).grid->transform()).voxel_size;
  if (options.voxel_size) {
    require(std::isfinite(*options.voxel_size) && *options.voxel_size > 0.0,
            "the voxel size must be a finite number above 0, not " + std::to_string(*options.voxel_size));
    return *options.voxel_size;
  }
  require(*options.resolution >= 1,
          "the resolution must be a whole number of at least 1, not " + std::to_string(*options.resolution));
  const double longest_side = bounds(mesh).size().maxCoeff();
  require(longest_side > 0.0,
          "the mesh has no extent, so a resolution gives no voxel size; give a voxel size");
  return longest_side / static_cast<double>(*options.resolution);
}

namespace {

void refuse_thin_parts(const VoxelizeOptions& options) {
  require(options.thin.value_or(Thin::drop) == Thin::drop,
          "voxelize loses thin parts, with a note; remesh, combine and fracture keep them");
}

VolumeRequest requested(const std::string& grids, const VoxelizeOptions& options, bool fog_exterior) {
  VolumeRequest request = parse_volume_request(grids);
  request.fog_exterior = fog_exterior;
  require(!request.hermite, "Hermite data are not a volume: make a Solid of the level set of the mesh");
  require(!fog_exterior || request.fog, "fog_exterior concerns the grid fog: name it among the grids");
  require(knows_triangles(options.voxelizer) || request.only_sdf(),
          "only the voxelizers hermesh and thesis make other grids than sdf, not " + options.voxelizer);
  require(!options.like || options.voxelizer == "hermesh",
          "only the voxelizer hermesh takes the lattice of another volume, not " + options.voxelizer);
  require(!options.like || !request.any_attributes(),
          "the lattice of another volume is only for the grids sdf, udf, fog, triangle-id and closest-point");
  return request;
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
  const VolumeOutputs outputs = make_volume_outputs(chosen.voxelizer,
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
    // The mesh in its frame is not at the position of the level set, which is in world coordinates again.
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
    refuse_thin_parts(options);
    // The lattice of another volume is for the voxelizer that makes all volumes.
    if (options.like || knows_triangles(options.voxelizer))
      return volumes_of(mesh, "sdf", options, false, inner).front();
    const ChosenVoxelizer chosen = choose(options);
    PolygonMesh copy;
    const PolygonMesh& polygons = Inside::sampled(mesh, copy);
    const double voxel_size = voxel_size_of(polygons, options);
    check_voxelization_fits(polygons, voxel_size, options.exterior_band, options.interior_band);
    const LevelSet level_set = chosen.voxelizer.voxelize({.mesh = polygons,
                                                          .voxel_size = voxel_size,
                                                          .exterior_band = options.exterior_band,
                                                          .interior_band = options.interior_band,
                                                          .context = inner,
                                                          .options = chosen.options});
    inner.check();
    note_lost_surface(polygons, level_set, chosen.voxelizer, inner);
    return Inside::volume(level_set);
  });
}

std::vector<Volume> voxelize_grids(const Mesh& mesh, const std::string& grids, const VoxelizeOptions& options,
                                   Context& context, bool fog_exterior) {
  return run(context, [&](RunContext& inner) {
    refuse_thin_parts(options);
    return volumes_of(mesh, grids, options, fog_exterior, inner);
  });
}

}  // namespace hermesh::v1
