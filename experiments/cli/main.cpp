// The program `hermesh`. Its commands, exit codes and output are an interface for scripts: results on stdout,
// everything else on stderr, where a failure is the last line, after the notes.
#include <fcntl.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <exception>
#include <iostream>
#include <new>
#include <string_view>
#include <system_error>

#include "algorithms/core/shown.h"
#include "algorithms/thesis/voxels/dense_hermite.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/command_line.h"
#include "experiments/cli/signals.h"
#include "experiments/cli/streams.h"
#include "experiments/cli/terminal_progress.h"
#include "experiments/provenance.h"

namespace hermesh::cli {
namespace {

/// Longest error or note, in bytes. Quotations from files are shorter; the names of files may be long.
constexpr std::size_t kLongest = 1500;

constexpr std::string_view kNoThread =
    "no thread can be started: raise the limit of memory (ulimit -v) or of processes (ulimit -u)";

/// Returns the message of an exception that is not an Error, from the standard library or another one.
std::string message_of(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error))
    return "out of memory: use larger voxels, a smaller mesh or a machine with more memory";
  const auto* const system = dynamic_cast<const std::system_error*>(&error);
  return std::string(system && system->code() == std::errc::resource_unavailable_try_again ? kNoThread
                                                                                           : error.what());
}

int fail(int exit_code, const std::string& message) {
  // Messages of libraries may have line breaks, and names of files control characters; scripts rely on one
  // line.
  std::cerr << "hermesh: " << shown(message, kLongest, true) << std::endl;
  return exit_code;
}

/// Appends a log to a file during its lifetime: the command line, the beginning and end of each stage, notes,
/// summaries and the end of the run. Each line begins with the time in UTC and is written at once, so that it
/// survives a killed run.
class LogFile {
 public:
  /// Opens the file and listens to the session. @throws Error if it cannot be written.
  explicit LogFile(Session& session)
      : session_(session),
        file_(open(session.log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666)) {
    if (file_ < 0) throw Error("cannot write the log '" + session.log_file + "': " + std::strerror(errno));
    line("hermesh " + session.version + ": " + session.command_line);
    session.log = [this](const std::string& text) { line(text); };
    session.context.on_progress = [this, shown_before = session.context.on_progress](std::string_view stage,
                                                                                     double fraction) {
      if (shown_before) shown_before(stage, fraction);
      const auto& ended = session_.context.stage_seconds;
      if (fraction >= 1.0 && !ended.empty() && stage.ends_with(ended.back().first)) {
        line("end of stage '" + std::string(stage) + "', " + seconds_text(ended.back().second));
        stage_.clear();
      } else if (stage != stage_) {
        stage_ = stage;
        line("stage '" + stage_ + "'");
      } else if (std::chrono::steady_clock::now() - written_ >= std::chrono::minutes(1)) {
        line("stage '" + stage_ + "', " + std::to_string(int(100.0 * fraction)) + " %");
      }
    };
  }
  ~LogFile() {
    add_notes();
    session_.log = nullptr;
    session_.context.on_progress = nullptr;
    close(file_);
  }
  LogFile(const LogFile&) = delete;
  LogFile& operator=(const LogFile&) = delete;

  /// Appends the new notes and a line.
  void line(const std::string& text) {
    add_notes();
    write_line(text);
  }

 private:
  void add_notes() {
    for (; notes_ < session_.context.notes.size(); ++notes_)
      write_line("note: " + session_.context.notes[notes_]);
  }
  void write_line(const std::string& text) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const std::time_t seconds = std::chrono::duration_cast<std::chrono::seconds>(now).count();
    const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(now).count() % 1000;
    std::tm parts = {};
    gmtime_r(&seconds, &parts);
    char date[32], end[16];
    std::strftime(date, sizeof date, "%Y-%m-%dT%H:%M:%S", &parts);
    std::snprintf(end, sizeof end, ".%03dZ ", int(milliseconds));
    const std::string all = date + (end + shown(session_.named(text), 4000, true)) + "\n";
    written_ = std::chrono::steady_clock::now();
    // A log that cannot be written must not end the work; the next line is tried again.
    [[maybe_unused]] const ssize_t written = write(file_, all.data(), all.size());
  }

  Session& session_;
  int file_;
  std::size_t notes_ = 0;  ///< number of notes in the file
  std::chrono::steady_clock::time_point written_ = {};
  std::string stage_;
};

void print_notes(Session& session) {
  if (!session.quiet)
    for (const std::string& note : session.context.notes)
      std::cerr << "note: " << shown(session.named(note), kLongest, true) << '\n';
  session.context.notes.clear();
}

/// Runs the command on its files or on standard streams.
int run_on_files(Session& session, CommandFiles* files) {
  std::optional<Streams> streams;
  if (files) streams.emplace(*files, session);
  const int exit_code = session.command();
  if (streams) streams->deliver();
  return exit_code;
}

/// Returns the name of the command for plan_of(). A budget takes an unknown number of attempts and has no
/// plan.
std::string planned_command(const Session& session) {
  for (const std::string option : {" --error", " --triangles"})
    if (session.command_line.find(option) != std::string::npos) return session.command_name + option;
  return session.command_name;
}

/// Runs the command, shows and logs its progress, and writes its JSON if requested.
int run_command(Session& session, CommandFiles* files) {
  // The progress of a batch is the share of its files.
  const bool batch = session.writes_json_itself;
  const TerminalProgress progress(
      session.context, !session.quiet,
      batch ? std::vector<PlannedStage>{{"", 1.0}} : plan_of(planned_command(session)));
  std::optional<LogFile> log;
  if (!session.log_file.empty()) log.emplace(session);
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

/// Returns the exit code and the message for an exception that ended the command.
std::pair<int, std::string> failure(const std::exception& error, const Session& session) {
  if (dynamic_cast<const UsageError*>(&error)) return {kUsage, session.named(error.what())};
  return {kFailed, session.named(message_of(error))};
}

/// Runs the command; returns the exit code, and prints the message of a failure.
int run_to_exit_code(Session& session, CommandFiles* files) {
  try {
    return run_command(session, files);
  } catch (const std::exception& error) {
    // After a signal any exception of a library ends the run on the user's request.
    if (const int exit_code = signal_exit_code()) end_process(exit_code);
    const auto [exit_code, message] = failure(error, session);
    // The JSON has the failure, too. If it cannot be written, the message of the failure suffices.
    try {
      if (!session.writes_json_itself) write_json_report(session, exit_code, message);
      std::cout.flush();
    } catch (const std::exception&) {
    }
    print_notes(session);
    return fail(exit_code, message);
  }
}

int run_program(int argc, char** argv) {
  Session session;
  session.context.cancel = &handle_signals();
  session.version = HERMESH_VERSION;
  CLI::App app("Converts polygons to sparse volumes and back, and validates meshes.", "hermesh");
  app.set_version_flag(
      "--version", [] { return "hermesh " HERMESH_VERSION "\n" + build_text(); },
      "Print the version and the build facts, and exit");
  app.set_help_flag("--help,-h", "Print this help and exit");
  add_commands(app, session);
  CommandFiles* files = nullptr;
  try {
    files = parse_command_line(app, session, {argv + 1, argv + argc});
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const UsageError& error) {
    return fail(kUsage, std::string(error.what()) + "; see hermesh --help");
  }

  // Without a limit TBB uses the whole machine, and an experiment may request more.
  std::optional<tbb::global_control> limit;
  if (session.threads)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(*session.threads));
  // The value of a flag without one is "true".
  session.json = session.json_file == "true";
  if (session.json) session.json_file.clear();
  session.start = std::chrono::steady_clock::now();
  const int exit_code = run_to_exit_code(session, files);
  work_is_finished();
  print_notes(session);
  return exit_code;
}

std::terminate_handler usual_end;

/// Runs before the initialisers of the libraries. That of log4cplus, which OpenVDB uses, starts threads, and
/// nobody could catch its exception if the limit of memory or of processes allows none.
void prepare_libraries(int, char**, char**) {
  usual_end = std::set_terminate([] {
    for (const std::string_view text : {std::string_view("hermesh: "), kNoThread, std::string_view("\n")})
      if (write(STDERR_FILENO, text.data(), text.size()) < 0) break;
    _exit(kFailed);
  });
}
[[gnu::used, gnu::section(".preinit_array")]] void (*const first)(int, char**, char**) = prepare_libraries;

}  // namespace
}  // namespace hermesh::cli

int main(int argc, char** argv) {
  std::set_terminate(hermesh::cli::usual_end);
  // Static initialisers are compiled for x86-64-v2, too, but are unlikely to need it.
  if (!__builtin_cpu_supports("sse4.2") || !__builtin_cpu_supports("popcnt"))
    return hermesh::cli::fail(
        hermesh::cli::kFailed,
        "this processor lacks SSE4.2 or POPCNT (x86-64-v2), which the program needs; if this is a "
        "virtual machine, let it expose the host's processor");
  hermesh::cli::occupy_closed_streams();
  try {
    hermesh::register_dense_grids();
    return hermesh::cli::run_program(argc, argv);
  } catch (const std::exception& error) {
    return hermesh::cli::fail(hermesh::cli::kFailed, hermesh::cli::message_of(error));
  }
}
