// Runs the program in a test, and makes the small files that it works on.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace hermesh::cli {

/// Words of a command line; a text is split at its blanks.
struct Words : std::vector<std::string> {
  Words() = default;
  Words(std::initializer_list<std::string> words) : vector(words) {}
  Words(const std::string& text) {
    std::istringstream stream(text);
    for (std::string word; stream >> word;) push_back(word);
  }
  Words(const char* text) : Words(std::string(text)) {}

  Words operator+(const Words& more) const {
    Words all = *this;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};

inline bool has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}
inline bool lacks(const std::string& text, const std::string& part) { return !has(text, part); }
inline std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++found;
  return found;
}

/// The result of a run of the program.
struct Outcome {
  int exit_code = -1;  ///< −1 if a signal killed it
  std::string out, err;
  double seconds = 0.0;  ///< from the signal on, if one was sent
};

struct Interruption {
  int signal;
  std::chrono::milliseconds after;  ///< from when the program handles it
};

/// Every test works in a new directory, which is removed at the end.
class ProgramTest : public testing::Test {
 protected:
  ProgramTest();
  ~ProgramTest() override;

  /// Runs `hermesh` with these arguments, the test's directory as working directory and an empty stdin.
  Outcome run(const Words& arguments, std::optional<Interruption> interruption = {});
  /// Runs `hermesh` as run() does, and expects the exit code.
  Outcome run_to(int exit_code, const Words& arguments, std::optional<Interruption> interruption = {});
  /// Returns the JSON on stdout of such a run.
  nlohmann::json json_of(const Words& arguments, int exit_code = 0) {
    return nlohmann::json::parse(run_to(exit_code, arguments).out);
  }
  /// Expects the exit code, a message with all of `words` as one line without control characters of at most
  /// `longest` bytes, the last line on stderr and the only one unless notes are allowed, and that the set of
  /// files is unchanged.
  void expect_refusal(int exit_code, const Words& arguments, const Words& words, bool notes_allowed = false,
                      std::size_t longest = 1600);

  /// Runs a script of the shell in the test's directory; $H is the program.
  Outcome run_shell(const std::string& script);

  /// Sets a limit (RLIMIT_…) for later runs.
  void limit(int resource, std::uint64_t value) { limits_.emplace_back(resource, value); }

  std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  /// Runs `hermesh` as run() does, with a terminal for stderr; returns everything sent to the terminal.
  std::string terminal_output(const Words& arguments);

  void write(const std::string& name, const std::string& content);
  std::string read(const std::string& name) const;
  /// Names of all files in the directory.
  std::set<std::string> files() const;

  /// Writes a cube with a side of 2 about the origin, 8 points and 12 triangles, as cube.off.
  void write_cube();
  /// Writes the cube without one of its faces, so that the program notes a hole, as open.off.
  void write_open_cube();
  /// Writes a unit sphere of latitudes and longitudes, as sphere.off.
  void write_sphere();

 private:
  /// Executes the program of the first word in the child process, after setting streams, directory and
  /// limits; `err` is a file descriptor for stderr.
  [[noreturn]] void become(Words words, int err) const;
  /// Executes `hermesh` with these arguments, as become() does.
  [[noreturn]] void execute(Words words, int err) const;
  /// Waits for a child process and returns its outcome.
  Outcome outcome_of(int child) const;

  std::filesystem::path folder_, streams_;
  std::vector<std::pair<int, std::uint64_t>> limits_;
};

}  // namespace hermesh::cli
