#include "experiments/cli/laboratory.h"

#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <utility>

#include "experiments/cli/child_run.h"
#include "experiments/cli/cli11.h"
#include "experiments/cli/session.h"

namespace hermesh::cli {
namespace {

constexpr std::array<std::pair<const char*, const char*>, 8> kCommands = {{
    {"run", "Run an experiment: validate, time, append rows, print the table"},
    {"conform", "Check a variant's guarantees on difficult shapes, and its bytes for any number of threads"},
    {"report", "Print tables of the rows of earlier runs; fill or check the numbers of the project's pages"},
    {"claims", "Print the verdict of the rows on each claim of the thesis"},
    {"compare", "Compare rows with a baseline; exit code 3 if something became worse or is missing"},
    {"accept", "Make the rows of a directory the baseline of their experiment, and print the changes"},
    {"merge", "Join the shards of an experiment (hermesh run --shard) to the rows of the whole"},
    {"benchmark", "Run programs on a corpus of models and print their success rates"},
}};

/// Prepares the environment of the laboratory and returns its command line. Option -P keeps the working
/// directory, which may have a directory `experiments` of its own, out of Python's path. @throws Error if the
/// laboratory is not installed.
std::vector<std::string> laboratory_command(const std::vector<std::string>& words) {
  const std::filesystem::path directory = experiments_directory();
  std::error_code error;
  if (!std::filesystem::exists(directory / "lab/__main__.py", error))
    throw Error("the laboratory is not in '" + directory.string() +
                "'; clone the project's repository and set HERMESH_EXPERIMENTS to its directory experiments");
  // The caller's path follows, because programs of an experiment may need it.
  std::string path = std::filesystem::absolute(directory).parent_path();
  if (const char* const given = std::getenv("PYTHONPATH"); given && *given) path += std::string(":") + given;
  setenv("PYTHONPATH", path.c_str(), 1);
  setenv("HERMESH", std::filesystem::canonical("/proc/self/exe").c_str(), 1);
  // Debian's interpreter sees the packages that Debian installs; another python3 on the path may not.
  const bool is_debian = access("/usr/bin/python3", X_OK) == 0;
  std::vector<std::string> command{is_debian ? "/usr/bin/python3" : "python3", "-P", "-m", "experiments.lab"};
  command.insert(command.end(), words.begin(), words.end());
  return command;
}

/// Replaces this process by the laboratory. @throws Error if that fails.
[[noreturn]] void become_laboratory(const std::vector<std::string>& words) {
  const std::vector<std::string> command = laboratory_command(words);
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execvp(arguments[0], arguments.data());
  throw Error("cannot start " + command[0] + ": " + std::strerror(errno) +
              "; apt-get install python3 python3-scipy");
}

}  // namespace

std::filesystem::path experiments_directory() {
  const char* const given = std::getenv("HERMESH_EXPERIMENTS");
  return given && *given ? std::filesystem::path(given)
                         : std::filesystem::path(HERMESH_SOURCE_DIR) / "experiments";
}

void add_laboratory(CLI::App& app, Session& session) {
  for (const auto& [name, summary] : kCommands) {
    CLI::App* const command = app.add_subcommand(name, summary);
    command->set_help_flag();
    command->prefix_command();
    command->callback([command, &session] {
      session.command = [command, &session]() -> int {
        std::vector<std::string> words{command->get_name()};
        if (session.quiet) words.emplace_back("--quiet");
        if (session.threads) words.insert(words.end(), {"--threads", std::to_string(*session.threads)});
        const std::vector<std::string> rest = command->remaining();
        words.insert(words.end(), rest.begin(), rest.end());
        become_laboratory(words);
      };
    });
  }
}

std::optional<std::string> laboratory_output(const std::vector<std::string>& words) {
  std::error_code error;
  if (!std::filesystem::exists(experiments_directory() / "lab/__main__.py", error)) return std::nullopt;
  const std::vector<std::string> command = laboratory_command(words);
  ChildRun child(command[0], {command.begin() + 1, command.end()});
  while (!child.has_ended()) ChildRun::wait_for_any({&child}, 100);
  if (child.exit_code() != 0) throw Error("the laboratory failed: " + child.err());
  return child.out();
}

}  // namespace hermesh::cli
