#include "experiments/cli/bounded.h"

#include <algorithm>

#include "algorithms/core/run_context.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/written_precision.h"
#include "algorithms/remesh/certificate.h"
#include "experiments/cli/cli11.h"

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

/// Adds the balls outside of which the bound holds to the JSON document.
void report_exceptions(const BoundedMesh& bounded, Session& session) {
  Json balls = Json::array();
  for (const UnmetPlace& ball : bounded.excepted)
    balls.push_back({{"position", {ball.place.x(), ball.place.y(), ball.place.z()}},
                     {"radius", ball.radius},
                     {"distance", ball.distance},
                     {"area", ball.area},
                     {"reason", ball.why == Unmet::hole ? "hole" : "thin"}});
  made(session, "exceptions", balls);
  made(session, "excepted_area", bounded.excepted_area());
}

/// Returns true if validation/check_certificate.py reads a file: .off, .obj, .ply and .stl.
bool can_be_checked(const std::string& path) { return is_mesh_path(path) && !states_unit(path); }

/// Writes the certificate of a bounded mesh and reports what it does not cover.
void certify(const std::string& in, const std::string& file, const BoundedMesh& bounded, Session& session) {
  const std::size_t notes = session.context.notes.size();
  const MeshFile input = read_mesh_file(in, session.context, {.triangle_numbers = true});
  session.context.notes.resize(notes);  // they are those of the first time
  const CertificateReport report =
      write_certificate(file, input, bounded.mesh, bounded.error, session.context);
  made(session, "certificate",
       {{"file", file},
        {"pieces", report.pieces},
        {"uncovered_input", report.uncovered_input},
        {"uncovered_output", report.uncovered_output}});
  if (report.uncovered_input + report.uncovered_output > 0.0)
    session.context.note("the certificate does not cover polygons of area " + text(report.uncovered_input) +
                         ", such as those inside the solid, and an area of " + text(report.uncovered_output) +
                         " of the mesh; its check needs --uncovered");
}

}  // namespace

void add_bound_options(CLI::App& command, CLI::App& size, BoundArguments& bound) {
  size.add_option("--error", bound.error,
                  "In place of a size the certified bound of the two-sided distance between the mesh and the "
                  "polygons' solid: in world units, with % of the bounding box's diagonal, or with a unit if "
                  "that of the coordinates is known (0.05mm)");
  size.add_option("--triangles", bound.triangles,
                  "In place of a size the maximum number of triangles; the mesh has the smallest certified "
                  "error found. With --error the command fails if that is larger")
      ->transform(whole_number(4, std::int64_t(1) << 31));
  CLI::Option_group* group = command.add_option_group("With --error or --triangles");
  group->add_flag("--over-holes", bound.over_holes,
                  "Allow the mesh to close holes; the bound there is to the surface where the winding number "
                  "is 1/2");
  group->add_flag("--except-thin", bound.except_thin,
                  "Where the bound cannot be reached (holes, walls and gaps too thin for the voxels), let it "
                  "hold elsewhere, and list these places in a note and in --json as balls (default: the "
                  "command fails)");
  group->add_flag("--through-volume", bound.through_volume,
                  "Make a volume also if the polygons are a closed, manifold mesh free of self-intersection "
                  "(default: such a mesh is simplified itself, which preserves its topology and is faster)");
  group
      ->add_option("--limit-points", bound.most_points,
                   "Maximum number of vertices of the finest mesh (default: 3e7, some 9 GiB, with --error; "
                   "4e5 per attempt with --triangles); the command fails if the bound needs more")
      ->check(CLI::Range(1e3, 1e9));
  group
      ->add_option(
          "--smallest-voxel", bound.smallest_voxel,
          "Smallest voxel size to try, in world units (default: an eighth of the error); the command "
          "fails if a wall or gap is too thin for it")
      ->check(CLI::PositiveNumber);
  group->add_option(
      "--certificate", bound.certificate,
      "Also write a proof of the bound to this file, which check_certificate.py verifies in exact "
      "arithmetic, without hermesh");
}

void check_bound_usage(const BoundArguments& bound, const VoxelizeArguments& voxelizing, const Paths& paths) {
  // Before the file is read, any unit is accepted.
  if (!bound.error.empty()) positive_length("--error", bound.error, 1.0, 1.0);
  sign_rule(voxelizing);
  if (!bound.certificate.empty() && (!can_be_checked(paths.in) || !can_be_checked(paths.out)))
    throw UsageError(
        "a certificate is about two files, .off, .obj, .ply or .stl, but the command converts '" + paths.in +
        "' to '" + paths.out + "'");
}

BoundedMesh remesh_within_bound(const BoundArguments& bound, const VoxelizeArguments& voxelizing,
                                const Paths& paths, const PolygonMesh& mesh, Session& session) {
  BoundedRemeshOptions options{
      .signs = sign_rule(voxelizing),
      .over_holes = bound.over_holes,
      .most_points = bound.most_points.value_or(bound.triangles ? 4e5 : 3e7),
      .smallest_voxel = bound.smallest_voxel,
      .written_in_single = is_written_in_single(paths.out),
      .thin = voxelizing.thin.value_or("keep") == "keep" ? ThinRule::keep : ThinRule::drop,
      .through_volume = bound.through_volume,
      .except_thin = bound.except_thin};
  const double diagonal = bounds(mesh).size().norm();
  const double bound_asked =
      bound.error.empty() ? 0.0 : positive_length("--error", bound.error, session.metres, diagonal);
  options.error = bound.triangles ? 0.0 : bound_asked;
  Stopwatch watch;
  BoundedMesh made = about_file(paths.in, [&] {
    if (!(diagonal > 0.0)) throw Error("the polygons have no extent");
    return bound.triangles ? remesh_to_budget(mesh, std::size_t(*bound.triangles), options, session.context)
                           : bounded_remesh(mesh, options, session.context);
  });
  session.context.check();
  if (!made.unmet.empty())
    throw Error(
        "'" + paths.in + "': " +
        (bound.triangles ? "no mesh of " + std::to_string(*bound.triangles) + " triangles was found: " : "") +
        explanation(made) + "; nothing was written");
  if (bound_asked > 0.0 && std::max(made.to_surface, made.from_surface) > bound_asked)
    throw Error("'" + paths.in + "': the smallest certified error found for " +
                std::to_string(*bound.triangles) + " triangles is " +
                length_text(session, std::max(made.to_surface, made.from_surface)) + ", above --error " +
                length_text(session, bound_asked) + "; allow more triangles or a larger error");
  session.context.figure("error_asked", made.error);
  session.context.figure("certified_to_polygons", made.to_surface);
  session.context.figure("certified_from_polygons", made.from_surface);
  session.context.figure("voxel_size", made.voxel_size);
  session.context.figure("triangles", double(made.mesh.triangle_count()));
  session.context.figure("rounds", made.rounds);
  if (made.free_area > 0.0) session.context.figure("area_that_bounds_nothing", made.free_area);
  if (made.hole_area > 0.0) session.context.figure("hole_area", made.hole_area);
  for (const std::string& note : notes(made)) session.context.note(note);
  if (made.thin) session.context.note(thin_note(*made.thin, made.voxel_size));
  report_thin_parts(made.thin, session);
  report_exceptions(made, session);
  print_extracted(
      session, made.mesh,
      made.voxel_size > 0.0 ? "voxels of " + length_text(session, made.voxel_size) : "without a volume",
      watch.seconds());
  const double larger = std::max(made.to_surface, made.from_surface);
  print_summary(session, "certified: the mesh is within " + length_text(session, made.to_surface) +
                             " of the polygons' solid, and the solid within " +
                             length_text(session, made.from_surface) + " of the mesh (" +
                             text(100.0 * larger / diagonal) + "% of the diagonal)" +
                             (made.excepted.empty() ? "" : ", EXCEPT at the places of a note"));
  if (!bound.certificate.empty()) certify(paths.in, bound.certificate, made, session);
  return made;
}

}  // namespace hermesh::cli
