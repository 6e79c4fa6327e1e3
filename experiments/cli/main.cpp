// The program `hermesh`. What it does on the command line, its exit codes and its output are a contract for
// scripts: results on stdout, everything else on stderr, a failure is one line there, the last, after the
// notes.
#include <tbb/global_control.h>

#include <algorithm>
#include <iostream>
#include <new>
#include <thread>

#include "algorithms/core/shown.h"
#include "algorithms/io/mesh_file.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/help/suggestions.h"
#include "experiments/cli/laboratory.h"
#include "experiments/cli/pipeline/batch.h"
#include "experiments/cli/pipeline/json_report.h"
#include "experiments/cli/pipeline/log_file.h"
#include "experiments/cli/pipeline/streams.h"
#include "experiments/cli/session.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/terminal_progress.h"
#include "experiments/provenance.h"

namespace hermesh::cli {
namespace {

/// Longest error or note, in bytes. What is quoted from files is shorter; the names of files may be long.
constexpr std::size_t kLongest = 1500;

int fail(int exit_code, const std::string& sentence) {
  // Messages of libraries may hold line breaks, and names of files what controls a terminal; scripts rely on
  // one line.
  std::cerr << "hermesh: " << shown(sentence, kLongest, true) << std::endl;
  return exit_code;
}

void print_notes(Session& session) {
  if (!session.quiet)
    for (const std::string& note : session.context.notes)
      std::cerr << "note: " << shown(session.named(note), kLongest, true) << '\n';
  session.context.notes.clear();
}

/// Runs the command on the files that were named, or on standard streams.
int run_on_files(Session& session, CommandFiles* files) {
  std::optional<Streams> streams;
  if (files) streams.emplace(*files, session);
  const int exit_code = session.command();
  if (streams) streams->deliver();
  return exit_code;
}

/// The command by the name that plan_of() knows it by. How many tries a budget takes is unknown, so it has no
/// plan.
std::string planned_command(const Session& session) {
  for (const std::string option : {" --error", " --triangles"})
    if (session.command_line.find(option) != std::string::npos) return session.command_name + option;
  return session.command_name;
}

/// Runs the command, shows and logs how it gets on, and tells in JSON what came of it, if asked.
int run_command(Session& session, CommandFiles* files) {
  // A batch counts its files, which is all of its progress.
  const bool batch = session.writes_json_itself;
  const TerminalProgress progress(
      session.context, !session.quiet,
      batch ? std::vector<PlannedStage>{{"", 1.0}} : plan_of(planned_command(session)));
  std::optional<LogFile> log;
  if (!session.log_file.empty()) log.emplace(session, session.log_file, session.command_line);
  int exit_code = kFailed;
  try {
    exit_code = run_on_files(session, files);
  } catch (const std::exception& error) {
    if (log) log->line(std::string("failed: ") + error.what());
    throw;
  }
  if (log) log->line("ended with exit code " + std::to_string(exit_code));
  erase_progress_line();
  for (std::string& note : session.context.notes) note = session.named(note);
  if (!session.writes_json_itself) write_json_report(session, exit_code, "");
  std::cout.flush();
  if (!std::cout) throw Error("cannot write to the standard output");
  return exit_code;
}

/// Exit code and sentence of what ended the command.
std::pair<int, std::string> failure(const std::exception& error, const Session& session) {
  if (dynamic_cast<const UsageError*>(&error)) return {kUsage, session.named(error.what())};
  if (dynamic_cast<const std::bad_alloc*>(&error))
    return {kFailed, "out of memory: use larger voxels, a smaller mesh or a machine with more memory"};
  return {kFailed, session.named(error.what())};
}

/// Turns whatever ends the command into an exit code and at most one line.
int run_to_exit_code(Session& session, CommandFiles* files) {
  try {
    return run_command(session, files);
  } catch (const std::exception& error) {
    // Whatever a library throws while the user is waiting for the end, it ends because the user said so.
    if (const int exit_code = signal_exit_code()) end_process(exit_code);
    const auto [exit_code, sentence] = failure(error, session);
    // Who reads JSON gets the failure in it, too. What cannot be written then has been complained of by the
    // failure.
    try {
      if (!session.writes_json_itself) write_json_report(session, exit_code, sentence);
      std::cout.flush();
    } catch (const std::exception&) {
    }
    print_notes(session);
    return fail(exit_code, sentence);
  }
}

/// Name of an option whose value is an empty string, as a variable of a script that was not set leaves it; it
/// would be taken for one that was not given. Empty if there is no such option.
std::string option_without_value(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& given : option->results())
      if (given.empty()) return option->get_name();
  const auto all = [](const CLI::App*) { return true; };  // groups of options are commands, too
  for (const CLI::App* command : app.get_subcommands(all))
    if (const std::string found = option_without_value(*command); !found.empty()) return found;
  return {};
}

/// A sentence about a word behind --json that is meant as its file but would be taken for an input, for want
/// of an ending by which it is told; empty if there is none.
std::string misnamed_json_file(const std::vector<std::string>& words) {
  const auto at = std::ranges::find(words, "--json");
  if (at == words.end() || at + 1 == words.end()) return {};
  const std::filesystem::path word = *(at + 1);
  const std::string ending = word.extension().string();
  if (word.string().starts_with('-') || ending.empty() || is_mesh_path(word)) return {};
  // No command reads or makes what ends like this; and what is not there can be no input of any kind, but an
  // output of ours.
  const bool is_report = ending == ".txt" || ending == ".log" || ending == ".csv";
  const auto endings = {".json", ".jsonl", ".vdb", ".nii", ".raw", ".gz", ".toml"};
  const bool is_ours = std::ranges::find(endings, ending) != endings.end();
  std::error_code error;
  if (is_ours || (!is_report && std::filesystem::exists(word, error))) return {};
  return "--json takes the next word for its file where that ends in .json or .jsonl, and '" + word.string() +
         "' would be an input: write --json='" + word.string() + "' if it is the file";
}

/// The arguments in the order in which CLI11 takes them, the last one first. The file of --json is tied to
/// it, for a flag takes no value of its own accord; no file that a command reads or makes ends as that one
/// does.
std::vector<std::string> with_json_files(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  for (std::size_t i = 0; i + 1 < words.size(); ++i)
    if (words[i] == "--json" && (words[i + 1].ends_with(".json") || words[i + 1].ends_with(".jsonl"))) {
      words[i] += "=" + words[i + 1];
      words.erase(words.begin() + std::ptrdiff_t(i) + 1);
    }
  return {words.rbegin(), words.rend()};
}

int run_program(int argc, char** argv) {
  Session session;
  session.context.cancel = &handle_signals();
  session.version = HERMESH_VERSION;
  CLI::App app("Converts polygons to sparse volumes and back, and judges the meshes.", "hermesh");
  app.set_version_flag(
      "--version", [] { return "hermesh " HERMESH_VERSION "\n" + build_text(); },
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
  add_laboratory(app, session);
  add_help(app, session);
  if (const std::string sentence = misnamed_json_file({argv + 1, argv + argc}); !sentence.empty())
    return fail(kUsage, sentence + "; see hermesh --help");
  for (int i = 1; i < argc; ++i) session.command_line += (i > 1 ? " " : "") + std::string(argv[i]);
  try {
    app.parse(with_json_files(argc, argv));
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    std::string sentence = unknown_word(app, {argv + 1, argv + argc});
    if (sentence.empty() && dynamic_cast<const CLI::RequiredError*>(&error))
      sentence = missing_output(app, session);
    return fail(kUsage, (sentence.empty() ? error.what() : sentence) + "; see hermesh --help");
  } catch (const UsageError& error) {  // what a command sees while it reads its options
    return fail(kUsage, std::string(error.what()) + "; see hermesh --help");
  }
  if (const std::string option = option_without_value(app); !option.empty())
    return fail(kUsage, option + " was given an empty value; see hermesh --help");
  if (!session.command) return fail(kUsage, "say what to do: a command is missing; see hermesh --help");

  // Where nobody says how many, TBB takes as many as the machine has, and an experiment may ask for more.
  std::optional<tbb::global_control> limit;
  if (session.threads)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(*session.threads));
  CommandFiles* files = nullptr;
  try {
    files = files_of_command(app, session);
    check_written_files(app, files, session);
  } catch (const UsageError& error) {
    return fail(kUsage, std::string(error.what()) + "; see hermesh --help");
  }
  session.report = std::make_shared<JsonReport>();
  // A flag without a value is "true".
  session.json = session.json_file == "true";
  if (session.json) session.json_file.clear();
  const int exit_code = run_to_exit_code(session, files);
  work_is_finished();
  print_notes(session);
  return exit_code;
}

}  // namespace
}  // namespace hermesh::cli

int main(int argc, char** argv) {
  // What runs before this is compiled for x86-64-v2, too, but is not likely to need it.
  if (!__builtin_cpu_supports("sse4.2") || !__builtin_cpu_supports("popcnt"))
    return hermesh::cli::fail(
        hermesh::cli::kFailed,
        "this processor lacks SSE4.2 or POPCNT (x86-64-v2), which the program needs; if this is a "
        "virtual machine, let it show the host's processor");
  hermesh::cli::occupy_closed_streams();
  try {
    return hermesh::cli::run_program(argc, argv);
  } catch (const std::exception& error) {
    return hermesh::cli::fail(hermesh::cli::kFailed, error.what());
  }
}
