#include "experiments/cli/voxelizing.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>

#include "algorithms/core/quad_diagonals.h"
#include "algorithms/lattice/memory_estimate.h"
#include "algorithms/voxelization/outputs/lost_surface.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/format.h"
#include "experiments/cli/help/suggestions.h"
#include "experiments/cli/pipeline/json_report.h"
#include "experiments/cli/terminal_progress.h"
#include "experiments/cli/validators.h"
#include "experiments/variants.h"

namespace hermesh::cli {
namespace {

CLI::Validator at_least(double minimum, const std::string& words) {
  return CLI::Validator(
      [minimum, words](const std::string& given) {
        double value = 0.0;
        const bool good = CLI::detail::lexical_cast(given, value) && std::isfinite(value) && value >= minimum;
        return good ? std::string() : "must be " + words + ", not '" + given + "'";
      },
      "");
}

double voxel_size_for(const PolygonMesh& mesh, const VoxelizeArguments& arguments, const std::string& file) {
  const double longest_side = bounds(mesh).size().maxCoeff();
  if (arguments.voxel_size && *arguments.voxel_size > longest_side && !arguments.any_size)
    throw Error("'" + file + "' is smaller than a voxel: its longest side is " + text(longest_side) +
                " and --voxel-size is " + text(*arguments.voxel_size) +
                " (world units, metres if --units is given); use smaller voxels");
  if (arguments.voxel_size) return *arguments.voxel_size;
  if (!(longest_side > 0.0))
    throw Error("'" + file + "' has no extent, so that --resolution gives no voxel size: use --voxel-size");
  return longest_side / static_cast<double>(*arguments.resolution);
}

}  // namespace

void add_paths(CLI::App& command, Session& session, Paths& paths, const std::string& in, FileKind in_kind,
               const std::string& out, FileKind out_kind, bool many) {
  command.add_option("IN", paths.in, in)->required();
  // Many inputs have outputs in a folder, and then none is named here.
  command.add_option("OUT", paths.out, out)->required(!many);
  add_files(
      command, session,
      {.inputs = {&paths.in}, .output = &paths.out, .in = in_kind, .out = out_kind, .takes_many = many});
}

CLI::App* add_voxelize_options(CLI::App& command, VoxelizeArguments& arguments, bool with_like) {
  // Exactly one of them, or the program would have to guess a size.
  CLI::Option_group* size = command.add_option_group("Voxel size, exactly one of");
  size->add_option("--voxel-size", arguments.voxel_size, "Edge of a voxel in world units")
      ->check(at_least(std::numeric_limits<double>::min(), "a finite number above 0"));
  size->add_option("--resolution", arguments.resolution, "Voxels along the longest side of the mesh")
      ->transform(whole_number(1, std::int64_t(1) << 40));
  if (with_like)
    size->add_option(
        "--like", arguments.like,
        "A .vdb whose first float grid gives voxel size, rotation and place, so that both volumes "
        "share one lattice");
  size->require_option(1);
  command.add_option("--voxelizer", arguments.voxelizer,
                     "Name of the voxelizer, see hermesh list (default: " + arguments.voxelizer + ")");
  command.add_option(
      "--signs", arguments.signs,
      "How the voxelizer hermesh finds the inside: auto (the default), flood-fill, winding-number, or "
      "unsigned for none; short for --voxelizer-option signs=...");
  command
      .add_option(
          "--thin", arguments.thin,
          "What becomes of walls, wires and open sheets that are too thin for the voxels: keep (the default) "
          "thickens them until they show, drop loses them, refuse is an error")
      ->check(CLI::IsMember({"keep", "drop", "refuse"}));
  command
      .add_option("--voxelizer-option", arguments.options,
                  "key=value, an option of the voxelizer, see hermesh list; may be repeated")
      ->allow_extra_args(false);
  // Both ends of an edge that the surface crosses are at most a voxel away from it.
  const auto band = at_least(1.0, "a finite number of voxels of at least 1");
  command
      .add_option("--exterior-band", arguments.exterior_band,
                  "Width of the band outside, in voxels (default: 3); where marching cubes follows, 1 is "
                  "enough and faster")
      ->check(band);
  command
      .add_option("--interior-band", arguments.interior_band,
                  "Width of the band inside, in voxels (default: 3; as --exterior-band)")
      ->check(band);
  return size;
}

Options parse_options(const std::string& variant, const std::vector<OptionSpec>& declared,
                      const std::vector<std::string>& texts) {
  std::map<std::string, std::string> given;
  for (const std::string& text : texts)
    if (const auto option = parse_option(text); !given.insert(option).second)
      throw Error("option '" + option.first + "' of " + variant + " is given twice");
  // A name that is near to one that there is gets a suggestion; the others are listed by Options.
  std::vector<std::string> names;
  for (const OptionSpec& option : declared) names.push_back(option.name);
  for (const auto& [name, value] : given)
    if (std::ranges::find(names, name) == names.end())
      if (const std::string meant = did_you_mean(name, names); !meant.empty())
        throw Error(variant + " has no option '" + name + "'" + meant);
  return Options(variant, declared, given);
}

ChosenVoxelizer choose_voxelizer(const VoxelizeArguments& arguments) {
  return as_usage([&] {
    check_variant_name(all_voxelizers(), "voxelizer", arguments.voxelizer);
    const Voxelizer voxelizer = find_variant(all_voxelizers(), arguments.voxelizer);
    std::vector<std::string> options = arguments.options;
    if (arguments.signs) options.push_back("signs=" + *arguments.signs);
    // Where thin parts are kept, so are open sheets.
    const bool has_signs =
        std::ranges::any_of(options, [](const auto& o) { return o.starts_with("signs="); });
    if (voxelizer.name == "hermesh" && !has_signs && arguments.thin.value_or("keep") == "keep")
      options.push_back("signs=auto-sheets");
    return ChosenVoxelizer{voxelizer, parse_options(voxelizer.name, voxelizer.options, options)};
  });
}

PolygonMesh read_polygons(const std::string& path, Session& session, const ReadOptions& options) {
  MeshFile file = read_mesh_file(path, session.context, options);
  scale_points(file, session.scale);
  PolygonMesh mesh = about_file(path, [&] { return to_polygon_mesh(std::move(file)); });
  choose_diagonals(mesh);
  return mesh;
}

void scale_points(MeshFile& file, double factor) {
  if (factor == 1.0) return;
  for (Eigen::Vector3d& point : file.points) point *= factor;
  if (file.origin) *file.origin *= factor;
}

VoxelizeRecipe recipe_of(const PolygonMesh& mesh, const std::string& file, const VoxelizeArguments& arguments,
                         const ChosenVoxelizer& chosen) {
  return {.chosen = chosen,
          .voxel_size = voxel_size_for(mesh, arguments, file),
          .exterior_band = arguments.exterior_band,
          .interior_band = arguments.interior_band};
}

LevelSet voxelize(const PolygonMesh& mesh, const std::string& file, const VoxelizeArguments& arguments,
                  const ChosenVoxelizer& chosen, Session& session) {
  const VoxelizeRecipe recipe = recipe_of(mesh, file, arguments, chosen);
  const VoxelizationInput input = voxelization_input(mesh, recipe, session.context);
  about_file(file, [&] {
    check_voxelization_fits(mesh, input.voxel_size, input.exterior_band, input.interior_band);
  });
  const Stopwatch watch;
  LevelSet level_set = hermesh::voxelize(mesh, recipe, session.context);
  session.context.check();
  print_voxelized(session, file, input, level_set.active_voxels(), chosen.voxelizer.name, watch.seconds());
  if (thin_rule(arguments, chosen) == ThinRule::drop) note_lost_surface(mesh, level_set, chosen, session);
  return level_set;
}

ThinRule thin_rule(const VoxelizeArguments& arguments, const ChosenVoxelizer& chosen, double isovalue) {
  if (arguments.thin == "drop") return ThinRule::drop;
  const char* reason = chosen.voxelizer.name != "hermesh"       ? "the voxelizer is not hermesh"
                       : chosen.options.is("signs", "unsigned") ? "distances without sign have no inside"
                       : isovalue != 0.0 ? "the surface of the isovalue is not that of the polygons"
                                         : nullptr;
  if (reason && arguments.thin) throw UsageError("--thin " + *arguments.thin + " has no effect: " + reason);
  if (reason) return ThinRule::drop;
  return arguments.thin == "refuse" ? ThinRule::refuse : ThinRule::keep;
}

void note_thin_parts(const std::optional<ThinParts>& thin, double voxel_size, Session& session) {
  made(session, "thickened_share", thin ? thin->thickened_area / thin->area : 0.0);
  made(session, "thickened_by", thin ? thin->thickest : 0.0);
  made(session, "thinnest_wall", thin ? thin->thinnest_wall : 0.0);
  made(session, "merged_share", thin ? thin->merged_area / thin->area : 0.0);
  if (thin) session.context.note(thin_note(*thin, voxel_size));
}

PolygonSolid sample_polygons(const PolygonMesh& mesh, const std::string& file,
                             const VoxelizeArguments& arguments, const ChosenVoxelizer& chosen,
                             Session& session) {
  const LevelSet level_set = voxelize(mesh, file, arguments, chosen, session);
  PolygonSolid made = about_file(
      file, [&] { return solid_of(mesh, level_set, thin_rule(arguments, chosen), session.context); });
  note_thin_parts(made.thin, level_set.voxel_size(), session);
  return made;
}

void note_lost_surface(const PolygonMesh& mesh, const LevelSet& level_set, const ChosenVoxelizer& chosen,
                       Session& session) {
  const LostSurface lost =
      find_lost_surface(mesh, level_set, leaves_out_inner_polygons(chosen.voxelizer), session.context);
  session.context.figure("lost_surface_share", lost.share());
  session.context.figure("lost_surface_thickness", lost.thickness);
  const std::string note = lost_surface_note(lost, level_set.voxel_size());
  if (!note.empty()) session.context.note(note);
}

void print_summary(const Session& session, const std::string& line) {
  if (session.log) session.log(line);
  if (session.quiet || session.json) return;
  erase_progress_line();
  std::cout << session.named(line) << '\n';
}

void print_voxelized(Session& session, const std::string& file, const VoxelizationInput& input,
                     std::size_t active_voxels, const std::string& voxelizer, double seconds) {
  made(session, "polygons", input.mesh.triangle_count());
  made(session, "voxels", active_voxels);
  made(session, "voxel_size", input.voxel_size);
  made(session, "voxelizer", voxelizer);
  print_summary(session, "voxelized " + file + ": " + std::to_string(input.mesh.triangle_count()) +
                             " triangles, " + std::to_string(active_voxels) + " voxels of " +
                             text(input.voxel_size) + ", " + voxelizer + ", " + seconds_text(seconds));
}

}  // namespace hermesh::cli
