#include "experiments/cli/files.h"

#include <algorithm>
#include <cctype>

#include "algorithms/fracture/cutter_words.h"
#include "algorithms/io/atomic_file.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/cli/batch.h"
#include "experiments/cli/cli11.h"

namespace hermesh::cli {
namespace {

const std::pair<const char*, double> kMetres[] = {{"mm", 0.001},  {"cm", 0.01},     {"m", 1.0},
                                                  {"km", 1000.0}, {"inch", 0.0254}, {"foot", 0.3048}};

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

/// Returns true if two names are those of one file, which need not exist.
bool is_same_file(const std::string& first, const std::string& second) {
  std::error_code error;
  return std::filesystem::equivalent(first, second, error) || canonical_path(first) == canonical_path(second);
}

}  // namespace

std::optional<double> metres_in(const std::string& unit) {
  for (const auto& [name, metres] : kMetres)
    if (unit == name) return metres;
  return std::nullopt;
}

std::string unit_of(double metres) {
  for (const auto& [name, length] : kMetres)
    if (length == metres) return name;
  return text(metres) + " m";
}

void add_files(CLI::App& command, Session& session, CommandFiles given) {
  CommandFiles& files = session.files[&command] = std::move(given);
  const bool mesh = files.in != FileKind::imported &&
                    (files.in != FileKind::volume || (files.output && files.out == FileKind::mesh));
  command.add_option("--format", files.format,
                     std::string("Format for the standard input or output if - is given: ") +
                         (mesh ? "ply, obj, off, stl, glb, gltf or 3mf for a mesh (default: detected on "
                                 "input, ply on output)"
                               : "given by its kind"));
  command.add_option("--input-format", files.input_format,
                     "Format of the standard input if --format is that of the standard output");
  if (files.in == FileKind::mesh || files.in == FileKind::mesh_or_volume) {
    if (files.output)
      command
          .add_option("--scale", session.scale,
                      "Factor from coordinates in the mesh file to world units (default: 1); --voxel-size "
                      "and the output are in world units")
          ->check(finite_number() & CLI::PositiveNumber);
    std::vector<std::string> units;
    for (const auto& [name, metres] : kMetres) units.push_back(name);
    command
        .add_option(
            "--units", session.units,
            "Unit of coordinates in mesh files, of lengths given as options, and of the output. Files "
            "that state another unit (.3mf, .glb, .gltf) are converted, so that the size is the same "
            "(default: the unit of the input)")
        ->check(CLI::IsMember(units));
  }
  if (files.output && files.out != FileKind::folder)
    command.add_flag("--overwrite-input", files.overwrite_input,
                     "Allow OUT to be an input file; it is replaced once the work has succeeded");
  if (!files.takes_many) return;
  if (files.output) {
    command.add_option("MORE", files.more, "With --out-dir: more inputs (OUT is one, too)");
    command.add_option("--out-dir", files.out_dir,
                       "Directory for the outputs of many inputs; each runs in its own process, and a "
                       "failure does not stop the others");
    command.add_option(
        "--pattern", files.pattern,
        std::string("Names of these outputs: {stem} is the input's name without its ending, {name} the whole "
                    "name, {number} its index from 1 (default: {stem}.") +
            (files.out == FileKind::volume ? "vdb)" : "ply)"));
  } else {
    command.add_option("MORE", files.more, "More inputs; each runs in its own process");
  }
  command
      .add_option("--jobs", files.jobs,
                  "Number of inputs processed at the same time (default: 1); they share the threads")
      ->check(CLI::Range(1, 256));
}

void add_paths(CLI::App& command, Session& session, Paths& paths, const std::string& in, FileKind in_kind,
               const std::string& out, FileKind out_kind, bool many) {
  command.add_option("IN", paths.in, in)->required();
  // A batch has --out-dir instead of OUT.
  command.add_option("OUT", paths.out, out)->required(!many);
  add_files(
      command, session,
      {.inputs = {&paths.in}, .output = &paths.out, .in = in_kind, .out = out_kind, .takes_many = many});
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
  session.metres = metres_in(session.units).value_or(0.0);
  if (!files.takes_many || !is_batch(*asked[0], files)) return &files;
  session.command = [&files, &session, command = asked[0]] { return run_batch(*command, files, session); };
  session.writes_json_itself = true;
  return nullptr;
}

std::string canonical_path(const std::string& file) {
  std::error_code error;
  const std::filesystem::path path =
      std::filesystem::weakly_canonical(std::filesystem::absolute(file), error);
  return error ? file : path.string();
}

void check_written_files(const CLI::App& app, const CommandFiles* files, const Session& session) {
  std::vector<GivenValue> values;
  append_values(*app.get_subcommands().at(0), values);
  std::erase_if(values, [&](const GivenValue& given) {
    std::error_code error;
    return given.option == "--log" || given.option == "--json" ||
           (given.option != "OUT" && !std::filesystem::is_regular_file(given.value, error));
  });
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

void check_writable(const std::filesystem::path& path) { const AtomicFile reserved(path); }

void check_mesh_output(const std::filesystem::path& path) {
  if (!is_mesh_path(path))
    throw Error("cannot write a mesh to '" + path.string() + "': its name must end in " + kMeshEndings);
  check_writable(path);
}

void check_volume_output(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  if (extension != ".vdb")
    throw Error("cannot write a volume to '" + path.string() + "': its name must end in .vdb");
  check_writable(path);
}

}  // namespace hermesh::cli
