// Files that a command reads and writes, identified by the variables that the command line fills.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace hermesh::cli {

struct Session;

enum class FileKind {
  mesh,
  volume,
  mesh_or_volume,
  imported,  ///< a volume of another program, such as .nii
  folder,
};

struct CommandFiles {
  std::vector<std::string*> inputs;
  std::string* output = nullptr;  ///< null: the command writes no file
  FileKind in = FileKind::mesh, out = FileKind::mesh;
  bool takes_many = false;                     ///< true if the command accepts many inputs, as a batch
  std::string format = {}, input_format = {};  ///< of standard streams; empty: not given
  bool overwrite_input = false;                ///< true if the output may be one of the inputs
  // Options of a batch.
  std::vector<std::string> more = {};      ///< inputs after the first two
  std::string out_dir = {}, pattern = {};  ///< empty: not given
  int jobs = 1;
};

struct Paths {
  std::string in, out;
};

/// Registers the files of a command, for standard streams, batches and JSON, and adds the options that
/// concern them: formats of standard streams, scale and units, and, if the command takes many inputs, those
/// of a batch. The variables must outlive the command.
void add_files(CLI::App& command, Session& session, CommandFiles files);

/// Adds the arguments IN and OUT and registers them as files of these kinds; `many` lets the command run on
/// many inputs.
void add_paths(CLI::App& command, Session& session, Paths& paths, const std::string& in, FileKind in_kind,
               const std::string& out, FileKind out_kind, bool many = false);

/// Returns the metres in a unit that --units takes; none for another word.
std::optional<double> metres_in(const std::string& unit);
/// Returns the name of a unit by its length in metres, or that length if --units has no such unit.
std::string unit_of(double metres);

/// Returns the files of the command on the command line; null if it works on no files, and for a batch, which
/// becomes session.command. Sets the names of the command and of its files in the session.
/// @throws UsageError if the arguments are neither those of one file nor of many.
CommandFiles* files_of_command(const CLI::App& app, Session& session);

/// Returns a message if the command has an input and no output; empty otherwise. It takes precedence over
/// messages about other missing options.
std::string missing_output(const CLI::App& app, const Session& session);

/// Returns the absolute path of a file, which need not exist, without links and dots.
std::string canonical_path(const std::string& file);

/// Checks that no file that the command writes would replace or damage one that it reads: the log and the
/// JSON never, the output only with --overwrite-input. `files` are those of files_of_command(); a batch
/// checks its outputs itself.
/// @throws UsageError
void check_written_files(const CLI::App& app, const CommandFiles* files, const Session& session);

// Checks that a file can be written, before the work that makes it.

/// @throws Error if the directory does not exist or is read-only, or if something other than a plain file is
/// there.
void check_writable(const std::filesystem::path& path);
/// @throws Error unless the name ends as those of mesh files do (kMeshEndings); as check_writable().
void check_mesh_output(const std::filesystem::path& path);
/// @throws Error unless the name ends in .vdb; as check_writable().
void check_volume_output(const std::filesystem::path& path);

}  // namespace hermesh::cli
