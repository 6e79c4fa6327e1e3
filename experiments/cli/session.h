// What all commands of the program share.
#pragma once

#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/run_context.h"
#include "experiments/cli/pipeline/command_files.h"

namespace CLI {
class App;
}

namespace hermesh::cli {

/// Exit codes of the program. 130 and 143 (128 + the signal's number) stand for a cancelled run.
enum ExitCode { kDone = 0, kFailed = 1, kUsage = 2, kNotMet = 3 };

/// A command line that asks for something that does not exist or cannot be: exit code 2.
class UsageError : public Error {
  using Error::Error;
};

/// Runs `check`, whose errors are the user's choice of words (the name of a variant, the value of an option),
/// so that they count as usage.
template <typename Check>
auto as_usage(Check check) {
  try {
    return check();
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
}

struct JsonReport;  // pipeline/json_report.h

struct Session {
  RunContext context;
  bool quiet = false;
  bool json = false;           ///< prints what was done as one JSON object instead of summaries
  std::string json_file;       ///< file that such an object is written to; empty: none
  std::optional<int> threads;  ///< number of threads; none: as many as the machine has
  std::string log_file;        ///< empty: no log is kept
  std::function<void(const std::string&)> log;  ///< adds a line to the log; empty where none is kept
  std::function<int()> command;                 ///< runs the command that was asked for; returns an ExitCode

  std::map<const CLI::App*, CommandFiles> files;  ///< of the commands that work on files
  std::string command_name, command_line, version;
  double scale = 1.0;  ///< world units in one unit of the numbers of a mesh file that is read
  std::string units;   ///< of the numbers of a mesh file, where the world is in metres; empty: not given
  std::vector<std::string> inputs;  ///< as the user named them; empty: the command has none
  std::string output;               ///< as the user named it; empty: there is none
  bool writes_json_itself = false;  ///< whether the command prints its JSON, as a batch does line by line
  bool writes_stream = false;       ///< whether the output is the standard output
  /// Names of temporary files, and what sentences call these.
  std::vector<std::pair<std::string, std::string>> stream_names;
  std::shared_ptr<JsonReport> report;  ///< what goes into the JSON; null until the command runs

  /// The sentence with the standard streams by their names in place of those of temporary files.
  std::string named(std::string sentence) const;
};

// Each adds its commands, which set session.command when they are parsed.
void add_list(CLI::App& app, Session& session);
void add_voxelize(CLI::App& app, Session& session);
void add_import(CLI::App& app, Session& session);
void add_conversions(CLI::App& app, Session& session);  ///< adds extract and remesh
void add_combine(CLI::App& app, Session& session);
void add_fracture(CLI::App& app, Session& session);
void add_validate(CLI::App& app, Session& session);
void add_info(CLI::App& app, Session& session);
void add_help(CLI::App& app, Session& session);  ///< adds doctor, completion and man

/// Registers the files of a command, for standard streams, batches and JSON. The variables must live as long
/// as it does. Also adds the options that name the formats of standard streams, and, if the command takes
/// many inputs, those of a batch.
void add_files(CLI::App& command, Session& session, CommandFiles files);

/// Lets a command print what it did as JSON (pipeline/json_report.h), or write that to a file.
void add_json_option(CLI::App& command, Session& session);

/// Refuses the options that were given though nothing would look at them. @throws UsageError that ends with
/// `why`.
void refuse_idle(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);

/// Adds the options that the program and all of its commands take.
void add_common_options(CLI::App& app, Session& session);

/// Adds a subcommand with the options that all subcommands take, and returns it.
CLI::App* add_command(CLI::App& app, Session& session, const std::string& name, const std::string& summary);

}  // namespace hermesh::cli
