// hermesh fracture: breaks a solid into pieces, one file each, with a conservation check.
#include <algorithm>
#include <iostream>
#include <memory>

#include "algorithms/hermite/samplers.h"
#include "algorithms/io/vdb_file.h"
#include "experiments/cli/child_run.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/conversions.h"
#include "experiments/cli/signals.h"
#include "experiments/fracture/fracture_folder.h"
#include "experiments/fracture/fracture_run.h"

namespace hermesh::cli {
namespace {

struct FractureArguments {
  Paths paths;
  VoxelizeArguments voxelizing;
  std::string grid;  ///< empty: `sdf`, or the only scalar grid
  std::string cutters, hermite = "auto", density, rule = "printed";
  FractureMethod method;
  CutterChoices choices;
  std::vector<double> impact;
  double least_volume = 27.0;
  bool no_split = false, no_picture = false, judge = false;
};

/// Starts hermesh-lab, which links the libraries for pictures, to draw the pieces; notes if there is no
/// picture.
void draw_picture(const std::filesystem::path& pieces, Session& session) {
  const Stage stage(session.context, "picture");
  const std::filesystem::path program =
      std::filesystem::canonical("/proc/self/exe").parent_path() / "hermesh-lab";
  std::error_code error;
  if (!std::filesystem::exists(program, error)) {
    session.context.note(
        "exploded.png was not drawn: hermesh-lab is not installed; install it or pass --no-picture");
    return;
  }
  ChildRun child(program, {"exploded", pieces});
  while (!child.has_ended()) {
    session.context.check();
    ChildRun::wait_for_any({&child}, 100);
  }
  if (child.exit_code() != 0) session.context.note("exploded.png was not drawn: " + child.err());
}

bool is_volume(const std::string& path) { return path.ends_with(".vdb"); }

/// Reads the object to break; `source` holds its polygons, if it has any.
FractureObject read_object(FractureArguments& arguments, std::optional<PolygonMesh>& source,
                           Session& session) {
  FractureObject object;
  const bool sized = arguments.voxelizing.voxel_size || arguments.voxelizing.resolution;
  if (is_volume(arguments.paths.in)) {
    if (sized)
      throw UsageError("'" + arguments.paths.in +
                       "' already has voxels: leave out --resolution and --voxel-size");
    if (arguments.hermite == "exact") throw UsageError("--hermite exact needs polygons, not a volume");
    object.level_set = read_level_set(arguments.paths.in, arguments.grid, session.context);
    object.hermite = about_file(arguments.paths.in,
                                [&] { return sample_level_set(object.level_set, 0.0, session.context); });
    return object;
  }
  if (!sized) throw UsageError("the voxel size is missing: pass --resolution N or --voxel-size S");
  arguments.voxelizing.choose();
  source = read_polygons(arguments.paths.in, session, {.attributes = true});
  object.source = &*source;
  MadeSolid made = make_solid(*source, arguments.paths.in, arguments.voxelizing, session);
  object.level_set = std::move(made.solid.level_set);
  object.hermite = arguments.hermite == "level-set" ? sample_level_set(object.level_set, 0.0, session.context)
                                                    : std::move(made.solid.hermite);
  return object;
}

Json head_of(const FractureArguments& arguments, const FractureObject& object) {
  const Eigen::Vector3d& origin = object.hermite.placement.origin;
  return {{"object", std::filesystem::path(arguments.paths.in).filename().string()},
          {"method", arguments.method.name},
          {"tolerance", arguments.method.tolerance},
          {"rule", arguments.method.name == "thesis" ? Json(arguments.rule) : Json()},
          {"cutters_given", without_folders(arguments.cutters)},
          {"seed", arguments.choices.seed},
          {"voxel_size", object.level_set.voxel_size()},
          {"origin", {origin.x(), origin.y(), origin.z()}},
          {"minimum_volume_voxels", arguments.method.options.least_samples}};
}

void summarise(const FractureSummary& summary, Session& session) {
  made(session, "pieces", summary.pieces);
  std::string line =
      "broke into " + std::to_string(summary.pieces) + " pieces, " + seconds_text(summary.seconds);
  if (const auto& labelled = summary.labelled) {
    const std::size_t changed = labelled->repair.changed_samples, merged = labelled->merged.size();
    made(session, "changed_samples", changed);
    made(session, "merged_slivers", merged);
    line += "; " + std::to_string(changed) + " samples changed their piece to keep it manifold";
    if (merged > 0) line += ", " + std::to_string(merged) + " slivers joined a neighbour";
  }
  print_summary(session, line);
}

void note_idle_cutters(const FractureSummary& summary, Session& session) {
  constexpr std::size_t kMostNotes = 100;
  std::vector<std::string> idle;
  for (const CutterRecord& record : summary.cutters)
    if (record.state != CutterRecord::State::cuts) idle.push_back(record.name + " " + in_words(record.state));
  for (const std::string& name : summary.empty) idle.push_back(name + ": nothing");
  for (std::size_t i = 0; i < std::min(idle.size(), kMostNotes); ++i) session.context.note(idle[i]);
  if (idle.size() > kMostNotes)
    session.context.note(std::to_string(idle.size() - kMostNotes) +
                         " more cutters cut nothing; pieces.json has the state of each");
}

/// Returns the reason why the pieces of the method `labelled`, which preserves volumes at any tolerance, may
/// have less volume than the uncut mesh.
std::string cause_of_loss(const FractureSummary& summary) {
  const std::string thin = "parts thinner than two voxels end in a sharp edge at cuts";
  if (!summary.labelled || summary.labelled->gaps + summary.labelled->touches == 0) return thin;
  const std::string apart = "pieces that the uncut mesh joins along an edge come apart there";
  return summary.labelled->cut_edges == 0 ? apart : apart + ", and " + thin;
}

/// Prints the validation of the pieces; returns true if they are consistent. Notes a loss of volume.
bool report_ledger(const validation::FractureReport& ledger, const FractureSummary& summary,
                   Session& session) {
  std::vector<std::string> lines = ledger.sentences();
  for (const std::string& location : ledger.places) lines.push_back("  " + location);
  lines.push_back("original surface: " + std::to_string(ledger.rest_triangles) + " triangles, volume " +
                  text(ledger.rest_volume) + "; the pieces' volumes differ from it by " +
                  text(ledger.volume_difference()) + " of it" +
                  (ledger.expected_difference
                       ? ", and from the uncut mesh's by " + text(*ledger.expected_difference) + " of that"
                       : ""));
  made(session, "sentences", lines);
  made(session, "books_balance", ledger.is_consistent());
  if (!session.json)
    for (const std::string& line : lines) std::cout << line << '\n';
  if (ledger.lost_a_piece()) {
    const double difference = 100.0 * *ledger.expected_difference;
    session.context.note("the pieces hold " + text(std::abs(difference)) + " % " +
                         (difference < 0 ? "less" : "more") +
                         " than the uncut mesh: " + cause_of_loss(summary) + "; smaller voxels keep them");
  }
  return ledger.is_consistent();
}

/// Refuses options that have no effect. @throws UsageError
void refuse_idle_options(const FractureArguments& arguments, const CutterSpec& spec,
                         const CLI::App& command) {
  using Kind = CutterSpec::Kind;
  if (is_volume(arguments.paths.in))
    refuse_idle(command,
                {"--voxelizer", "--voxelizer-option", "--signs", "--exterior-band", "--interior-band",
                 "--scale", "--units"},
                "'" + arguments.paths.in + "' already has voxels");
  else
    refuse_idle(command, {"--grid"}, "'" + arguments.paths.in + "' has polygons, no grids");
  if (arguments.method.name != "labelled")
    refuse_idle(command, {"--min-volume", "--no-split"}, "only --method labelled uses it");
  if (arguments.method.name != "thesis") refuse_idle(command, {"--rule"}, "only --method thesis uses it");
  if (spec.kind != Kind::chunks) refuse_idle(command, {"--roughness"}, "only the walls of chunks are rough");
  const bool copies =
      std::ranges::any_of(spec.files, [](const CutterSpec::File& file) { return file.copies > 0; });
  if (!copies) refuse_idle(command, {"--mesh-scale"}, "no meshes are scattered (mesh:FILE*N)");
  if (spec.count == 0 && !copies)
    refuse_idle(command, {"--seed", "--impact", "--impact-radius", "--density"},
                "these cutters are fixed, nothing is scattered");
  if (!arguments.density.empty())
    refuse_idle(command, {"--impact", "--impact-radius"}, "--density determines the scattered positions");
  if (arguments.impact.empty()) refuse_idle(command, {"--impact-radius"}, "there is no --impact");
}

int run_fracture_command(FractureArguments& arguments, const CLI::App& command, Session& session) {
  const CutterSpec spec = as_usage([&] { return parse_cutters(arguments.cutters); });
  as_usage([&] { check_method(arguments.method); });
  refuse_idle_options(arguments, spec, command);
  if (!arguments.impact.empty())
    arguments.choices.impact = Eigen::Vector3d(arguments.impact[0], arguments.impact[1], arguments.impact[2]);
  if (arguments.rule == "repaired") arguments.method.rule = ThesisFractureOptions::Rule::repaired;
  arguments.method.options.split = !arguments.no_split;
  arguments.method.options.placement.linear_crossings =
      arguments.hermite == "level-set" || is_volume(arguments.paths.in);
  arguments.method.options.least_samples = static_cast<std::uint64_t>(arguments.least_volume);
  { const AtomicFolder reserved(arguments.paths.out); }
  if (!arguments.density.empty())
    arguments.choices.density = read_level_set(arguments.density, "", session.context);

  std::optional<PolygonMesh> source;
  const FractureObject object = read_object(arguments, source, session);
  if (object.hermite.leaves.empty())
    throw Error("'" + arguments.paths.in +
                "' has no inside at this voxel size, so there is nothing to break");
  const MadeCutters cutters = make_cutters(spec, object.hermite, arguments.choices, session.context);
  FractureFolder folder(arguments.paths.out);
  const FractureSummary summary = run_fracture(
      object, cutters, arguments.method,
      [&](PieceOutput&& piece) { folder.add(std::move(piece), session.context); }, session.context);
  session.context.check();
  if (summary.pieces == 0) throw Error("no piece has a surface, nothing was written");
  summarise(summary, session);
  note_idle_cutters(summary, session);
  bool consistent = true;
  if (arguments.judge) {
    const PolygonMesh uncut = uncut_mesh(object, session.context);
    const double reach = reach_of_pieces(object, arguments.method, summary);
    consistent = report_ledger(folder.judge(session.context, uncut, reach), summary, session);
  }
  FractureFolder::Draw draw;
  if (!arguments.no_picture)
    draw = [&](const std::filesystem::path& pieces) { draw_picture(pieces, session); };
  folder.commit(head_of(arguments, object), summary, draw, session.context);
  work_is_finished();
  return consistent ? kDone : kNotMet;
}

void add_cutter_options(CLI::App& command, FractureArguments& arguments) {
  command
      .add_option(
          "--cutters", arguments.cutters,
          "voronoi:N, chunks:N (Voronoi cells with rough walls), planes:N, planes:NX,NY,NZ,D;... "
          "(N.x = D), mesh:FILE,... (one after another, in place) or mesh:FILE*N (N copies, scattered "
          "and rotated)")
      ->required();
  command.add_option("--seed", arguments.choices.seed, "Random seed (default: 0)");
  command
      .add_option("--roughness", arguments.choices.roughness,
                  "Displacement of the walls of chunks, relative to the distance of seeds (default: 0.12)")
      ->check(finite_number() & CLI::Range(0.0, 1.0));
  command.add_option("--impact", arguments.impact, "X Y Z: scatter densest about this point (world units)")
      ->expected(3)
      ->check(finite_number());
  command
      .add_option("--impact-radius", arguments.choices.impact_radius,
                  "Distance from the impact at which the density has halved (world units; default: a quarter "
                  "of the object)")
      ->check(finite_number() & CLI::PositiveNumber);
  command.add_option("--density", arguments.density, "A .vdb: scatter in proportion to its values");
  command
      .add_option("--mesh-scale", arguments.choices.mesh_scale,
                  "Scale factor of the scattered cutters (default: 1)")
      ->check(finite_number() & CLI::PositiveNumber);
}

}  // namespace

void add_fracture(CLI::App& app, Session& session) {
  const auto arguments = std::make_shared<FractureArguments>();
  CLI::App* command =
      add_command(app, session, "fracture", "Break a solid into pieces that fit without a gap");
  add_paths(*command, session, arguments->paths, std::string(kMeshIn) + ", or a level set: .vdb",
            FileKind::mesh_or_volume,
            "Directory for one PLY per piece, pieces.json and exploded.png; must not exist, or be empty",
            FileKind::folder);
  add_json_option(*command, session);
  command->add_option("--grid,--grid-name", arguments->grid,
                      "Name of the grid of a .vdb (default: sdf, or the only scalar grid)");
  add_voxelize_options(*command, arguments->voxelizing)->require_option(0, 1);
  add_cutter_options(*command, *arguments);
  command->add_option("--method", arguments->method.name, "labelled, thesis or openvdb (default: labelled)")
      ->check(CLI::IsMember({"labelled", "thesis", "openvdb"}));
  command
      ->add_option("--tolerance", arguments->method.tolerance,
                   "labelled: maximum distance of the pieces from their finest meshes, in voxels, less where "
                   "more than 1 % of a part's volume would change; thesis: square root of the QEF threshold, "
                   "in voxels; openvdb: its adaptivity (default: 0, nothing is merged)")
      ->check(finite_number());
  command
      ->add_option("--rule", arguments->rule,
                   "thesis: printed combines 10-byte voxels by eq. 7.1; repaired combines exact data by "
                   "signs (default: printed)")
      ->check(CLI::IsMember({"printed", "repaired"}));
  command
      ->add_option("--min-volume", arguments->least_volume,
                   "Smallest piece, in voxels; smaller ones join the neighbour with the largest common "
                   "boundary; 0 keeps all (default: 27)")
      ->check(CLI::Range(0.0, 1e15));
  command->add_flag("--no-split", arguments->no_split, "Keep the disconnected parts of a piece as one piece");
  command->add_flag("--no-picture", arguments->no_picture, "Do not draw exploded.png");
  command->add_flag("--judge", arguments->judge,
                    "Read the files back and validate volumes and seams; exit code 3 on failure");
  command
      ->add_option("--hermite", arguments->hermite,
                   "Data of the object: auto, exact from polygons, or level-set")
      ->check(CLI::IsMember({"auto", "exact", "level-set"}));
  set_work(*command, session,
           [arguments, command, &session] { return run_fracture_command(*arguments, *command, session); });
}

}  // namespace hermesh::cli
