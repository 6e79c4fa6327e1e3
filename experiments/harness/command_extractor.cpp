#include "experiments/harness/command_extractor.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <regex>
#include <set>

#include "algorithms/core/shown.h"
#include "algorithms/io/mesh_file.h"
#include "algorithms/io/vdb_file.h"
#include "algorithms/variants.h"
#include "experiments/cases/cases.h"
#include "experiments/measure.h"
#include "experiments/pipeline.h"

namespace hermesh {
namespace {

namespace fs = std::filesystem;

/// A temporary directory.
class Scratch {
 public:
  Scratch() {
    static std::atomic<int> count{0};
    path_ = fs::temp_directory_path() /
            ("hermesh-command-" + std::to_string(getpid()) + "-" + std::to_string(++count));
    fs::create_directories(path_);
  }
  ~Scratch() {
    std::error_code gone;
    fs::remove_all(path_, gone);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

const std::regex kPlaceholder("\\{([a-z.]*|[0-9.]+ voxel)\\}"), kVoxels("([0-9]+(\\.[0-9]+)?) voxel");
const std::regex kMeshFile("(in|out|uniform)(\\.(ply|obj|stl|off))?");

/// Exit codes: Automake's for a test that is skipped, and the shell's for a program that it does not find.
constexpr int kSkipped = 77, kNotFound = 127;

/// Replaces each word in braces by the result of `replace`.
std::string replaced(const std::string& command,
                     const std::function<std::string(const std::string&)>& replace) {
  std::string text;
  std::size_t done = 0;
  for (std::sregex_iterator word(command.begin(), command.end(), kPlaceholder), end; word != end; ++word) {
    text +=
        command.substr(done, static_cast<std::size_t>(word->position()) - done) + replace((*word)[1].str());
    done = static_cast<std::size_t>(word->position() + word->length());
  }
  return text + command.substr(done);
}

std::string last_line(const fs::path& file) {
  std::ifstream stream(file);
  std::string last;
  for (std::string line; std::getline(stream, line);)
    if (!line.empty()) last = line;
  return shown(last, 200);
}

/// Returns the number of the last line "word NUMBER" with a finite number that is not negative.
std::optional<double> number_said(const fs::path& file, const std::string& word) {
  std::ifstream stream(file);
  std::optional<double> number;
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with(word + " ")) continue;
    const char* const from = line.c_str() + word.size() + 1;
    char* end = nullptr;
    const double value = std::strtod(from, &end);
    if (end != from && *end == '\0' && std::isfinite(value) && value >= 0.0) number = value;
  }
  return number;
}

/// Runs the command with its output in a file. @throws Cancelled; Error if it does not end with 0.
void run_shell(const std::string& command, const fs::path& log, RunContext& context) {
  const std::string name = log.string();
  const pid_t parent = getpid();
  rusage used{};
  int status = 0;
  const double seconds = timed([&] {
    const pid_t pid = fork();
    if (pid < 0) throw Error(std::string("cannot start a shell: ") + std::strerror(errno));
    if (pid == 0) {
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (getppid() != parent) _exit(127);
      const int out = open(name.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644),
                in = open("/dev/null", O_RDONLY);
      dup2(in, STDIN_FILENO);
      dup2(out, STDOUT_FILENO);
      dup2(out, STDERR_FILENO);
      execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
      _exit(127);
    }
    while (true) {
      const pid_t ended = wait4(pid, &status, WNOHANG, &used);
      if (ended == pid || (ended < 0 && errno != EINTR)) break;
      if (context.cancelled()) {
        kill(pid, SIGKILL);
        wait4(pid, &status, 0, nullptr);
        throw Cancelled();
      }
      usleep(300);
    }
  });
  const std::string said = last_line(log), more = said.empty() ? "" : ": " + said;
  if (WIFSIGNALED(status))
    throw Error(std::string("the command crashed (") + strsignal(WTERMSIG(status)) + ")" + more);
  if (WEXITSTATUS(status) == kNotFound) throw ProgramAbsent("the shell does not find its program");
  if (WEXITSTATUS(status) == kSkipped)
    throw ProgramAbsent(said.empty() ? "it ended with 77 and without a reason" : said);
  if (WEXITSTATUS(status) > 128)  // reported by the shell
    throw Error(std::string("the command crashed (") + strsignal(WEXITSTATUS(status) - 128) + ")" + more);
  if (WEXITSTATUS(status) != 0)
    throw Error("the command ended with exit code " + std::to_string(WEXITSTATUS(status)) + more);
  const double peak = double(used.ru_maxrss) * 1024;
  context.figure(std::string(kProcessSeconds), seconds);
  context.figure(std::string(kProcessPeakBytes), peak);
  // A time longer than the whole process cannot be right; nor can more memory.
  const auto own_seconds = number_said(log, "seconds"), own_bytes = number_said(log, "bytes");
  if (own_seconds && *own_seconds > seconds) throw Error("the command says that it took longer than it ran");
  if (own_bytes && *own_bytes > peak) throw Error("the command says that it took more memory than it had");
  context.figure(std::string(kCommandSeconds), own_seconds.value_or(seconds));
  context.figure(std::string(kCommandPeakBytes), own_bytes.value_or(peak));
}

PolygonMesh run_command(const ExtractionInput& input) {
  const Scratch scratch;
  fs::path made;
  RunContext quiet;  // drops warnings about the precision of temporary files
  quiet.cancel = input.context.cancel;
  const std::string command = replaced(input.options.text("run"), [&](const std::string& word) {
    if (std::smatch name; std::regex_match(word, name, kMeshFile)) {
      const fs::path file = scratch / (name[2].matched ? word : word + ".ply");
      if (name[1] == "in" && !input.source)
        throw Error("the command needs polygons ({in}), but the volume was not made from any");
      if (name[1] == "in" && !fs::exists(file)) write_mesh(file, *input.source, quiet);
      if (name[1] == "uniform" && !fs::exists(file)) {
        const ExtractRecipe recipe{.chosen = choose(our_extractors(), "marching-cubes")};
        write_mesh(file, extract(input.level_set, input.source, recipe, quiet).mesh, quiet);
      }
      if (name[1] == "out") made = file;
      return shell_quoted(file.string());
    }
    if (word == "source") return shell_quoted(HERMESH_SOURCE_DIR);
    if (word == "build") return shell_quoted(HERMESH_BUILD_DIR);
    if (word == "volume") {
      const fs::path file = scratch / "volume.vdb";
      if (!fs::exists(file)) write_level_set(file, input.level_set, quiet);
      return shell_quoted(file.string());
    }
    std::smatch number;
    if (word == "voxel" || std::regex_match(word, number, kVoxels)) {
      const double factor = word == "voxel" ? 1.0 : std::strtod(number[1].str().c_str(), nullptr);
      char text[40];
      std::snprintf(text, sizeof text, "%.17g", factor * input.level_set.voxel_size());
      return std::string(text);
    }
    return std::to_string(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  });
  run_shell(command, scratch / "log", input.context);
  if (!fs::exists(made)) {
    const std::string said = last_line(scratch / "log");
    throw Error("the command ended well and wrote no mesh" + (said.empty() ? "" : ": " + said));
  }
  return read_mesh(made, quiet);
}

}  // namespace

Extractor command_extractor(const std::string& name, const std::string& command) {
  bool writes = false;
  replaced(command, [&](const std::string& word) {
    std::smatch parts;
    const bool is_file = std::regex_match(word, parts, kMeshFile);
    writes = writes || (is_file && parts[1] == "out");
    static const std::set<std::string> plain = {"volume", "voxel", "threads", "source", "build"};
    if (!is_file && !std::regex_match(word, kVoxels) && !plain.contains(word))
      throw Error(
          "unknown word {" + word +
          "} in a command; expected {in}, {uniform}, {volume}, {out}, {voxel} or {0.25 voxel}, {threads}, "
          "{source} or {build}");
    return std::string();
  });
  if (!writes) throw Error("a command needs {out}, the file that it has to write");
  return {.name = name,
          .summary = "an outside program",
          .promises = {},
          .options = {{.name = "run", .fallback = command, .help = "the command", .choices = {command}}},
          .extract = run_command};
}

}  // namespace hermesh
