// hermesh combine: the union, intersection or difference of two solids, as Hermite data and back to a mesh.
#include "algorithms/hermite/combine.h"

#include <CLI/CLI.hpp>
#include <memory>

#include "algorithms/core/mesh_file.h"
#include "algorithms/extraction/dual_contouring/dual_contouring.h"
#include "algorithms/hermite/hermite_file.h"
#include "algorithms/hermite/samplers.h"
#include "experiments/cli/format.h"
#include "experiments/cli/output_path.h"
#include "experiments/cli/session.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/validators.h"
#include "experiments/cli/voxelizing.h"

namespace hermesh::cli {
namespace {

struct Arguments {
  std::string operation;
  std::string first, second, out;
  VoxelizeArguments voxelizing;
  std::vector<std::string> options;  ///< key=value, of dual contouring
};

Boolean boolean_of(const std::string& operation) {
  if (operation == "union") return Boolean::unite;
  return operation == "intersection" ? Boolean::intersect : Boolean::subtract;
}

/// The same points about another origin, so that both meshes are voxelized on one lattice.
PolygonMesh about(PolygonMesh mesh, const Eigen::Vector3d& origin) {
  const Eigen::Vector3d shift = mesh.origin - origin;
  for (auto& point : mesh.points) point = (point.cast<double>() + shift).cast<float>();
  mesh.origin = origin;
  return mesh;
}

FloatHermite sampled(const PolygonMesh& mesh, const std::string& file, const Arguments& arguments,
                     const ChosenVoxelizer& chosen, Session& session) {
  return sample_polygons(voxelize(mesh, file, arguments.voxelizing, chosen, session), 0.0, mesh, session.context);
}

int run_combine(const Arguments& given, Session& session) {
  Arguments arguments = given;
  const ChosenVoxelizer chosen = choose_voxelizer(arguments.voxelizing);
  const DualContouringOptions placement = as_usage([&] {
    return read_dual_contouring_options(
        parse_options("dual-contouring", dual_contouring_options(), arguments.options));
  });
  check_mesh_output(arguments.out);
  const PolygonMesh first = read_polygons(arguments.first, session);
  const PolygonMesh second = about(read_polygons(arguments.second, session), first.origin);
  // A resolution is the first mesh's; the second takes the size of voxel that comes of it.
  arguments.voxelizing.voxel_size =
      voxelization_input(first, arguments.first, arguments.voxelizing, chosen, session).voxel_size;

  const FloatHermite a = sampled(first, arguments.first, arguments, chosen, session);
  const FloatHermite b = sampled(second, arguments.second, arguments, chosen, session);
  const Stopwatch watch;
  const FloatHermite result = combine(boolean_of(arguments.operation), a, b, session.context);
  session.context.check();
  if (result.leaves.empty())
    throw Error("the " + arguments.operation + " of " + arguments.first + " and " + arguments.second +
                " is empty, nothing was written");
  const PolygonMesh mesh = dual_contouring(view_of(result, session.context), placement, session.context);
  print_summary(session, "combined to " + std::to_string(result.crossings.size()) + " edge crossings and " +
                             std::to_string(mesh.triangle_count()) + " triangles, " + seconds_text(watch.seconds()));
  write_mesh(arguments.out, mesh, session.context);
  work_is_finished();
  return kDone;
}

}  // namespace

void add_combine(CLI::App& app, Session& session) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_command(app, session, "combine", "Union, intersection or difference of two solids");
  command->add_option("OPERATION", arguments->operation, "union, intersection or difference (the first without the second)")
      ->required()
      ->check(CLI::IsMember({"union", "intersection", "difference"}));
  command->add_option("A", arguments->first, kMeshIn)->required();
  command->add_option("B", arguments->second, kMeshIn)->required();
  command->add_option("OUT", arguments->out, kMeshOut)->required();
  add_voxelize_options(*command, arguments->voxelizing);
  command
      ->add_option("-o", arguments->options,
                   "key=value, an option of the extractor dual-contouring; may be repeated")
      ->allow_extra_args(false)
      ->check(key_value());
  command->callback([arguments, &session] {
    session.command = [arguments, &session] { return run_combine(*arguments, session); };
  });
}

}  // namespace hermesh::cli
