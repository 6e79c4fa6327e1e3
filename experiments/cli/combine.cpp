// hermesh combine: the union, intersection or difference of two solids, as Hermite data and back to a mesh.
#include <algorithm>
#include <iostream>
#include <memory>

#include "algorithms/hermite/lost_slivers.h"
#include "algorithms/hermite/solids.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/written_precision.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/extracting.h"
#include "experiments/cli/format.h"
#include "experiments/cli/output_path.h"
#include "experiments/cli/pipeline/json_report.h"
#include "experiments/cli/session.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/voxelizing.h"
#include "experiments/pipeline.h"

namespace hermesh::cli {
namespace {

struct CombineArguments {
  std::string operation;
  std::string first, second, out;
  VoxelizeArguments voxelizing;
  ExtractorArguments extracting;
  bool judge = false;
};

Boolean boolean_of(const std::string& operation) {
  if (operation == "union") return Boolean::unite;
  return operation == "intersection" ? Boolean::intersect : Boolean::subtract;
}

std::string result_name(const CombineArguments& arguments) {
  return "the " + arguments.operation + " of '" + arguments.first + "' and '" + arguments.second + "'";
}

/// Voxel size in world units. A resolution counts along the longer operand, so that the
/// order of the two does not matter.
double voxel_size(const PolygonMesh& first, const PolygonMesh& second, const CombineArguments& arguments,
                  const ChosenVoxelizer& chosen) {
  const bool second_is_longer = bounds(second).size().maxCoeff() > bounds(first).size().maxCoeff();
  const VoxelizeRecipe recipe =
      recipe_of(second_is_longer ? second : first, second_is_longer ? arguments.second : arguments.first,
                arguments.voxelizing, chosen);
  return *recipe.voxel_size;
}

SampledSolid sampled(const PolygonMesh& mesh, const std::string& file, const SharedLattice& lattice,
                     const CombineArguments& arguments, const ChosenVoxelizer& chosen, Session& session) {
  const auto sample = [&](const PolygonMesh& framed) {
    return sample_polygons(framed, file, arguments.voxelizing, chosen, session).solid;
  };
  SampledSolid solid = about_file(file, [&] { return sample_solid(mesh, lattice, sample); });
  if (const std::string note = missed_edges_note(solid.sampling); !note.empty())
    session.context.note("'" + file + "': " + note);
  return solid;
}

/// Refuses a result without a sample. @throws Error that tells a result that is empty from one that is too
/// thin.
void check_not_empty(const CombinedSolid& result, const LostSlivers& lost, const CombineArguments& arguments,
                     double voxel_size) {
  if (!result.hermite.leaves.empty()) return;
  if (lost.edges > 0)
    throw Error(result_name(arguments) + " is thinner than a voxel everywhere, nothing was written: " +
                lost_slivers_note(lost, boolean_of(arguments.operation), voxel_size));
  throw Error(result_name(arguments) +
              " is empty, nothing was written: no sample and no edge of the lattice lies in it");
}

PolygonMesh contour(const CombinedSolid& solid, const ChosenExtractor& chosen,
                    const CombineArguments& arguments, Session& session) {
  const Stopwatch watch;
  PolygonMesh mesh = extract(solid.level_set, nullptr,
                             {.chosen = chosen,
                              .hermite = &solid.hermite,
                              .written_in_single = is_written_in_single(arguments.out)},
                             session.context)
                         .mesh;
  session.context.check();
  if (mesh.empty()) throw Error(result_name(arguments) + " has no surface, nothing was written");
  print_extracted(session, mesh, chosen.extractor.name, watch.seconds());
  return mesh;
}

/// Reads the file back; returns whether it is what the extractor promises.
bool keeps_promises(const std::string& file, const Promises& promises, Session& session) {
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

int run_combine(const CombineArguments& given, Session& session) {
  CombineArguments arguments = given;
  const ChosenVoxelizer voxelizer = choose_voxelizer(arguments.voxelizing);
  if (voxelizer.options.is("signs", "unsigned"))
    throw UsageError("--signs unsigned leaves the solids without an inside that could be combined");
  const ChosenExtractor extractor = choose_extractor(arguments.extracting);
  check_mesh_output(arguments.out);
  const PolygonMesh first = read_polygons(arguments.first, session);
  const PolygonMesh second = read_polygons(arguments.second, session);
  arguments.voxelizing.voxel_size = voxel_size(first, second, arguments, voxelizer);
  arguments.voxelizing.any_size = true;  // the larger solid is not smaller than a voxel
  const SharedLattice lattice = shared_lattice(first, second, *arguments.voxelizing.voxel_size);

  const SampledSolid a = sampled(first, arguments.first, lattice, arguments, voxelizer, session);
  const SampledSolid b = sampled(second, arguments.second, lattice, arguments, voxelizer, session);
  const Boolean boolean = boolean_of(arguments.operation);
  const Stopwatch watch;
  const CombinedSolid result = combine(boolean, a, b, session.context);
  const LostSlivers lost = lost_slivers(boolean, a.hermite, b.hermite);
  session.context.check();
  check_not_empty(result, lost, arguments, lattice.voxel_size);
  if (lost.edges > 0) session.context.note(lost_slivers_note(lost, boolean, lattice.voxel_size));
  check_written_precision(arguments.out, result.level_set);
  made(session, "crossings", result.hermite.crossings.size());
  print_summary(session, "combined to " + std::to_string(result.hermite.crossings.size()) +
                             " edge crossings, " + seconds_text(watch.seconds()));
  write_output(arguments.out, contour(result, extractor, arguments, session), session);
  const bool kept = !arguments.judge || keeps_promises(arguments.out, extractor.extractor.promises, session);
  work_is_finished();
  return kept ? kDone : kNotMet;
}

}  // namespace

void add_combine(CLI::App& app, Session& session) {
  const auto arguments = std::make_shared<CombineArguments>();
  CLI::App* command = add_command(app, session, "combine", "Union, intersection or difference of two solids");
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
  command->add_flag(
      "--judge", arguments->judge,
      "Read the file back and judge whether it is what the extractor promises; if not, the exit code is 3");
  command->callback([arguments, &session] {
    session.command = [arguments, &session] { return run_combine(*arguments, session); };
  });
}

}  // namespace hermesh::cli
