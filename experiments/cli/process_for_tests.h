// Runs the program in a test, and makes the small files that it works on.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace hermesh::cli {

/// What became of a run of the program.
struct Outcome {
  int exit_code = -1;  ///< −1 if a signal killed it
  std::string out, err;
  double seconds = 0.0;  ///< from the signal on, where one was sent
};

struct Interruption {
  int signal;
  std::chrono::milliseconds after;  ///< from when the program handles it
};

/// Every test works in a new folder of its own, which is removed at the end.
class ProgramTest : public testing::Test {
 protected:
  ProgramTest();
  ~ProgramTest() override;

  /// Runs `hermesh` with these arguments, the test's folder as working directory and nothing to read on
  /// stdin.
  Outcome run(const std::vector<std::string>& arguments, std::optional<Interruption> interruption = {});

  /// Runs a script of the shell in the test's folder, in which $H is the program.
  Outcome run_shell(const std::string& script);

  /// Sets a limit (RLIMIT_…) for the programs that are run from now on.
  void limit(int resource, std::uint64_t value) { limits_.emplace_back(resource, value); }

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  /// Runs `hermesh` as run() does, with a terminal for stderr; returns all that the terminal was sent.
  std::string terminal_output(const std::vector<std::string>& arguments);

  void write(const std::string& name, const std::string& content);
  std::string read(const std::string& name) const;
  /// Names of all that is in the folder.
  std::set<std::string> files() const;

  /// A cube with a side of 2 about the origin, 8 points and 12 triangles, as cube.off.
  void write_cube();
  /// The cube without one of its faces, of which the program notes that it has a hole, as open.off.
  void write_open_cube();
  /// A unit sphere of latitudes and longitudes, as sphere.off.
  void write_sphere();

 private:
  /// Becomes the program of the first word, in the child process: streams, folder and limits are set first;
  /// `err` is a file descriptor for stderr.
  [[noreturn]] void become(std::vector<std::string> words, int err) const;
  /// Becomes `hermesh` with these arguments, as become() does.
  [[noreturn]] void execute(std::vector<std::string> words, int err) const;
  /// What becomes of a child process, once it has ended.
  Outcome outcome_of(int child) const;

  std::filesystem::path folder_, streams_;
  std::vector<std::pair<int, std::uint64_t>> limits_;
};

}  // namespace hermesh::cli
