// What all commands of the program share.
#pragma once

#include <functional>
#include <initializer_list>
#include <optional>
#include <string>

#include "algorithms/core/error.h"
#include "algorithms/core/run_context.h"

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

struct Session {
  RunContext context;
  bool quiet = false;
  bool json = false;             ///< prints what was done as one JSON object instead of summaries
  std::optional<int> threads;    ///< number of threads; none: as many as the machine has
  std::function<int()> command;  ///< runs the command that was asked for; returns an ExitCode
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
void add_experiments(CLI::App& app, Session& session);  ///< adds run, conform, report and claims
void add_compare(CLI::App& app, Session& session);      ///< adds compare, accept and merge

/// Lets a command that makes volumes or surfaces print what it did as JSON: its notes, figures and times of stages.
void add_json_option(CLI::App& command, Session& session);

/// Refuses the options that were given though nothing would look at them. @throws UsageError that ends with `why`.
void refuse_idle(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why);

/// Adds a subcommand with the options that all subcommands take, and returns it.
CLI::App* add_command(CLI::App& app, Session& session, const std::string& name, const std::string& summary);

}  // namespace hermesh::cli
