// hermesh extract, remesh: level set to mesh, and polygons to level set and back to a mesh in one.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>

#include "algorithms/core/mesh_file.h"
#include "algorithms/core/value_range.h"
#include "algorithms/core/vdb_file.h"
#include "algorithms/extraction/volume_attributes.h"
#include "algorithms/extraction/volume_ends.h"
#include "experiments/cli/adaptivity.h"
#include "experiments/cli/format.h"
#include "experiments/cli/output_path.h"
#include "experiments/cli/session.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/validators.h"
#include "experiments/cli/voxelizing.h"
#include "experiments/harness.h"

namespace hermesh::cli {
namespace {

struct ExtractArguments {
  std::string extractor;  ///< set by add_extract_options()
  double isovalue = 0.0;
  std::string grid;                  ///< empty: `sdf`, or the only scalar grid there is
  std::string source;                ///< empty: the polygons are not at hand
  std::vector<std::string> options;  ///< key=value
  std::string ends = "closed";
  std::string attributes;  ///< names of grids to sample, or "all"; empty: none
  AdaptivityArguments adaptivity;
};

/// A variant that was looked up, with its options checked.
struct ChosenExtractor {
  Extractor extractor;
  Options options;
};

void add_extract_options(CLI::App& command, ExtractArguments& arguments, const std::string& fallback) {
  arguments.extractor = fallback;
  command.add_option("--extractor", arguments.extractor,
                     "Name of the extractor, see hermesh list (default: " + arguments.extractor + ")");
  command
      .add_option("--isovalue", arguments.isovalue,
                  "Value of the surface, in the units of the grid (default: 0)")
      ->check(finite_number());
  command.add_option("-o", arguments.options, "key=value, an option of the extractor; may be repeated")
      ->allow_extra_args(false)
      ->check(key_value());
  add_adaptivity_options(command, arguments.adaptivity);
}

ChosenExtractor choose_extractor(const ExtractArguments& arguments) {
  return as_usage([&] {
    const Extractor extractor = find_variant(all_extractors(), arguments.extractor);
    return ChosenExtractor{extractor, parse_options(extractor.name, extractor.options, arguments.options)};
  });
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

/// `input`: the file that it is about.
PolygonMesh extract(const std::string& input, const LevelSet& level_set, const PolygonMesh* source,
                    const ChosenExtractor& chosen, const ExtractArguments& arguments, Session& session) {
  const std::optional<AdaptivityField> field = read_adaptivity(arguments.adaptivity, chosen.extractor, session);
  const Stopwatch watch;
  const Ends treatment = arguments.ends == "open" ? Ends::open : Ends::closed;
  EndedMesh ended = about_file(input, [&] {
    return extract_with_ends(
        chosen.extractor, {level_set, arguments.isovalue, source, chosen.options, session.context, field ? &*field : nullptr},
        treatment);
  });
  PolygonMesh mesh = std::move(ended.mesh);
  session.context.check();
  // No reader takes a mesh file without polygons, ours included.
  if (mesh.empty() && field && field->outside == AdaptivityField::Outside::nothing)
    throw Error("'" + input + "': there is no surface inside the mask, nothing was written");
  if (mesh.empty()) {
    const auto [lowest, highest] = value_range(level_set);
    throw Error("'" + input + "': there is no surface at the isovalue " + text(arguments.isovalue) +
                ", nothing was written: the volume has no sample inside, or none outside; its values go from " +
                exact_text(lowest) + " to " + exact_text(highest) + ", and " + exact_text(level_set.background()) +
                " beyond");
  }
  note_ends(ended.ends, treatment, session);
  print_summary(session, "extracted " + std::to_string(mesh.points.size()) + " points, " +
                             std::to_string(mesh.triangles.size()) + " triangles, " +
                             std::to_string(mesh.quads.size()) + " quads, " + chosen.extractor.name + ", " +
                             seconds_text(watch.seconds()));
  return mesh;
}

void save(const std::string& path, const PolygonMesh& mesh, Session& session) {
  write_mesh(path, mesh, session.context);
  work_is_finished();
}

int run_extract(const Paths& paths, const ExtractArguments& arguments, Session& session) {
  const ChosenExtractor chosen = choose_extractor(arguments);
  const std::vector<std::string> attributes = attribute_names(arguments.attributes);
  check_mesh_output(paths.out);
  if (!attributes.empty()) check_keeps_attributes(paths.out);
  std::optional<PolygonMesh> source;
  if (!arguments.source.empty()) source = read_polygons(arguments.source, session);
  const LevelSet level_set = read_level_set(paths.in, arguments.grid, session.context);
  PolygonMesh mesh = extract(paths.in, level_set, source ? &*source : nullptr, chosen, arguments, session);
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
  const ChosenExtractor chosen = choose_extractor(extracting);
  check_mesh_output(paths.out);
  const PolygonMesh mesh = read_polygons(paths.in, session);
  const LevelSet level_set = voxelize(mesh, paths.in, voxelizing, voxelizer, session);
  save(paths.out, extract(paths.in, level_set, &mesh, chosen, extracting, session), session);
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
  add_paths(*command, arguments->paths, "Volume: .vdb", kMeshOut);
  add_extract_options(*command, arguments->extracting, "dual-contouring");
  command->add_option("--grid", arguments->extracting.grid,
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
  add_paths(*command, arguments->paths, kMeshIn, kMeshOut);
  add_voxelize_options(*command, arguments->voxelizing);
  add_extract_options(*command, arguments->extracting, "manifold-dual-contouring");
  command->callback([arguments, &session] {
    session.command = [arguments, &session] {
      return run_remesh(arguments->paths, arguments->voxelizing, arguments->extracting, session);
    };
  });
}

}  // namespace hermesh::cli
