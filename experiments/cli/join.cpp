// hermesh join: the parts of remesh --tile to a mesh.
#include <memory>

#include "algorithms/io/mesh_file.h"
#include "algorithms/io/written_precision.h"
#include "algorithms/remesh/tiled_remesh.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/conversions.h"
#include "experiments/cli/signals.h"

namespace hermesh::cli {
namespace {

struct JoinArguments {
  std::vector<std::string> parts;
  std::string out;
};

int run_join(const JoinArguments& arguments, Session& session) {
  check_mesh_output(arguments.out);
  Stopwatch watch;
  std::vector<TilePart> parts;
  for (const std::string& part : arguments.parts) {
    parts.push_back(read_tile_part(part));
    session.context.check();
  }
  if (is_written_in_single(arguments.out) && !parts[0].written_in_single)
    throw UsageError("'" + arguments.out +
                     "' would round the vertices of the parts to single precision, for which the mesh is not "
                     "proved; write .ply, .obj, .off, .glb or .3mf");
  const double metres = parts[0].metres;
  const PolygonMesh mesh = join_parts(std::move(parts));
  made(session, "parts", arguments.parts.size());
  print_extracted(session, mesh, std::to_string(arguments.parts.size()) + " parts", watch.seconds());
  write_mesh(arguments.out, mesh, session.context, metres);
  work_is_finished();
  return kDone;
}

}  // namespace

void add_join(CLI::App& app, Session& session) {
  const auto arguments = std::make_shared<JoinArguments>();
  CLI::App* command = add_command(app, session, "join", "Join the parts of remesh --tile to a mesh");
  CLI::Option* files =
      command
          ->add_option("PART", arguments->parts,
                       "The parts of all jobs, in any order, and the mesh to write: .ply .obj "
                       ".off .glb .gltf .3mf, also with .gz")
          ->required()
          ->expected(1, 1'000'000);
  add_files(*command, session,
            {.inputs = {}, .output = &arguments->out, .in = FileKind::imported, .out = FileKind::mesh});
  add_json_option(*command, session);
  // The last one is the output, because CLI11 can separate it only if all options precede the files.
  command->parse_complete_callback([arguments, files] {
    if (arguments->parts.size() < 2) throw UsageError("join needs a part and the mesh to write");
    arguments->out = arguments->parts.back();
    arguments->parts.pop_back();
    files->clear();
    for (const std::string& part : arguments->parts) files->add_result(part);
  });
  set_work(*command, session, [arguments, &session] { return run_join(*arguments, session); });
}

}  // namespace hermesh::cli
