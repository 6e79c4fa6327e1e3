#include "experiments/cli/bounded.h"

#include <charconv>
#include <cmath>

#include "algorithms/io/written_precision.h"
#include "algorithms/remesh/bounded_remesh.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/extracting.h"
#include "experiments/cli/format.h"
#include "experiments/cli/output_path.h"
#include "experiments/cli/pipeline/command_files.h"
#include "experiments/cli/validators.h"

namespace hermesh::cli {
namespace {

SignRule sign_rule(const VoxelizeArguments& voxelizing) {
  const std::string rule = voxelizing.signs.value_or("winding-number");
  if (rule == "winding-number") return SignRule::winding_number;
  if (rule == "flood-fill") return SignRule::flood_fill;
  if (rule == "auto") return SignRule::automatic;
  throw UsageError(
      "a bound needs an inside: --signs must be winding-number (the default with --error and --triangles), "
      "flood-fill or auto, not '" +
      rule + "'");
}

}  // namespace

void add_bound_options(CLI::App& command, CLI::App& size, BoundArguments& arguments) {
  size.add_option(
      "--error", arguments.error,
      "Instead of a size the largest distance between the mesh and the polygons' solid, both ways, which is "
      "proved: a number in world units, with % of the diagonal of the polygons' box, or, where --units says "
      "what the file's numbers are, with a unit (0.05mm)");
  size.add_option("--triangles", arguments.triangles,
                  "Instead of a size the number of triangles at most: the mesh with the smallest proved "
                  "distance that was "
                  "found for them")
      ->transform(whole_number(4, std::int64_t(1) << 31));
  CLI::Option_group* group = command.add_option_group("With --error or --triangles");
  group->add_flag(
      "--over-holes", arguments.over_holes,
      "Let the mesh close holes, where no polygon is near that a distance could be proved to; the distance "
      "there is to the surface on which the winding number is 1/2");
  group
      ->add_option(
          "--limit-points", arguments.most_points,
          "Points of the finest mesh at most (default: 3e7, some 9 GiB, with --error, and 4e5 in each "
          "try with --triangles); the bound is refused where it needs more")
      ->check(CLI::Range(1e3, 1e9));
  group
      ->add_option("--smallest-voxel", arguments.smallest_voxel,
                   "Edge of the smallest voxel that may be tried, in world units (default: an eighth of the "
                   "error); the "
                   "bound is refused where a wall or gap is too thin for it")
      ->check(CLI::PositiveNumber);
}

void check_bound_options(const CLI::App& command, const BoundArguments& arguments,
                         const VoxelizeArguments& voxelizing, const std::string& units) {
  refuse_idle(command,
              {"--extractor", "-o", "--voxelizer", "--voxelizer-option", "--exterior-band", "--interior-band",
               "--isovalue", "--max-loss", "--mask", "--frustum", "--frustum-resolution", "--outside",
               "--tolerance-grid"},
              "with --error and --triangles the method is chosen for the bound");
  sign_rule(voxelizing);
  if (!arguments.error.empty()) error_in_world_units(arguments.error, units, 1.0);
}

void refuse_without_bound(const CLI::App& command) {
  refuse_idle(command, {"--over-holes", "--limit-points", "--smallest-voxel"},
              "it needs --error or --triangles");
}

double error_in_world_units(const std::string& text, const std::string& units, double diagonal) {
  double value = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string unit(end, text.data() + text.size());
  if (failure != std::errc() || !std::isfinite(value) || value <= 0.0)
    throw UsageError("--error must be a number above 0, such as 0.05, 0.1% or 0.05mm, not '" + text + "'");
  if (unit.empty()) return value;
  if (unit == "%") return value / 100.0 * diagonal;
  const std::optional<double> metres = metres_in(unit);
  if (!metres) throw UsageError("--error '" + text + "' ends with what is no unit; see --units");
  if (units.empty())
    throw UsageError("--error '" + text +
                     "' has a unit, and mesh files have none: say with --units what the file's numbers are");
  return value * *metres;
}

int run_bounded(const Paths& paths, const BoundArguments& arguments, const VoxelizeArguments& voxelizing,
                Session& session) {
  check_mesh_output(paths.out);
  const PolygonMesh mesh = read_polygons(paths.in, session);
  const double diagonal = bounds(mesh).size().norm();
  BoundedRemeshOptions options{
      .signs = sign_rule(voxelizing),
      .over_holes = arguments.over_holes,
      .most_points = arguments.most_points.value_or(arguments.triangles ? 4e5 : 3e7),
      .smallest_voxel = arguments.smallest_voxel,
      .written_in_single = is_written_in_single(paths.out),
      .thin = voxelizing.thin.value_or("keep") == "keep" ? ThinRule::keep : ThinRule::drop};
  if (!arguments.triangles) options.error = error_in_world_units(arguments.error, session.units, diagonal);
  const Stopwatch watch;
  const BoundedMesh made = about_file(paths.in, [&] {
    if (!(diagonal > 0.0)) throw Error("the polygons have no extent");
    return arguments.triangles
               ? remesh_to_budget(mesh, std::size_t(*arguments.triangles), options, session.context)
               : bounded_remesh(mesh, options, session.context);
  });
  session.context.check();
  const std::string budget =
      arguments.triangles ? "no mesh of " + std::to_string(*arguments.triangles) + " triangles was found: "
                          : "";
  if (!made.unmet.empty())
    throw Error("'" + paths.in + "': " + budget + explanation(made) + "; nothing was written");
  session.context.figure("error_asked", made.error);
  session.context.figure("certified_to_polygons", made.to_surface);
  session.context.figure("certified_from_polygons", made.from_surface);
  session.context.figure("voxel_size", made.voxel_size);
  session.context.figure("triangles", double(made.mesh.triangle_count()));
  session.context.figure("rounds", made.rounds);
  if (made.free_area > 0.0) session.context.figure("area_that_bounds_nothing", made.free_area);
  if (made.hole_area > 0.0) session.context.figure("hole_area", made.hole_area);
  for (const std::string& note : notes(made)) session.context.note(note);
  note_thin_parts(made.thin, made.voxel_size, session);
  print_extracted(session, made.mesh, "voxels of " + text(made.voxel_size), watch.seconds());
  const double bound = std::max(made.to_surface, made.from_surface);
  print_summary(session, "proved: the mesh is within " + text(made.to_surface) +
                             " of the polygons' solid and that within " + text(made.from_surface) +
                             " of the mesh (" + text(100.0 * bound / diagonal) + "% of the diagonal)");
  note_components(mesh, made.mesh, session);
  save(paths.out, made.mesh, session);
  return kDone;
}

}  // namespace hermesh::cli
