// The program `hermesh`. What it does on the command line, its exit codes and its output are a contract for
// scripts: results on stdout, everything else on stderr, a failure is one line there, the last, after the notes.
#include <tbb/global_control.h>

#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>
#include <new>
#include <thread>

#include "algorithms/core/shown.h"
#include "experiments/cases/cases.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/session.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/terminal_progress.h"
#include "experiments/harness/provenance.h"

namespace hermesh::cli {
namespace {

/// Longest error or note, in bytes. What is quoted from files is shorter; the names of files may be long.
constexpr std::size_t kLongest = 1500;

int fail(int exit_code, const std::string& sentence) {
  // Messages of libraries may hold line breaks, and names of files what controls a terminal; scripts rely on one line.
  std::cerr << "hermesh: " << shown(sentence, kLongest, true) << std::endl;
  return exit_code;
}

void print_notes(Session& session) {
  if (!session.quiet)
    for (const std::string& note : session.context.notes) std::cerr << "note: " << shown(note, kLongest, true) << '\n';
  session.context.notes.clear();
}

/// Most threads that can be asked for: TBB reserves memory for as many as it is told that there may be.
constexpr int kMostThreads = 1024;

void add_common_options(CLI::App& app, Session& session) {
  app.add_option("--threads", session.threads, "Number of threads, 1 to 1024 (default: all of the machine)")
      ->check([](const std::string& given) {
        int count = 0;
        return CLI::detail::lexical_cast(given, count) && count >= 1 && count <= kMostThreads
                   ? std::string()
                   : "must be a whole number from 1 to " + std::to_string(kMostThreads) + ", not '" + given + "'";
      });
  app.add_flag("--quiet", session.quiet, "Print results and errors only: no progress, notes or summaries");
}

void print_json(const Session& session) {
  nlohmann::json json{{"notes", session.context.notes}, {"figures", nlohmann::json::object()}};
  for (const auto& [name, value] : session.context.figures) json["figures"][name] = value;
  for (const auto& [stage, seconds] : session.context.stage_seconds)
    json["stage_seconds"].push_back({{"stage", stage}, {"seconds", seconds}});
  // A file's name need not be UTF-8, JSON must.
  std::cout << json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) << '\n';
}

int run_command(Session& session) {
  const TerminalProgress progress(session.context, !session.quiet);
  const int exit_code = session.command();
  if (session.json) print_json(session);
  std::cout.flush();
  if (!std::cout) throw Error("cannot write to the standard output");
  return exit_code;
}

/// Turns whatever ends the command into an exit code and at most one line.
int run_to_exit_code(Session& session) {
  try {
    return run_command(session);
  } catch (const std::exception& error) {
    // Whatever a library throws while the user is waiting for the end, it ends because the user said so.
    if (const int exit_code = signal_exit_code()) end_process(exit_code);
    print_notes(session);
    if (dynamic_cast<const UsageError*>(&error)) return fail(kUsage, error.what());
    if (dynamic_cast<const DataMissing*>(&error)) return fail(kNotMet, error.what());
    if (dynamic_cast<const std::bad_alloc*>(&error))
      return fail(kFailed, "out of memory: use larger voxels, a smaller mesh or a machine with more memory");
    return fail(kFailed, error.what());
  }
}

/// Name of an option whose value is an empty string, as a variable of a script that was not set leaves it; it would be
/// taken for one that was not given. Empty if there is no such option.
std::string option_without_value(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& given : option->results())
      if (given.empty()) return option->get_name();
  const auto all = [](const CLI::App*) { return true; };  // groups of options are commands, too
  for (const CLI::App* command : app.get_subcommands(all))
    if (const std::string found = option_without_value(*command); !found.empty()) return found;
  return {};
}

int run_program(int argc, char** argv) {
  Session session;
  session.context.cancel = &handle_signals();
  CLI::App app("Converts polygons to sparse volumes and back, and judges the meshes.", "hermesh");
  set_source_state(built_from());
  app.set_version_flag("--version", [] { return "hermesh " HERMESH_VERSION "\n" + provenance_text(); },
                       "Print the version, and what the program was built from and with, and exit");
  app.set_help_flag("--help,-h", "Print this help and exit");
  add_common_options(app, session);
  add_list(app, session);
  add_voxelize(app, session);
  add_import(app, session);
  add_conversions(app, session);
  add_combine(app, session);
  add_fracture(app, session);
  add_validate(app, session);
  add_info(app, session);
  add_experiments(app, session);
  add_compare(app, session);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    return fail(kUsage, std::string(error.what()) + "; see hermesh --help");
  }
  if (const std::string option = option_without_value(app); !option.empty())
    return fail(kUsage, option + " was given an empty value; see hermesh --help");
  if (!session.command) return fail(kUsage, "say what to do: a command is missing; see hermesh --help");

  // Where nobody says how many, TBB takes as many as the machine has, and an experiment may ask for more.
  std::optional<tbb::global_control> limit;
  if (session.threads)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(*session.threads));
  const int exit_code = run_to_exit_code(session);
  work_is_finished();
  print_notes(session);
  return exit_code;
}

}  // namespace

CLI::App* add_command(CLI::App& app, Session& session, const std::string& name, const std::string& summary) {
  CLI::App* command = app.add_subcommand(name, summary);
  add_common_options(*command, session);
  return command;
}

void refuse_idle(const CLI::App& command, std::initializer_list<const char*> options, const std::string& why) {
  for (const char* option : options)
    if (command.count(option) > 0) throw UsageError(std::string(option) + " has no effect: " + why);
}

void add_json_option(CLI::App& command, Session& session) {
  command.add_flag("--json", session.json, "Print what was done as JSON: notes, figures, times of stages");
}

}  // namespace hermesh::cli

int main(int argc, char** argv) {
  // What runs before this is compiled for x86-64-v2, too, but is not likely to need it.
  if (!__builtin_cpu_supports("sse4.2") || !__builtin_cpu_supports("popcnt"))
    return hermesh::cli::fail(hermesh::cli::kFailed,
                              "this processor lacks SSE4.2 or POPCNT (x86-64-v2), which the program needs; if this is a "
                              "virtual machine, let it show the host's processor");
  try {
    return hermesh::cli::run_program(argc, argv);
  } catch (const std::exception& error) {
    return hermesh::cli::fail(hermesh::cli::kFailed, error.what());
  }
}
