// hermesh extract, remesh: level set to mesh, and polygons to level set and back to a mesh in one.
#include <algorithm>
#include <charconv>
#include <memory>
#include <optional>
#include <sstream>

#include "algorithms/extraction/explain.h"
#include "algorithms/extraction/volume_attributes.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/io/written_precision.h"
#include "experiments/cli/adaptivity.h"
#include "experiments/cli/bounded.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/extracting.h"
#include "experiments/cli/output_path.h"
#include "experiments/cli/session.h"
#include "experiments/cli/validators.h"
#include "experiments/cli/voxelizing.h"

namespace hermesh::cli {
namespace {

struct ExtractArguments {
  ExtractorArguments variant;
  double isovalue = 0.0;
  std::string grid;    ///< empty: `sdf`, or the only scalar grid there is
  std::string source;  ///< empty: the polygons are not at hand
  std::string ends = "closed";
  std::string attributes;  ///< names of grids to sample, or "all"; empty: none
  AdaptivityArguments adaptivity;
  std::string max_loss;  ///< a share with %; empty: not given
};

void add_extract_options(CLI::App& command, ExtractArguments& arguments, const std::string& fallback) {
  add_extractor_options(command, arguments.variant, fallback);
  command
      .add_option("--isovalue", arguments.isovalue,
                  "Value of the surface, in the units of the grid (default: 0)")
      ->check(finite_number());
  add_adaptivity_options(command, arguments.adaptivity);
}

std::vector<std::string> attribute_names(const std::string& list) {
  std::vector<std::string> names;
  std::istringstream stream(list);
  for (std::string name; std::getline(stream, name, ',');) {
    if (std::ranges::find(names, name) != names.end())
      throw UsageError("--attributes names " + name + " twice");
    names.push_back(name);
  }
  return names;
}

/// The volume's mesh by the chosen extractor; messages name `paths.in`.
PolygonMesh extract(const Paths& paths, const LevelSet& level_set, const PolygonMesh* source,
                    const FloatHermite* hermite, const ChosenExtractor& chosen,
                    const ExtractArguments& arguments, Session& session) {
  const std::optional<AdaptivityField> field =
      read_adaptivity(arguments.adaptivity, chosen.extractor, session);
  const std::string& input = paths.in;
  check_written_precision(paths.out, level_set);
  const Stopwatch watch;
  // A thickened solid has Hermite data of its own, and no ends.
  const bool thickened = hermite && !source;
  const Ends treatment = arguments.ends == "open" ? Ends::open : Ends::closed;
  EndedMesh ended = about_file(input, [&] {
    return hermesh::extract(level_set, source,
                            {.chosen = chosen,
                             .isovalue = arguments.isovalue,
                             .ends = thickened ? std::nullopt : std::optional(treatment),
                             .field = field ? &*field : nullptr,
                             .hermite = hermite,
                             .written_in_single = is_written_in_single(paths.out)},
                            session.context);
  });
  PolygonMesh mesh = std::move(ended.mesh);
  session.context.check();
  // No reader takes a mesh file without polygons, ours included.
  if (mesh.empty() && field && field->outside == AdaptivityField::Outside::nothing)
    throw Error("'" + input + "': there is no surface inside the mask, nothing was written");
  if (mesh.empty())
    throw Error("'" + input +
                "': " + no_surface(level_set, arguments.isovalue, source || hermite, chosen.extractor.name));
  if (const std::string note = ends_note(ended.ends, treatment); !note.empty()) session.context.note(note);
  print_extracted(session, mesh, chosen.extractor.name, watch.seconds());
  return mesh;
}

int run_extract(const Paths& paths, const ExtractArguments& arguments, Session& session) {
  const ChosenExtractor chosen = choose_extractor(arguments.variant);
  const std::vector<std::string> attributes = attribute_names(arguments.attributes);
  check_mesh_output(paths.out);
  if (!attributes.empty()) check_keeps_attributes(paths.out);
  std::optional<PolygonMesh> source;
  if (!arguments.source.empty()) {
    as_usage([&] { check_source_has_effect(chosen.extractor, chosen.options, arguments.isovalue); });
    source = read_polygons(arguments.source, session);
  }
  const LevelSet level_set = read_level_set(paths.in, arguments.grid, session.context);
  PolygonMesh mesh =
      extract(paths, level_set, source ? &*source : nullptr, nullptr, chosen, arguments, session);
  if (!attributes.empty()) {
    std::string line = "attributes";
    for (const std::string& name : sample_attributes(mesh, paths.in, attributes, session.context))
      line += " " + name;
    print_summary(session, line);
  }
  save(paths.out, mesh, session);
  return kDone;
}

/// The mesh of what the samples show of the polygons.
PolygonMesh remesh_shown(const Paths& paths, const PolygonMesh& mesh, const VoxelizeArguments& voxelizing,
                         const ChosenVoxelizer& voxelizer, const ExtractArguments& extracting,
                         const ChosenExtractor& chosen, Session& session) {
  const LevelSet level_set = voxelize(mesh, paths.in, voxelizing, voxelizer, session);
  return extract(paths, level_set, &mesh, nullptr, chosen, extracting, session);
}

/// The mesh of all of the polygons, of which thin parts are thickened.
PolygonMesh remesh_all(const Paths& paths, const PolygonMesh& mesh, const VoxelizeArguments& voxelizing,
                       const ChosenVoxelizer& voxelizer, const ExtractArguments& extracting,
                       const ChosenExtractor& chosen, Session& session) {
  const PolygonSolid made = sample_polygons(mesh, paths.in, voxelizing, voxelizer, session);
  if (made.thin && chosen.options.is("crossings", "exact"))
    throw UsageError(
        "-o crossings=exact takes crossings from the polygons, which thickened parts are not on; use "
        "--thin drop");
  const Options& options = chosen.options;
  if (!made.thin &&
      (options.is("hermite", "auto") || options.is("hermite", "exact") || options.is("crossings", "exact")))
    if (const std::string note = missed_edges_note(made.solid.sampling); !note.empty())
      session.context.note(note);
  return extract(paths, made.solid.level_set, made.thin ? nullptr : &mesh, &made.solid.hermite, chosen,
                 extracting, session);
}

/// The share of the visible surface that may be lost. @throws UsageError
double most_loss(const std::string& text, ThinRule rule) {
  // What is dropped by choice is not to go unnoticed.
  if (text.empty()) return rule == ThinRule::drop ? 0.01 : 1.0;
  double percent = 0.0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), percent);
  if (failure != std::errc() || std::string(end, text.data() + text.size()) != "%" ||
      !(percent >= 0.0 && percent <= 100.0))
    throw UsageError("--max-loss must be a percentage such as 1%, not '" + text + "'");
  return percent / 100.0;
}

int run_remesh(const Paths& paths, const VoxelizeArguments& voxelizing, const ExtractArguments& extracting,
               Session& session) {
  const ChosenVoxelizer voxelizer = choose_voxelizer(voxelizing);
  const ChosenExtractor chosen = choose_extractor(extracting.variant);
  check_mesh_output(paths.out);
  const ThinRule rule = thin_rule(voxelizing, voxelizer, extracting.isovalue);
  // A limit holds for the loss that the user chose.
  const double max_loss = most_loss(extracting.max_loss, voxelizing.thin ? rule : ThinRule::keep);
  const PolygonMesh mesh = read_polygons(paths.in, session);
  const PolygonMesh made = rule == ThinRule::drop
                               ? remesh_shown(paths, mesh, voxelizing, voxelizer, extracting, chosen, session)
                               : remesh_all(paths, mesh, voxelizing, voxelizer, extracting, chosen, session);
  note_components(mesh, made, session);
  // Other isovalues, and parts that a mask leaves out, are not meant to show the polygons.
  const bool is_of_polygons = extracting.isovalue == 0.0 && extracting.adaptivity.mask.empty() &&
                              extracting.adaptivity.frustum.empty() &&
                              !voxelizer.options.is("signs", "unsigned");
  const bool shows =
      !is_of_polygons ||
      check_visible_loss(mesh, made, *recipe_of(mesh, paths.in, voxelizing, voxelizer).voxel_size, max_loss,
                         session);
  save(paths.out, made, session);
  return shows ? kDone : kNotMet;
}

}  // namespace

void add_conversions(CLI::App& app, Session& session) {
  struct Arguments {
    Paths paths;
    VoxelizeArguments voxelizing;
    ExtractArguments extracting;
    BoundArguments bound;
  };
  auto arguments = std::make_shared<Arguments>();

  CLI::App* command = add_command(app, session, "extract", "A volume to a mesh");
  add_paths(*command, session, arguments->paths, "Volume: .vdb, or - for the standard input",
            FileKind::volume, kMeshOut, FileKind::mesh, true);
  add_json_option(*command, session);
  add_extract_options(*command, arguments->extracting, "dual-contouring");
  command->add_option("--grid,--grid-name", arguments->extracting.grid,
                      "Name of the grid (default: sdf, or the only scalar grid there is)");
  command->add_option("--source", arguments->extracting.source,
                      "Mesh that the volume was made from, for extractors that want exact Hermite data");
  command
      ->add_option("--ends", arguments->extracting.ends,
                   "Where the surface runs into the end of the data: closed (the default), a flat cap half a "
                   "voxel beyond "
                   "the last samples, or open, cut off at these")
      ->check(CLI::IsMember({"closed", "open"}));
  command->add_option(
      "--attributes", arguments->extracting.attributes,
      "Grids of the volume, separated by commas, or all: sampled at the mesh's points, for .ply");
  command->callback([arguments, &session] {
    session.command = [arguments, &session] {
      return run_extract(arguments->paths, arguments->extracting, session);
    };
  });

  arguments = std::make_shared<Arguments>();
  command = add_command(app, session, "remesh", "Polygons to a level set and back to a mesh");
  add_paths(*command, session, arguments->paths, kMeshIn, FileKind::mesh, kMeshOut, FileKind::mesh, true);
  add_json_option(*command, session);
  CLI::App* size = add_voxelize_options(*command, arguments->voxelizing);
  add_extract_options(*command, arguments->extracting, "manifold-dual-contouring");
  command->add_option(
      "--max-loss", arguments->extracting.max_loss,
      "Exit with 3 if more of the visible surface than this is lost, such as 1% (default: no limit, or 1% "
      "with --thin drop)");
  add_bound_options(*command, *size, arguments->bound);
  command->callback([arguments, command, &session] {
    session.command = [arguments, command, &session] {
      if (arguments->bound.asked()) {
        check_bound_options(*command, arguments->bound, arguments->voxelizing, session.units);
        return run_bounded(arguments->paths, arguments->bound, arguments->voxelizing, session);
      }
      refuse_without_bound(*command);
      return run_remesh(arguments->paths, arguments->voxelizing, arguments->extracting, session);
    };
  });
}

}  // namespace hermesh::cli
