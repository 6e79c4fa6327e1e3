// hermesh voxelize: polygons to volumes.
#include <memory>

#include "algorithms/core/level_set_grid.h"
#include "algorithms/core/quad_diagonals.h"
#include "algorithms/io/grid_frame.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/thesis/thesis_volumes.h"
#include "algorithms/voxelization/hermesh_voxelizer.h"
#include "algorithms/voxelization/outputs/volume_outputs.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/output_path.h"
#include "experiments/cli/pipeline/json_report.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/voxelizing.h"

namespace hermesh::cli {
namespace {

using Json = nlohmann::ordered_json;

struct VoxelizeCommand {
  Paths paths;
  VoxelizeArguments voxelizing;
  std::string grids = "sdf";
  bool fog_exterior = false;
};

/// Whether a voxelizer knows which triangle each distance is from, so that all volumes can be made.
bool knows_triangles(const std::string& voxelizer) { return voxelizer == "hermesh" || voxelizer == "thesis"; }

/// Refuses `--like` for what cannot take it. @throws Error
void check_like(const VoxelizeCommand& arguments, const VolumeRequest& request) {
  if (!arguments.voxelizing.like) return;
  if (arguments.voxelizing.voxelizer != "hermesh")
    throw Error("only the voxelizer hermesh takes --like, not " + arguments.voxelizing.voxelizer);
  if (request.hermite || request.any_attributes())
    throw Error("--like makes the grids sdf, udf, fog, triangle-id and closest-point alone");
}

VolumeRequest requested(const VoxelizeCommand& arguments) {
  return as_usage([&] {
    VolumeRequest request = parse_volume_request(arguments.grids);
    request.fog_exterior = arguments.fog_exterior;
    if (request.fog_exterior && !request.fog)
      throw Error("--fog-exterior is about the grid fog: name it in --grids");
    if (!knows_triangles(arguments.voxelizing.voxelizer) && !request.only_sdf())
      throw Error("only the voxelizers hermesh and thesis make other --grids than sdf, not " +
                  arguments.voxelizing.voxelizer);
    check_like(arguments, request);
    return request;
  });
}

std::string names_of_grids(const std::vector<openvdb::GridBase::Ptr>& grids) {
  std::string names;
  for (const auto& grid : grids) names += (names.empty() ? "" : ", ") + grid->getName();
  return names;
}

/// Takes attributes that cannot be read out of the request. The word "attributes" asks for
/// what there is, so that attributes that cannot be read stop nothing.
void drop_unreadable(VolumeRequest& request, const std::string& file, Session& session) {
  request.all_attributes = false;
  const bool nothing_else = !request.sdf && !request.udf && !request.triangle_id && !request.closest_point &&
                            !request.fog && !request.hermite && !request.any_attributes();
  if (!nothing_else) return;
  request.sdf = true;
  session.context.note("'" + file + "' has no attribute that can be read, so the volume is its sdf");
}

/// Reads the mesh of a file, and completes the request by what it needs to know of the file.
PolygonMesh read_for(VolumeRequest& request, const std::string& path, Session& session) {
  MeshFile file = read_mesh_file(path, session.context,
                                 {.attributes = request.any_attributes(),
                                  .required = request.attributes,
                                  .triangle_numbers = request.triangle_id});
  if (request.all_attributes && file.attributes.empty() && file.attributes_left_out)
    drop_unreadable(request, path, session);
  request.triangle_numbers = std::move(file.triangle_numbers);
  scale_points(file, session.scale);
  PolygonMesh mesh = about_file(path, [&] { return to_polygon_mesh(std::move(file)); });
  choose_diagonals(mesh);
  return mesh;
}

/// The volumes of the request, by a voxelizer that knows_triangles().
VolumeOutputs outputs_by(const std::string& voxelizer, const VoxelizationInput& input,
                         const VolumeRequest& request) {
  VoxelizeOptions options = voxelize_options(input);
  if (voxelizer == "hermesh") return make_volume_outputs(input.mesh, options, request, input.context);
  // Of the options only the signs are read before the voxelizer is asked: fog and Hermite data need some.
  const ThesisVoxelizerOptions of_thesis = thesis_voxelizer_options(input.options);
  options.signs = of_thesis.signs ? SignRule::flood_fill : SignRule::none;
  return make_volume_outputs(
      input.mesh, options, request,
      [&](const VoxelizeOptions& asked) { return thesis_voxelization(input, of_thesis, asked.nearest); },
      input.context);
}

/// Replaces the level set, and the Hermite data if there are any, by those in which thin parts are thickened.
void keep_thin_parts(VolumeOutputs& outputs, const VolumeRequest& request, const PolygonMesh& mesh,
                     ThinRule rule, Session& session) {
  if (rule == ThinRule::drop || !request.sdf) return;
  // Without signs the distances are a grid "udf".
  const auto named = [&](const std::string& name) {
    return std::ranges::find_if(outputs.grids, [&](const auto& grid) { return grid->getName() == name; });
  };
  auto grid = named("sdf");
  if (grid == outputs.grids.end()) grid = named("udf");
  const auto distances = openvdb::gridPtrCast<openvdb::FloatGrid>(*grid);
  const double voxel_size = distances->voxelSize().x();
  PolygonSolid made = solid_of(mesh, make_level_set(distances), rule, session.context);
  note_thin_parts(made.thin, voxel_size, session);
  if (!made.thin) return;
  *grid = made.solid.level_set.grid().grid->deepCopy();
  if (outputs.hermite) outputs.hermite = std::move(made.solid.hermite);
  if (outputs.grids.size() > 1)
    session.context.note(
        "only the level set and the Hermite data have the thickened parts, the other grids have not");
}

/// Makes the grids of the request by a voxelizer that knows which triangle is nearest, and writes them.
void write_outputs(const VoxelizeCommand& arguments, VolumeRequest request, const ChosenVoxelizer& chosen,
                   Session& session) {
  const Paths& paths = arguments.paths;
  PolygonMesh mesh = read_for(request, paths.in, session);
  VoxelizeArguments voxelizing = arguments.voxelizing;
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
      voxelization_input(mesh, recipe_of(mesh, paths.in, voxelizing, chosen), session.context);
  const Stopwatch watch;
  const ThinRule rule = thin_rule(voxelizing, chosen);
  VolumeOutputs outputs = outputs_by(chosen.voxelizer.name, input, request);
  about_file(paths.in, [&] { keep_thin_parts(outputs, request, mesh, rule, session); });
  if (voxelizing.like) out_of_frame(outputs.grids, frame, first);
  session.context.check();
  Json names = Json::array();
  for (const openvdb::GridBase::Ptr& grid : outputs.grids) names.push_back(grid->getName());
  made(session, "grids", names);
  print_voxelized(session, paths.in, input, outputs.active_voxels, chosen.voxelizer.name, watch.seconds());
  for (const openvdb::GridBase::Ptr& grid : outputs.grids)
    if (rule == ThinRule::drop && grid->getName() == "sdf")
      note_lost_surface(mesh, make_level_set(openvdb::gridPtrCast<openvdb::FloatGrid>(grid)), chosen,
                        session);
  write_volume_outputs(paths.out, outputs, session.context);
  print_summary(session, "wrote " + paths.out + ": " + names_of_grids(outputs.grids));
  if (outputs.hermite)
    print_summary(session, "wrote " + hermite_path(paths.out).string() + ": hermite, " +
                               std::to_string(outputs.hermite->crossings.size()) + " crossing edges");
}

int run_voxelize(const VoxelizeCommand& arguments, Session& session) {
  const ChosenVoxelizer chosen = choose_voxelizer(arguments.voxelizing);
  const VolumeRequest request = requested(arguments);
  check_volume_output(arguments.paths.out);
  if (request.hermite && session.writes_stream)
    throw UsageError(
        "the grid hermite is a second file, which the standard output cannot hold: name an output");
  if (request.hermite) check_writable(hermite_path(arguments.paths.out));
  if (knows_triangles(chosen.voxelizer.name)) {
    write_outputs(arguments, request, chosen, session);
  } else {
    const PolygonMesh mesh = read_polygons(arguments.paths.in, session);
    const LevelSet level_set = voxelize(mesh, arguments.paths.in, arguments.voxelizing, chosen, session);
    write_level_set(arguments.paths.out, level_set, session.context);
  }
  work_is_finished();
  return kDone;
}

}  // namespace

void add_voxelize(CLI::App& app, Session& session) {
  const auto arguments = std::make_shared<VoxelizeCommand>();
  CLI::App* command =
      add_command(app, session, "voxelize", "Polygons to volumes: a level set, fog, closest points, ...");
  add_paths(*command, session, arguments->paths, kMeshIn, FileKind::mesh,
            "Volumes: .vdb, or - for the standard output", FileKind::volume, true);
  add_json_option(*command, session);
  add_voxelize_options(*command, arguments->voxelizing, true);
  command->add_option(
      "--grids", arguments->grids,
      "Which volumes, separated by commas: sdf (the default), udf, closest-point, triangle-id, fog, "
      "hermite (into OUT.hermite.vdb), attributes (all that PLY and OBJ hold: normals, colours, ...), "
      "attribute:NAME");
  command->add_flag("--fog-exterior", arguments->fog_exterior,
                    "Spread the fog's ramp over both bands, not the interior one alone");
  command->callback([arguments, &session] {
    session.command = [arguments, &session] { return run_voxelize(*arguments, session); };
  });
}

}  // namespace hermesh::cli
