#include "experiments/cli/pipeline/command_files.h"

#include "experiments/cli/cli11.h"
#include "experiments/cli/pipeline/batch.h"
#include "experiments/cli/validators.h"

namespace hermesh::cli {
namespace {

struct Units {
  const char* name;
  double metres;
};
constexpr Units kUnits[] = {{"mm", 0.001},  {"cm", 0.01},     {"m", 1.0},
                            {"km", 1000.0}, {"inch", 0.0254}, {"foot", 0.3048}};

std::vector<std::string> names_of_units() {
  std::vector<std::string> names;
  for (const Units& units : kUnits) names.push_back(units.name);
  return names;
}

void add_scale_options(CLI::App& command, Session& session) {
  CLI::Option* scale = command
                           .add_option("--scale", session.scale,
                                       "Factor from the numbers in the mesh file to world units (default: "
                                       "1); --voxel-size and what is written are "
                                       "in world units")
                           ->check(finite_number() & CLI::PositiveNumber);
  command
      .add_option("--units", session.units,
                  "Units of the numbers in the mesh file, where the world is in metres; short for a --scale")
      ->check(CLI::IsMember(names_of_units()))
      ->excludes(scale);
}

}  // namespace

std::optional<double> metres_in(const std::string& unit) {
  for (const Units& units : kUnits)
    if (unit == units.name) return units.metres;
  return std::nullopt;
}

void add_files(CLI::App& command, Session& session, CommandFiles given) {
  CommandFiles& files = session.files[&command] = std::move(given);
  const bool mesh = files.in != FileKind::imported &&
                    (files.in != FileKind::volume || (files.output && files.out == FileKind::mesh));
  command.add_option(
      "--format", files.format,
      std::string("Format of a standard stream, which - names: ") +
          (mesh ? "ply, obj, off, stl, glb, gltf or 3mf of a mesh (default: the standard input's by its content, ply for the "
                  "standard output)"
                : "told by its kind"));
  command.add_option("--input-format", files.input_format,
                     "Format of the standard input, where --format is that of the standard output");
  if (files.output && (files.in == FileKind::mesh || files.in == FileKind::mesh_or_volume))
    add_scale_options(command, session);
  if (!files.takes_many) return;
  if (files.output) {
    command.add_option("MORE", files.batch.more, "With --out-dir: more inputs (OUT is one, too)");
    command.add_option("--out-dir", files.batch.out_dir,
                       "Folder for the outputs of many inputs, each worked on in a process of its own; goes "
                       "on after a failure");
    command.add_option(
        "--pattern", files.batch.pattern,
        std::string(
            "Names of these outputs: {stem} is the input's name without its ending, {name} all of it, "
            "{number} its place (default: {stem}.") +
            (files.out == FileKind::volume ? "vdb)" : "ply)"));
  } else {
    command.add_option("MORE", files.batch.more, "More inputs, each worked on in a process of its own");
  }
  command
      .add_option("--jobs", files.batch.jobs,
                  "How many inputs at a time (default: 1); threads are shared among them")
      ->check(CLI::Range(1, 256));
}

std::string missing_output(const CLI::App& app, const Session& session) {
  const std::vector<CLI::App*> asked = app.get_subcommands();
  const auto found = asked.empty() ? session.files.end() : session.files.find(asked[0]);
  if (found == session.files.end() || !found->second.takes_many || !found->second.output) return "";
  const bool missing = asked[0]->count("IN") > 0 && asked[0]->count("OUT") == 0 && asked[0]->count("--out-dir") == 0;
  return missing ? "OUT is required, or --out-dir for many inputs" : "";
}

CommandFiles* files_of_command(const CLI::App& app, Session& session) {
  const std::vector<CLI::App*> asked = app.get_subcommands();
  if (asked.empty()) return nullptr;
  session.command_name = asked[0]->get_name();
  const auto found = session.files.find(asked[0]);
  if (found == session.files.end()) return nullptr;
  CommandFiles& files = found->second;
  for (const std::string* input : files.inputs)
    if (!input->empty()) session.inputs.push_back(*input);
  if (files.output) session.output = *files.output;
  for (const Units& units : kUnits)
    if (session.units == units.name) session.scale = units.metres;
  if (!files.takes_many || !is_batch(*asked[0], files)) return &files;
  session.command = [&files, &session, command = asked[0]] { return run_batch(*command, files, session); };
  session.writes_json_itself = true;
  return nullptr;
}

}  // namespace hermesh::cli
