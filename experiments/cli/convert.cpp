// hermesh extract, remesh: level set to mesh, and polygons to level set and back to a mesh in one.
#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>

#include "algorithms/core/value_range.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/io/written_precision.h"
#include "algorithms/extraction/volume_attributes.h"
#include "experiments/cli/adaptivity.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/extracting.h"
#include "experiments/cli/format.h"
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

/// Refuses polygons that the extractor would not look at: they would leave the user in the belief that it did.
void check_source_has_effect(const ExtractArguments& arguments, const ChosenExtractor& chosen) {
  const Options& options = chosen.options;
  if (options.is("hermite", "exact") || options.is("crossings", "exact")) return;
  const bool automatic = options.is("hermite", "auto");
  if (automatic && arguments.isovalue == 0.0) return;
  throw UsageError("--source has no effect: " +
                   (automatic ? "the polygons lie at the isovalue 0"
                              : chosen.extractor.name + " with these options takes nothing from polygons"));
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

/// Says where a surface runs into the end of the data.
void note_ends(const DataEnds& ends, Ends treatment, Session& session) {
  if (!ends.any()) return;
  if (!ends.in_a_box)
    return session.context.note("the level set breaks off beside its surface (it was clipped by a mask, or has wrong "
                                "signs) and was closed there");
  session.context.note("the surface runs into the end of the data (" + ends.text() + ") and was " +
                       (treatment == Ends::open ? "cut off at its last samples"
                                                : "closed half a voxel beyond its last samples; see --ends"));
}

/// A sentence that says why a mesh is empty. `source` is the polygons that the volume was made
/// from in the same run, if it was.
std::string no_surface(const LevelSet& level_set, const PolygonMesh* source, const ChosenExtractor& chosen,
                       const ExtractArguments& arguments) {
  const auto [lowest, highest] = value_range(level_set);
  const double isovalue = arguments.isovalue;
  const std::string values = "its values go from " + exact_text(lowest) + " to " + exact_text(highest) + ", and " +
                             exact_text(level_set.background()) + " beyond";
  const std::string nothing = "there is no surface at the isovalue " + text(isovalue) + ", nothing was written: ";
  if (double(lowest) < isovalue && isovalue < std::max(double(highest), level_set.background()))
    return nothing + chosen.extractor.name + " found none, although the volume has samples on both sides (" + values +
           "); try another --extractor or smaller voxels";
  if (source && isovalue == 0.0 && lowest >= 0.0f)
    return nothing + "no voxel is inside, for the polygons enclose nothing, cancel one another, or are thinner than a voxel; " +
           "give a sheet a thickness with --signs unsigned and an --isovalue above 0";
  return nothing + "the volume has no sample inside, or none outside; " + values;
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
  if (mesh.empty()) throw Error("'" + input + "': " + no_surface(level_set, source, chosen, arguments));
  note_ends(ended.ends, treatment, session);
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
    check_source_has_effect(arguments, chosen);
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
  save(paths.out, extract(paths, level_set, &mesh, chosen, extracting, session), session);
  return kDone;
}

}  // namespace

void add_conversions(CLI::App& app, Session& session) {
  struct Arguments {
    Paths paths;
    VoxelizeArguments voxelizing;
    ExtractArguments extracting;
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
  add_voxelize_options(*command, arguments->voxelizing);
  add_extract_options(*command, arguments->extracting, "manifold-dual-contouring");
  command->callback([arguments, &session] {
    session.command = [arguments, &session] {
      return run_remesh(arguments->paths, arguments->voxelizing, arguments->extracting, session);
    };
  });
}

}  // namespace hermesh::cli
