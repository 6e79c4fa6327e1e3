// hermesh combine: the union, intersection or difference of two solids, as Hermite data and back to a mesh.
#include <iostream>
#include <memory>

#include "algorithms/core/run_context.h"
#include "algorithms/hermite/solids.h"
#include "algorithms/search/transfer_attributes.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/conversions.h"
#include "experiments/cli/signals.h"

namespace hermesh::cli {
namespace {

struct CombineArguments {
  std::string operation;
  std::string first, second, out;
  VoxelizeArguments voxelizing;
  ExtractorArguments extracting;
  std::string attributes;  ///< "none", or all
  bool judge = false;
};

Boolean boolean_of(const std::string& operation) {
  if (operation == "union") return Boolean::unite;
  return operation == "intersection" ? Boolean::intersect : Boolean::subtract;
}

std::string result_name(const CombineArguments& arguments) {
  return "the " + arguments.operation + " of '" + arguments.first + "' and '" + arguments.second + "'";
}

SampledSolid sampled(const PolygonMesh& mesh, const std::string& file, const SharedLattice& lattice,
                     const VoxelizeArguments& voxelizing, Session& session) {
  const auto sample = [&](const PolygonMesh& framed) {
    return make_solid(framed, file, voxelizing, session).solid;
  };
  SampledSolid solid = about_file(file, [&] { return sample_solid(mesh, lattice, sample); });
  if (const std::string note = missed_edges_note(solid.sampling); !note.empty())
    session.context.note("'" + file + "': " + note);
  return solid;
}

PolygonMesh contour(const CombinedSolid& solid, const CombineArguments& arguments, Session& session) {
  Stopwatch watch;
  const ChosenExtractor& chosen = arguments.extracting.chosen;
  PolygonMesh mesh =
      hermesh::extract(solid.level_set, nullptr,
                       {.chosen = chosen, .hermite = &solid.hermite, .out = arguments.out}, session.context)
          .mesh;
  session.context.check();
  if (mesh.empty()) throw Error(result_name(arguments) + " has no surface, nothing was written");
  print_extracted(session, mesh, chosen.extractor.name, watch.seconds());
  return mesh;
}

/// Reads the file back and prints its validation; returns true if the guarantees of the extractor hold.
bool guarantees_hold(const std::string& file, const Promises& promises, Session& session) {
  const auto& [report, check] =
      judge(read_mesh_file(file, session.context), promises, kPromisesAlone, session.context);
  std::vector<std::string> lines = report.sentences();
  lines.insert(lines.begin(), promise_verdict(promises, check));
  made(session, "promises_kept", check.broken.empty());
  for (const std::string& line : lines)
    if (session.json)
      session.context.note(line);
    else
      std::cout << line << '\n';
  return check.broken.empty();
}

int run_combine(CombineArguments& arguments, Session& session) {
  VoxelizeArguments& voxelizing = arguments.voxelizing;
  voxelizing.choose();
  if (voxelizing.chosen.options.is("signs", "unsigned"))
    throw UsageError("--signs unsigned leaves the solids without an inside to combine");
  arguments.extracting.choose();
  check_mesh_output(arguments.out);
  const ReadOptions reading{.attributes = arguments.attributes != "none"};
  const PolygonMesh first = read_polygons(arguments.first, session, reading);
  const PolygonMesh second = read_polygons(arguments.second, session, reading);
  // A resolution counts along the longer operand, so the order of the two does not matter.
  const bool second_is_longer = bounds(second).size().maxCoeff() > bounds(first).size().maxCoeff();
  voxelizing.voxel_size = second_is_longer ? voxelizing.recipe(second, arguments.second).voxel_size
                                           : voxelizing.recipe(first, arguments.first).voxel_size;
  voxelizing.any_size = true;  // the larger solid is not smaller than a voxel
  const SharedLattice lattice = shared_lattice(first, second, *voxelizing.voxel_size);

  const SampledSolid a = sampled(first, arguments.first, lattice, voxelizing, session);
  const SampledSolid b = sampled(second, arguments.second, lattice, voxelizing, session);
  const Boolean boolean = boolean_of(arguments.operation);
  Stopwatch watch;
  const CombinedSolid result = combine(boolean, a, b, session.context);
  const LostSlivers lost = lost_slivers(boolean, a.hermite, b.hermite);
  session.context.check();
  const std::string note = lost.edges > 0 ? lost_slivers_note(lost, boolean, lattice.voxel_size) : "";
  if (result.hermite.leaves.empty() && lost.edges > 0)
    throw Error(result_name(arguments) + " is thinner than a voxel everywhere, nothing was written: " + note);
  if (result.hermite.leaves.empty())
    throw Error(result_name(arguments) +
                " is empty, nothing was written: no sample and no edge of the lattice lies in it");
  if (lost.edges > 0) session.context.note(note);
  made(session, "crossings", result.hermite.crossings.size());
  print_summary(session, "combined to " + std::to_string(result.hermite.crossings.size()) +
                             " edge crossings, " + seconds_text(watch.seconds()));
  PolygonMesh mesh = contour(result, arguments, session);
  if (!first.attributes.empty() || !second.attributes.empty())
    carry_attributes(joined(first, second), mesh, session);
  write_output(arguments.out, mesh, session);
  const bool holds = !arguments.judge ||
                     guarantees_hold(arguments.out, arguments.extracting.chosen.extractor.promises, session);
  work_is_finished();
  return holds ? kDone : kNotMet;
}

}  // namespace

void add_combine(CLI::App& app, Session& session) {
  const auto arguments = std::make_shared<CombineArguments>();
  CLI::App* command =
      add_command(app, session, "combine", "Compute the union, intersection or difference of two solids");
  command
      ->add_option("OPERATION", arguments->operation,
                   "union, intersection or difference (the first without the second)")
      ->required()
      ->check(CLI::IsMember({"union", "intersection", "difference"}));
  command->add_option("A", arguments->first, kMeshIn)->required();
  command->add_option("B", arguments->second, kMeshIn)->required();
  command->add_option("OUT", arguments->out, kMeshOut)->required();
  add_files(*command, session,
            {.inputs = {&arguments->first, &arguments->second}, .output = &arguments->out});
  add_json_option(*command, session);
  add_voxelize_options(*command, arguments->voxelizing);
  command->get_option("--resolution")->description("Voxels along the longest side of the larger solid");
  add_extractor_options(*command, arguments->extracting, "manifold-dual-contouring");
  add_attributes_option(*command, arguments->attributes);
  command->add_flag(
      "--judge", arguments->judge,
      "Read the file back and validate the guarantees of the extractor; exit code 3 on failure");
  set_work(*command, session, [arguments, &session] { return run_combine(*arguments, session); });
}

}  // namespace hermesh::cli
