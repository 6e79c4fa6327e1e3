// hermesh extract, remesh: level set to mesh, and polygons to level set and back to a mesh in one.
#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>

#include "algorithms/extraction/explain.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/io/written_precision.h"
#include "algorithms/extraction/volume_attributes.h"
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
    if (std::ranges::find(names, name) != names.end()) throw UsageError("--attributes names " + name + " twice");
    names.push_back(name);
  }
  return names;
}

/// The volume's mesh by the chosen extractor; messages name `paths.in`.
PolygonMesh extract(const Paths& paths, const LevelSet& level_set, const PolygonMesh* source,
                    const ChosenExtractor& chosen, const ExtractArguments& arguments, Session& session) {
  const std::optional<AdaptivityField> field = read_adaptivity(arguments.adaptivity, chosen.extractor, session);
  const std::string& input = paths.in;
  check_written_precision(paths.out, level_set);
  const Stopwatch watch;
  const Ends treatment = arguments.ends == "open" ? Ends::open : Ends::closed;
  EndedMesh ended = about_file(input, [&] {
    return hermesh::extract(level_set, source,
                            {.chosen = chosen,
                             .isovalue = arguments.isovalue,
                             .ends = treatment,
                             .field = field ? &*field : nullptr,
                             .written_in_single = is_written_in_single(paths.out)},
                            session.context);
  });
  PolygonMesh mesh = std::move(ended.mesh);
  session.context.check();
  // No reader takes a mesh file without polygons, ours included.
  if (mesh.empty() && field && field->outside == AdaptivityField::Outside::nothing)
    throw Error("'" + input + "': there is no surface inside the mask, nothing was written");
  if (mesh.empty())
    throw Error("'" + input + "': " +
                no_surface(level_set, arguments.isovalue, source != nullptr, chosen.extractor.name));
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
  PolygonMesh mesh = extract(paths, level_set, source ? &*source : nullptr, chosen, arguments, session);
  if (!attributes.empty()) {
    std::string line = "attributes";
    for (const std::string& name : sample_attributes(mesh, paths.in, attributes, session.context))
      line += " " + name;
    print_summary(session, line);
  }
  save(paths.out, mesh, session);
  return kDone;
}

int run_remesh(const Paths& paths, const VoxelizeArguments& voxelizing, const ExtractArguments& extracting,
               Session& session) {
  const ChosenVoxelizer voxelizer = choose_voxelizer(voxelizing);
  const ChosenExtractor chosen = choose_extractor(extracting.variant);
  check_mesh_output(paths.out);
  const PolygonMesh mesh = read_polygons(paths.in, session);
  const LevelSet level_set = voxelize(mesh, paths.in, voxelizing, voxelizer, session);
  const PolygonMesh made = extract(paths, level_set, &mesh, chosen, extracting, session);
  note_components(mesh, made, session);
  save(paths.out, made, session);
  return kDone;
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
  add_paths(*command, session, arguments->paths, "Volume: .vdb, or - for the standard input", FileKind::volume, kMeshOut,
            FileKind::mesh, true);
  add_json_option(*command, session);
  add_extract_options(*command, arguments->extracting, "dual-contouring");
  command->add_option("--grid,--grid-name", arguments->extracting.grid,
                      "Name of the grid (default: sdf, or the only scalar grid there is)");
  command->add_option("--source", arguments->extracting.source,
                      "Mesh that the volume was made from, for extractors that want exact Hermite data");
  command
      ->add_option("--ends", arguments->extracting.ends,
                   "Where the surface runs into the end of the data: closed (the default), a flat cap half a voxel beyond "
                   "the last samples, or open, cut off at these")
      ->check(CLI::IsMember({"closed", "open"}));
  command->add_option("--attributes", arguments->extracting.attributes,
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
