#include "experiments/cli/pipeline/command_files.h"

#include <filesystem>

#include "algorithms/fracture/cutter_words.h"
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
  command.add_option("--format", files.format,
                     std::string("Format of a standard stream, which - names: ") +
                         (mesh ? "ply, obj, off, stl, glb, gltf or 3mf of a mesh (default: the standard "
                                 "input's by its content, ply for the "
                                 "standard output)"
                               : "told by its kind"));
  command.add_option("--input-format", files.input_format,
                     "Format of the standard input, where --format is that of the standard output");
  if (files.output && (files.in == FileKind::mesh || files.in == FileKind::mesh_or_volume))
    add_scale_options(command, session);
  if (files.output && files.out != FileKind::folder)
    command.add_flag(
        "--overwrite-input", files.overwrite_input,
        "Allow OUT to be a file that the command reads; it is replaced once the work has succeeded");
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

namespace {

/// A value of an option or of a positional argument, which may be the name of a file.
struct GivenValue {
  std::string option, value;
};

/// Appends the values of all options of the command and of its groups, and the files that --cutters names.
void append_values(const CLI::App& command, std::vector<GivenValue>& values) {
  for (const CLI::Option* option : command.get_options())
    for (const std::string& value : option->results()) {
      values.push_back({option->get_name(), value});
      if (option->get_name() == "--cutters" && value.starts_with("mesh:"))
        for (const CutterSpec::File& file : as_usage([&] { return parse_cutters(value); }).files)
          values.push_back({"--cutters", file.path});
    }
  for (const CLI::App* group : command.get_subcommands([](const CLI::App*) { return true; }))
    append_values(*group, values);
}

/// Returns whether two names are those of one file, which need not exist.
bool is_same_file(const std::string& first, const std::string& second) {
  std::error_code error;
  return std::filesystem::equivalent(first, second, error) || place_of(first) == place_of(second);
}

}  // namespace

void check_written_files(const CLI::App& app, const CommandFiles* files, const Session& session) {
  std::vector<GivenValue> values;
  append_values(*app.get_subcommands().at(0), values);
  const auto names_file = [](const GivenValue& given) {
    std::error_code error;
    return given.option != "--log" && given.option != "--json" &&
           (given.option == "OUT" || std::filesystem::is_regular_file(given.value, error));
  };
  std::erase_if(values, [&](const GivenValue& given) { return !names_file(given); });
  const std::string json = session.json_file == "true" ? "" : session.json_file;
  if (!json.empty()) values.push_back({"--json", json});
  for (const auto& [option, file] : {std::pair("--log", session.log_file), std::pair("--json", json)})
    for (const GivenValue& given : values)
      if (!file.empty() && given.option != option && is_same_file(given.value, file))
        throw UsageError(std::string(option) + " '" + file + "' would be written into the file of " +
                         given.option + "; name another file");
  const bool is_written = files && files->output && *files->output != "-" && files->out != FileKind::folder;
  if (!is_written || files->overwrite_input) return;
  for (const GivenValue& given : values)
    if (given.option != "OUT" && is_same_file(given.value, *files->output))
      throw UsageError("OUT '" + *files->output + "' is also read, as " + given.option +
                       ", and would be overwritten; name another output, or pass --overwrite-input");
}

std::string missing_output(const CLI::App& app, const Session& session) {
  const std::vector<CLI::App*> asked = app.get_subcommands();
  const auto found = asked.empty() ? session.files.end() : session.files.find(asked[0]);
  if (found == session.files.end() || !found->second.takes_many || !found->second.output) return "";
  const bool missing =
      asked[0]->count("IN") > 0 && asked[0]->count("OUT") == 0 && asked[0]->count("--out-dir") == 0;
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
