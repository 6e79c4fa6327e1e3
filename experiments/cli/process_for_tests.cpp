#include "experiments/cli/process_for_tests.h"

#include <fcntl.h>
#include <pty.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace hermesh::cli {
namespace {

using Clock = std::chrono::steady_clock;

std::filesystem::path make_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "hermesh_cli_XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("cannot make " + name);
  return name;
}

std::string content_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream content;
  content << in.rdbuf();
  return content.str();
}

int open_or_exit(const std::filesystem::path& file, int flags) {
  const int opened = open(file.c_str(), flags | O_CLOEXEC, 0600);
  if (opened < 0) _exit(126);
  return opened;
}

/// Returns once the process has a handler for the signal (or has ended): before that, the signal would end
/// it.
void wait_for_handler(pid_t process, int signal) {
  const std::string key = "SigCgt:";
  for (;; std::this_thread::sleep_for(std::chrono::milliseconds(1))) {
    const std::string status = content_of("/proc/" + std::to_string(process) + "/status");
    const std::size_t at = status.find(key);
    if (at == std::string::npos) return;
    if (std::stoull(status.substr(at + key.size()), nullptr, 16) >> (signal - 1) & 1) return;
  }
}

}  // namespace

ProgramTest::ProgramTest() : folder_(make_folder()), streams_(make_folder()) {}

ProgramTest::~ProgramTest() {
  std::filesystem::remove_all(folder_);
  std::filesystem::remove_all(streams_);
}

void ProgramTest::execute(Words words, int err) const {
  words.insert(words.begin(), HERMESH_PROGRAM);
  become(std::move(words), err);
}

void ProgramTest::become(Words words, int err) const {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  dup2(open_or_exit("/dev/null", O_RDONLY), STDIN_FILENO);
  dup2(open_or_exit(streams_ / "out", O_WRONLY | O_CREAT | O_TRUNC), STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  if (chdir(folder_.c_str()) != 0) _exit(126);
  for (const auto& [resource, value] : limits_) {
    const struct rlimit limit = {value, value};
    if (setrlimit(static_cast<__rlimit_resource_t>(resource), &limit) != 0) _exit(126);
  }
  for (const int number : {SIGHUP, SIGPIPE, SIGXCPU})
    ::signal(number, SIG_DFL);  // the caller of the test may ignore them
  execv(argv[0], argv.data());
  _exit(127);
}

Outcome ProgramTest::run(const Words& arguments, std::optional<Interruption> interruption) {
  const pid_t child = fork();
  if (child == 0) execute(arguments, open_or_exit(streams_ / "err", O_WRONLY | O_CREAT | O_TRUNC));
  if (interruption) {
    wait_for_handler(child, interruption->signal);
    std::this_thread::sleep_for(interruption->after);
    kill(child, interruption->signal);
  }
  return outcome_of(child);
}

Outcome ProgramTest::run_to(int exit_code, const Words& arguments, std::optional<Interruption> interruption) {
  std::string command = "hermesh";
  for (const std::string& argument : arguments) command += " " + argument;
  Outcome outcome = run(arguments, interruption);
  EXPECT_EQ(outcome.exit_code, exit_code) << command.substr(0, 200) << '\n' << outcome.out << outcome.err;
  return outcome;
}

void ProgramTest::expect_refusal(int exit_code, const Words& arguments, const Words& words,
                                 bool notes_allowed, std::size_t longest) {
  const std::set<std::string> before = files();
  const std::string err = run_to(exit_code, arguments).err;
  const std::size_t line = err.rfind("hermesh: ");
  ASSERT_NE(line, std::string::npos) << err;
  EXPECT_TRUE(line == 0 || (notes_allowed && err[line - 1] == '\n')) << err;
  EXPECT_EQ(count(err.substr(line), "\n"), 1u) << err;
  EXPECT_LE(err.size() - line, longest) << err;
  EXPECT_TRUE(
      std::ranges::none_of(err, [](unsigned char c) { return (c < 0x20 && c != '\n') || c == 0x7f; }));
  for (const std::string& word : words) EXPECT_PRED2(has, err, word);
  EXPECT_EQ(files(), before);
}

Outcome ProgramTest::run_shell(const std::string& script) {
  const pid_t child = fork();
  if (child == 0) {
    setenv("H", HERMESH_PROGRAM, 1);
    become({"/bin/bash", "-c", script}, open_or_exit(streams_ / "err", O_WRONLY | O_CREAT | O_TRUNC));
  }
  return outcome_of(child);
}

Outcome ProgramTest::outcome_of(int child) const {
  const Clock::time_point start = Clock::now();
  int status = 0;
  waitpid(child, &status, 0);
  const std::chrono::duration<double> elapsed = Clock::now() - start;
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, content_of(streams_ / "out"),
          content_of(streams_ / "err"), elapsed.count()};
}

std::string ProgramTest::terminal_output(const Words& arguments) {
  int terminal = -1, end_of_program = -1;
  if (openpty(&terminal, &end_of_program, nullptr, nullptr, nullptr) != 0)
    throw std::runtime_error("cannot open a terminal");
  const pid_t child = fork();
  if (child == 0) execute(arguments, end_of_program);
  close(end_of_program);
  std::string sent;
  char buffer[4096];
  // Reading fails once the program has closed its end.
  for (ssize_t size; (size = ::read(terminal, buffer, sizeof buffer)) > 0;) sent.append(buffer, size);
  close(terminal);
  waitpid(child, nullptr, 0);
  return sent;
}

void ProgramTest::write(const std::string& name, const std::string& content) {
  std::ofstream(path(name), std::ios::binary) << content;
}

std::string ProgramTest::read(const std::string& name) const { return content_of(path(name)); }

std::set<std::string> ProgramTest::files() const {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_))
    names.insert(std::filesystem::relative(entry.path(), folder_).string());
  return names;
}

void ProgramTest::write_cube() {
  write("cube.off",
        "OFF\n8 12 0\n-1 -1 -1\n1 -1 -1\n1 1 -1\n-1 1 -1\n-1 -1 1\n1 -1 1\n1 1 1\n-1 1 1\n"
        "3 0 2 1\n3 0 3 2\n3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n"
        "3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n");
}

void ProgramTest::write_open_cube() {
  write_cube();
  std::string cube = read("cube.off");
  const std::string face = "3 3 0 4\n3 3 4 7\n", all = "8 12 0";
  cube.erase(cube.find(face), face.size());
  cube.replace(cube.find(all), all.size(), "8 10 0");
  write("open.off", cube);
}

void ProgramTest::write_sphere() {
  constexpr int kRings = 24, kSides = 48;
  const auto ring_point = [](int ring, int side) { return 1 + (ring - 1) * kSides + side % kSides; };
  std::ostringstream points, faces;
  int face_count = 0;
  points << "0 0 1\n";
  for (int ring = 1; ring < kRings; ++ring)
    for (int side = 0; side < kSides; ++side) {
      const double polar = std::numbers::pi * ring / kRings, azimuth = 2 * std::numbers::pi * side / kSides;
      points << std::sin(polar) * std::cos(azimuth) << ' ' << std::sin(polar) * std::sin(azimuth) << ' '
             << std::cos(polar) << '\n';
    }
  points << "0 0 -1\n";
  const int south = 1 + (kRings - 1) * kSides;
  const auto face = [&](int a, int b, int c) {
    faces << "3 " << a << ' ' << b << ' ' << c << '\n';
    ++face_count;
  };
  for (int side = 0; side < kSides; ++side) {
    face(0, ring_point(1, side), ring_point(1, side + 1));
    face(south, ring_point(kRings - 1, side + 1), ring_point(kRings - 1, side));
    for (int ring = 1; ring < kRings - 1; ++ring) {
      face(ring_point(ring, side), ring_point(ring + 1, side), ring_point(ring + 1, side + 1));
      face(ring_point(ring, side), ring_point(ring + 1, side + 1), ring_point(ring, side + 1));
    }
  }
  std::ostringstream header;
  header << "OFF\n" << south + 1 << ' ' << face_count << " 0\n";
  write("sphere.off", header.str() + points.str() + faces.str());
}

}  // namespace hermesh::cli
