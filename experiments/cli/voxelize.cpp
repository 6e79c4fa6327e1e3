// hermesh voxelize: polygons to volumes.
#include <memory>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/run_context.h"
#include "algorithms/io/grid_frame.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/variants.h"
#include "algorithms/voxelization/outputs/lost_surface.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/conversions.h"
#include "experiments/cli/signals.h"

namespace hermesh::cli {
namespace {

struct VoxelizeCommand {
  Paths paths;
  VoxelizeArguments voxelizing;
  std::string grids = "sdf";
  bool fog_exterior = false;
};

VolumeRequest requested(const VoxelizeCommand& arguments) {
  return as_usage([&] {
    const std::string& voxelizer = arguments.voxelizing.voxelizer;
    VolumeRequest request = parse_volume_request(arguments.grids);
    request.fog_exterior = arguments.fog_exterior;
    if (request.fog_exterior && !request.fog)
      throw Error("--fog-exterior concerns the grid fog: name it in --grids");
    if (!knows_triangles(voxelizer) && !request.only_sdf())
      throw Error("only the voxelizers hermesh and thesis make other --grids than sdf, not " + voxelizer);
    if (arguments.voxelizing.like && voxelizer != "hermesh")
      throw Error("only the voxelizer hermesh takes --like, not " + voxelizer);
    if (arguments.voxelizing.like && (request.hermite || request.any_attributes()))
      throw Error("--like makes only the grids sdf, udf, fog, triangle-id and closest-point");
    return request;
  });
}

/// Reads the mesh of a file and completes the request by the numbers of its triangles. If none of its
/// attributes can be read, the word "attributes" requests none, and the level set if it was the only word.
PolygonMesh read_for(VolumeRequest& request, const std::string& path, Session& session) {
  MeshFile file = read_mesh_file(path, session.context,
                                 {.attributes = request.any_attributes(),
                                  .required = request.attributes,
                                  .triangle_numbers = request.triangle_id});
  if (request.all_attributes && file.attributes.empty() && file.attributes_left_out) {
    request.all_attributes = false;
    if (!request.sdf && !request.udf && !request.triangle_id && !request.closest_point && !request.fog &&
        !request.hermite && !request.any_attributes()) {
      request.sdf = true;
      session.context.note("'" + path + "' has no readable attribute, so the volume is its sdf");
    }
  }
  request.triangle_numbers = std::move(file.triangle_numbers);
  return polygons_of(std::move(file), path, session);
}

/// Replaces the level set, and the Hermite data if requested, by those with thickened thin parts.
void keep_thin_parts(VolumeOutputs& outputs, const VolumeRequest& request, const PolygonMesh& mesh,
                     ThinRule rule, Session& session) {
  if (rule == ThinRule::drop || !request.sdf) return;
  const auto named = [&](const char* name) {
    return std::ranges::find_if(outputs.grids, [&](const auto& grid) { return grid->getName() == name; });
  };
  auto grid = named("sdf");
  if (grid == outputs.grids.end()) grid = named("udf");  // distances without signs
  const auto distances = openvdb::gridPtrCast<openvdb::FloatGrid>(*grid);
  const double voxel_size = distances->voxelSize().x();
  PolygonSolid made = solid_of(mesh, make_level_set(distances), rule, session.context);
  report_thin_parts(made.thin, session);
  if (!made.thin) return;
  session.context.note(thin_note(*made.thin, voxel_size));
  *grid = made.solid.level_set.grid().grid->deepCopy();
  if (outputs.hermite) outputs.hermite = std::move(made.solid.hermite);
  if (outputs.grids.size() > 1)
    session.context.note(
        "only the level set and the Hermite data have the thickened parts, not the other grids");
}

/// Makes the grids of the request by a voxelizer that knows_triangles(), and writes them.
void write_outputs(const VoxelizeCommand& arguments, VolumeRequest request, Session& session) {
  const Paths& paths = arguments.paths;
  PolygonMesh mesh = read_for(request, paths.in, session);
  VoxelizeArguments voxelizing = arguments.voxelizing;
  const Voxelizer& voxelizer = voxelizing.chosen.voxelizer;
  GridFrame frame;
  std::array<int, 3> first{};
  if (voxelizing.like) {
    frame = read_grid_frame(*voxelizing.like);
    voxelizing.voxel_size = frame.voxel_size;
    voxelizing.any_size = true;
    FramedMesh framed = into_frame(mesh, frame);
    mesh = std::move(framed.mesh);
    first = framed.first;
  }
  const VoxelizationInput input =
      voxelization_input(mesh, voxelizing.recipe(mesh, paths.in), session.context);
  Stopwatch watch;
  const ThinRule rule = voxelizing.thin_rule();
  VolumeOutputs outputs = make_volume_outputs(voxelizer, input, request);
  about_file(paths.in, [&] { keep_thin_parts(outputs, request, mesh, rule, session); });
  if (voxelizing.like) out_of_frame(outputs.grids, frame, first);
  session.context.check();
  std::string names;
  made(session, "grids", Json::array());
  for (const openvdb::GridBase::Ptr& grid : outputs.grids) {
    session.result["grids"].push_back(grid->getName());
    names += (names.empty() ? "" : ", ") + grid->getName();
  }
  print_voxelized(session, paths.in, mesh, {outputs.active_voxels, input.voxel_size, watch.seconds()},
                  voxelizer.name);
  for (const openvdb::GridBase::Ptr& grid : outputs.grids)
    if (rule == ThinRule::drop && grid->getName() == "sdf")
      note_lost_surface(mesh, make_level_set(openvdb::gridPtrCast<openvdb::FloatGrid>(grid)), voxelizer,
                        session.context);
  write_volume_outputs(paths.out, outputs, session.context);
  print_summary(session, "wrote " + paths.out + ": " + names);
  if (outputs.hermite)
    print_summary(session, "wrote " + hermite_path(paths.out).string() + ": hermite, " +
                               std::to_string(outputs.hermite->crossings.size()) + " edge crossings");
}

int run_voxelize(VoxelizeCommand& arguments, Session& session) {
  const Paths& paths = arguments.paths;
  arguments.voxelizing.choose();
  const VolumeRequest request = requested(arguments);
  check_volume_output(paths.out);
  if (request.hermite && session.writes_stream)
    throw UsageError(
        "the grid hermite is a second file, which the standard output cannot hold; name an output");
  if (request.hermite) check_writable(hermite_path(paths.out));
  if (knows_triangles(arguments.voxelizing.voxelizer)) {
    write_outputs(arguments, request, session);
  } else {
    const PolygonMesh mesh = read_polygons(paths.in, session);
    const VoxelizeRecipe recipe = arguments.voxelizing.recipe(mesh, paths.in);
    const MadeLevelSet made =
        about_file(paths.in, [&] { return make_level_set(mesh, recipe, session.context); });
    print_voxelized(session, paths.in, mesh, made, recipe.chosen.voxelizer.name);
    write_level_set(paths.out, made.level_set, session.context);
  }
  work_is_finished();
  return kDone;
}

}  // namespace

void add_voxelize(CLI::App& app, Session& session) {
  const auto arguments = std::make_shared<VoxelizeCommand>();
  CLI::App* command = add_command(app, session, "voxelize",
                                  "Convert polygons to volumes: a level set, fog, closest points, ...");
  add_paths(*command, session, arguments->paths, kMeshIn, FileKind::mesh,
            "Volumes: .vdb, or - for the standard output", FileKind::volume, true);
  add_json_option(*command, session);
  add_voxelize_options(*command, arguments->voxelizing, true);
  command->add_option("--grids", arguments->grids,
                      "Volumes to make, separated by commas: sdf (default), udf, closest-point, triangle-id, "
                      "fog, hermite (in OUT.hermite.vdb), attributes (all of a PLY or OBJ file: normals, "
                      "colours, ...), attribute:NAME");
  command->add_flag("--fog-exterior", arguments->fog_exterior,
                    "Spread the fog's ramp over both bands, not only the interior one");
  set_work(*command, session, [arguments, &session] { return run_voxelize(*arguments, session); });
}

}  // namespace hermesh::cli
