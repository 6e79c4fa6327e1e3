// State of one run of the program, and the functions that all commands share.
#pragma once

#include <chrono>
#include <functional>
#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/core/error.h"
#include "algorithms/core/number_text.h"
#include "algorithms/core/run_context.h"
#include "experiments/cli/files.h"

namespace hermesh::cli {

using Json = nlohmann::ordered_json;

/// Exit codes of the program; 128 plus the number of a signal if the signal ended it.
enum ExitCode { kDone = 0, kFailed = 1, kUsage = 2, kNotMet = 3 };

/// A command line that asks for something that does not exist or is impossible: exit code 2.
class UsageError : public Error {
  using Error::Error;
};

/// Runs `check`, whose errors are about words of the command line, and rethrows these as UsageError.
template <typename Check>
auto as_usage(Check check) {
  try {
    return check();
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
}

struct Session {
  RunContext context;
  bool quiet = false;
  bool json = false;                            ///< prints one JSON object instead of summaries
  std::string json_file;                        ///< file for that object; empty: none
  std::optional<int> threads;                   ///< number of threads; none: all of the machine
  std::string log_file;                         ///< empty: no log
  std::function<void(const std::string&)> log;  ///< appends a line to the log; empty without a log
  std::function<int()> command;                 ///< runs the requested command; returns an ExitCode

  std::map<const CLI::App*, CommandFiles> files;  ///< of the commands that work on files
  std::string command_name, command_line, version;
  double scale = 1.0;   ///< world units per unit of the coordinates in an input mesh file
  std::string units;    ///< of coordinates, option values and output; empty: those of the input
  double metres = 0.0;  ///< length of the world unit: that of `units`, else of the first input; 0: unknown
  std::vector<std::string> inputs;  ///< as the user named them
  std::string output;               ///< as the user named it; empty: none
  bool writes_json_itself = false;  ///< true if the command prints its own JSON, as a batch does line by line
  bool writes_stream = false;       ///< true if the output is the standard output
  /// Names of temporary files, and their names in messages.
  std::vector<std::pair<std::string, std::string>> stream_names;

  Json result = Json::object();                      ///< key `result` of the JSON object
  nlohmann::json beside = nlohmann::json::object();  ///< keys next to the common ones
  std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();

  /// Returns the message with the names of temporary files replaced by those of the standard streams.
  std::string named(std::string message) const;
};

/// Sets a key of `result` in the JSON object of the run.
inline void made(Session& session, const std::string& key, const Json& value) { session.result[key] = value; }

/// Prints a line of summary, unless the session is quiet or prints JSON, and logs it.
void print_summary(const Session& session, const std::string& line);

std::string seconds_text(double seconds);  ///< "1.234 s"
/// Returns the length in world units, with their name if it is known.
std::string length_text(const Session& session, double length);

/// Returns JSON text of the value with a line break at its end; bytes that are not UTF-8 become question
/// marks. An `indent` of −1 writes one line.
std::string json_text(const Json& value, int indent);

/// Writes the JSON object of the run (pipeline.md lists its keys) if one was requested; `error` is empty
/// after success.
/// @throws Error if the file cannot be written.
void write_json_report(const Session& session, int exit_code, const std::string& error);

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

/// Adds the options that the program and all of its commands take.
void add_common_options(CLI::App& app, Session& session);

/// Adds a command with the options that all commands take, and returns it.
CLI::App* add_command(CLI::App& app, Session& session, const std::string& name, const std::string& summary);

/// Adds --json, which prints or writes the JSON object of the run.
void add_json_option(CLI::App& command, Session& session);

/// Refuses options that were given and that have no effect. @throws UsageError that ends with `why`.
void refuse_idle(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);

}  // namespace hermesh::cli
