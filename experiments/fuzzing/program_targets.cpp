#include "algorithms/core/shown.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/command_line.h"
#include "experiments/fuzzing/targets.h"
#include "experiments/harness/job.h"

namespace hermesh::fuzzing {
namespace {

/// Parses words, one a line, as those behind the program's name. The command that they request is not run.
void parse_words(std::string_view bytes) {
  std::vector<std::string> words;
  while (!bytes.empty()) {
    const std::size_t end = bytes.find_first_of(std::string_view("\n\0", 2));
    words.emplace_back(bytes.substr(0, end));
    bytes.remove_prefix(end == bytes.npos ? bytes.size() : end + 1);
  }
  cli::Session session;
  CLI::App app("", "hermesh");
  app.set_version_flag("--version", "version");
  app.set_help_flag("--help,-h", "help");
  cli::add_commands(app, session);
  try {
    cli::parse_command_line(app, session, words);
  } catch (const CLI::Success&) {
  } catch (const Error& error) {
    // The program shows it in this way, because words may have control characters.
    throw Error(shown(error.what(), 1000, true));
  }
}

void read_job_line(std::string_view bytes) {
  const AnyJob job = read_job(bytes);
  if (job.kind == "input")
    read_change(job.json);
  else
    read_group_job(job.json);
}

constexpr Target kProgramTargets[] = {{"command_line", parse_words, false}, {"job", read_job_line, false}};

}  // namespace

std::span<const Target> program_targets() { return kProgramTargets; }

}  // namespace hermesh::fuzzing
